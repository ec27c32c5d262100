#pragma once

#include <algorithm>
#include <cmath>

#include "base/rounding.h"
#include "its/base.h"

/// Exact signs of determinants of points, and lattice-line crossings built on them.
///
/// Every function is exact for all finite coordinates, without tolerance: a floating-point filter decides
/// most calls, expansion arithmetic the rest while every coordinate is 0 or has a magnitude in
/// [1e-90, 1e100], and big integers (some 10 µs) beyond that range. Non-finite coordinates are not allowed.
/// Needs round-to-nearest and no contraction; see docs/design/geometry.md.
namespace its::geometry {

namespace detail {

/// Of the computed (p−q)(r−s) − (t−v)(w−z) each of the two products goes through four roundings: two
/// differences, the product, the subtraction. |error| ≤ ((1+u)⁴ − 1)·S with S the exact sum of the products'
/// magnitudes, and the computed sum is at least (1−u)⁴·S; 5u covers ((1+u)⁴ − 1)/(1−u)⁴ = 4u + O(u²) and the
/// roundings of the bound itself.
inline constexpr double orient2d_filter = 5 * unit_roundoff;

/// Of the computed n·w, n = u×v, each of the six monomials goes through at most eight roundings: three
/// differences, two products, the minor's subtraction, two sums. 9u covers ((1+u)⁸ − 1)/(1−u)⁸ = 8u + O(u²).
inline constexpr double orient3d_filter = 9 * unit_roundoff;

/// Underflow adds at most 2⁻¹⁰⁷⁵ to each product's error; far less than this.
inline constexpr double underflow_guard = 0x1p-1000;

/// sign((bx−ax)(cy−ay) − (by−ay)(cx−ax)) where the filter has failed.
int orient2d_exact(double ax, double ay, double bx, double by, double cx, double cy);
int orient3d_exact(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

inline int sign(double v) {
    return (v > 0) - (v < 0);
}

}  // namespace detail

/// Sign of the doubled signed area of the plane triangle abc: 1 if counter-clockwise, 0 if collinear.
inline int orient2d(double ax, double ay, double bx, double by, double cx, double cy) {
    const double left = (bx - ax) * (cy - ay), right = (by - ay) * (cx - ax);
    const double det = left - right;
    const double bound = detail::orient2d_filter * (std::abs(left) + std::abs(right)) + detail::underflow_guard;
    if (det > bound) return 1;  // false too if anything has overflown: then an infinity or NaN is on both sides
    if (-det > bound) return -1;
    return detail::orient2d_exact(ax, ay, bx, by, cx, cy);
}

/// Sign of det[b−a, c−a, d−a]: 1 iff d lies strictly on the side of the plane abc that n = (b−a)×(c−a)
/// points to, that is from where abc is counter-clockwise; 0 iff the four points are coplanar.
inline int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const double ux = b.x - a.x, uy = b.y - a.y, uz = b.z - a.z;
    const double vx = c.x - a.x, vy = c.y - a.y, vz = c.z - a.z;
    const double wx = d.x - a.x, wy = d.y - a.y, wz = d.z - a.z;
    const double x1 = uy * vz, x2 = uz * vy, y1 = uz * vx, y2 = ux * vz, z1 = ux * vy, z2 = uy * vx;
    const double det = (x1 - x2) * wx + (y1 - y2) * wy + (z1 - z2) * wz;
    const double sum = (std::abs(x1) + std::abs(x2)) * std::abs(wx) +
                       (std::abs(y1) + std::abs(y2)) * std::abs(wy) +
                       (std::abs(z1) + std::abs(z2)) * std::abs(wz);
    // An underflow in a minor is multiplied by |w|, hence the guard's factor.
    const double bound = detail::orient3d_filter * sum +
                         detail::underflow_guard * (1 + std::abs(wx) + std::abs(wy) + std::abs(wz));
    if (det > bound) return 1;
    if (-det > bound) return -1;
    return detail::orient3d_exact(a, b, c, d);
}

/// Whether triangle abc has exactly zero area.
bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c);

