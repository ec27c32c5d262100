#pragma once

#include <string>

#include "its/mesh.h"

/// CGAL's second opinion on extracted surfaces, with exact predicates.
namespace its::judge {

/// What is wrong with a mesh that should be closed, 2-manifold (edges and vertices), without degenerate
/// triangles and self-intersections, and oriented so that its signed volume is positive; empty if nothing is.
std::string surface_defects(const Mesh& mesh);

/// Number of triangles of m that meet the surface.
std::size_t triangles_meeting(const Mesh& m, const Mesh& surface);

/// Number of vertices used by m's triangles that are not strictly inside the closed surface.
std::size_t vertices_not_inside(const Mesh& m, const Mesh& surface);

/// Number of vertices of the surface that are not strictly inside the closed mesh m.
inline std::size_t surface_not_inside(const Mesh& surface, const Mesh& m) {
    return vertices_not_inside(surface, m);
}

/// From a point to the nearest triangle, by looking at all of them.
double distance(const Vec3& p, const Mesh& mesh);

}  // namespace its::judge
