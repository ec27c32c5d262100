#pragma once

#include <optional>
#include <span>

#include "its/mesh.h"

namespace its::mesh {

/// The normal of a triangle, twice its area long.
Vec3 area_vector(std::span<const Vec3> vertices, const Triangle& triangle);

/// Unit normals of vertices at the corners of their triangles: the mean of the triangles' normals around the
/// vertex, weighted by their angles there (Thürmer and Wüthrich 1998), which no way of cutting flat parts into
/// triangles changes. With a `crease`, in degrees: of the triangles only that the corner's own is connected to,
/// around the vertex, across edges at which normals turn by no more; so sharp edges look sharp. Without area:
/// (0, 0, 1).
CornerValues<Vec3> vertex_normals(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
                                  std::optional<double> crease = {});

}  // namespace its::mesh
