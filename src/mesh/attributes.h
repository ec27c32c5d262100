#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "its/mesh.h"

namespace its {

/// Corners of triangles, put together where they have the same vertex and the same values.
struct Wedges {
    std::vector<Triangle> triangles;   ///< numbers of the corners' wedges: by vertex, then by first occurrence
    std::vector<std::uint64_t> first;  ///< of each wedge the first corner 3t + k
};

/// \param triangles  of vertices below `vertices`; the attributes are theirs
Wedges wedges_of(std::span<const Triangle> triangles, std::size_t vertices, const MeshAttributes& attributes);

/// The normals of a mesh's vertices at the corners of its triangles: the mean of the triangles' normals around
/// the vertex, weighted by their angles there (Thürmer and Wüthrich 1998), which no way of cutting flat parts
/// into triangles changes. `creases`: triangles turned by more than 45° from the corner's own do not count, so
/// that sharp edges look sharp.
CornerValues<Vec3> vertex_normals(const Mesh& mesh, bool creases);

}  // namespace its
