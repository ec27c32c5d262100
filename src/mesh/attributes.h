#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "its/mesh.h"

namespace its::mesh {

/// Corners of triangles, put together where they have the same vertex and the same values.
struct Wedges {
    std::vector<Triangle> triangles;   ///< numbers of the corners' wedges: by vertex, then by first occurrence
    std::vector<std::uint64_t> first;  ///< of each wedge the first corner 3t + k
};

/// \param triangles  of vertices below `vertices`; the attributes are theirs
Wedges wedges_of(std::span<const Triangle> triangles, std::size_t vertices, const MeshAttributes& attributes);

}  // namespace its::mesh