// The perturbed predicates. Each grid point g stands for g + (ε_x, ε_y, ε_z), the same infinitesimal vector
// for all, with ε_y ≫ ε_z ≫ ε_x > 0. A sign is that of the unperturbed determinant or, where this is 0, of
// the coefficient of the largest ε whose coefficient does not vanish.

/// Sign of orient2d of the (y, z) projections of a, b and g + ε; 0 only if those of a and b coincide.
inline int perturbed_orient2d_yz(const Vec3& a, const Vec3& b, const Vec3& g) {
    const int s = orient2d(a.y, a.z, b.y, b.z, g.y, g.z);
    if (s != 0) return s;
    return a.z != b.z ? detail::sign(a.z - b.z) : detail::sign(b.y - a.y);
}

/// Sign of orient3d(a, b, c, g + ε); 0 only if abc is degenerate.
int perturbed_orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g);

/// The same in the plane of the two axes after `axis` in cyclic order; x is that of perturbed_orient2d_yz().
inline int perturbed_orient2d(int axis, const Vec3& a, const Vec3& b, const Vec3& g) {
    const int i = axis == 2 ? 0 : axis + 1, j = axis == 0 ? 2 : axis - 1;
    const int s = orient2d(a[i], a[j], b[i], b[j], g[i], g[j]);
    if (s != 0) return s;
    // What the first coordinate's displacement is multiplied with, and the second one's. In the planes (y, z)
    // and (z, x) the first is larger, in (x, y) the second.
    const int first = detail::sign(a[j] - b[j]), second = detail::sign(b[i] - a[i]);
    if (axis == 2) return second != 0 ? second : first;
    return first != 0 ? first : second;
}

namespace detail {
int line_crossing_in_bounds(int axis, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g, double to);
int x_line_crossing_in_bounds(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g, double x1);
}  // namespace detail

/// Crossing of triangle abc by the segment from g + ε to (x1, g.y, g.z) + ε, g.x < x1: 0 if there is none,
/// else what the winding number gains on the way in +x direction: +1 where the triangle's normal points to −x
/// (into a closed mesh whose triangles are counter-clockwise seen from outside), −1 where it points to +x.
/// The displaced line meets no edge or vertex, so it goes through exactly as many triangles around each as a
/// line beside it would; and a triangle that the line crosses is crossed by exactly one of its consecutive
/// segments. Degenerate triangles and triangles parallel to x are never crossed.
inline int x_line_crossing(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g, double x1) {
    // g.y = min y counts as inside, since g is displaced upwards, and g.y = max y as outside; the same for z.
    if (g.y < std::min({a.y, b.y, c.y}) || g.y >= std::max({a.y, b.y, c.y})) return 0;
    if (g.z < std::min({a.z, b.z, c.z}) || g.z >= std::max({a.z, b.z, c.z})) return 0;
    // A crossing at x lies in [min x, max x] and counts if g.x + ε_x < x < x1 + ε_x.
    if (g.x >= std::max({a.x, b.x, c.x}) || x1 < std::min({a.x, b.x, c.x})) return 0;
    return detail::x_line_crossing_in_bounds(a, b, c, g, x1);
}

/// The same along any axis: of the segment from g + ε to g′ + ε, where g′ is g but for g′[axis] = to > g[axis].
inline int line_crossing(int axis, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g, double to) {
    for (int i = 0; i < 3; ++i) {
        const double end = i == axis ? to : g[i];
        if (g[i] >= std::max({a[i], b[i], c[i]}) || end < std::min({a[i], b[i], c[i]})) return 0;
    }
    return detail::line_crossing_in_bounds(axis, a, b, c, g, to);
}

/// Signed crossing of triangle abc by the segment from p to q: what the winding number gains from p to q, +1
/// against the normal (b−a)×(c−a), −1 along it, 0 if they do not meet.
/// \param degenerate  set to true iff they meet in any other way than the interior of the segment passing
///                    through the interior of the triangle: then the result is 0. Set to false otherwise.
int segment_crossing(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p, const Vec3& q,
                     bool& degenerate);

}  // namespace its::geometry
