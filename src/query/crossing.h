#pragma once

#include <algorithm>

#include "geometry/predicates.h"

/// The exact test of a segment from a point to a displaced grid point against a triangle.
namespace its::query {

/// Whether the closed triangle, which may be a segment or a point, holds p. Exact.
inline bool triangle_holds(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
    bool meet = false;
    geometry::segment_crossing(a, b, c, p, p, meet);
    return meet;
}

/// Whether the boxes of triangle and segment share a point; exact for the segment to g + ε as well, since an
/// infinitesimal displacement does not bring boxes together that are apart.
inline bool boxes_meet(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p, const Vec3& g) {
    const auto apart = [](double a1, double b1, double c1, double p1, double g1) {
        return std::max(p1, g1) < std::min({a1, b1, c1}) || std::min(p1, g1) > std::max({a1, b1, c1});
    };
    return !(apart(a.x, b.x, c.x, p.x, g.x) || apart(a.y, b.y, c.y, p.y, g.y) ||
             apart(a.z, b.z, c.z, p.z, g.z));
}

/// What the winding number gains from p to g + ε, the displaced grid point of geometry/predicates.h, by a
/// triangle that does not hold p: 1, 0 or −1. Never undecided: the segment meets an edge or vertex only if
/// these lie in a plane with it for all small ε, and then p is in the triangle's plane and the segment leaves
/// that at p, off the triangle.
/// \param p_side  orient3d(a, b, c, p); 0 for every degenerate triangle, which is not crossed
inline int displaced_crossing(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p, int p_side,
                              const Vec3& g) {
    if (p_side == 0 || geometry::perturbed_orient3d(a, b, c, g) == p_side) return 0;
    // orient3d(p, q, a, b) is orient3d(p, a, b, q), and q = g + ε.
    const int side = geometry::perturbed_orient3d(p, a, b, g);
    if (geometry::perturbed_orient3d(p, b, c, g) != side || geometry::perturbed_orient3d(p, c, a, g) != side)
        return 0;
    return p_side;
}

}  // namespace its::query
