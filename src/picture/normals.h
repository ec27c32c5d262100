#pragma once

#include <array>
#include <vector>

#include "its/mesh.h"

namespace its {

/// Unit normals for shading, three for each triangle: at a corner, the sum of the normals of the triangles
/// around it that are within `crease` degrees of the triangle's own, weighted by area. Edges sharper than that
/// stay sharp. Triangles without area have normals of (0, 0, 1).
std::vector<std::array<Vec3, 3>> shading_normals(const Mesh& mesh, double crease);

/// The normal of a triangle, twice its area long.
Vec3 area_vector(const Mesh& mesh, const Triangle& triangle);

}  // namespace its
