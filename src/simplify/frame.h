#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/platform/compiler.h"
#include "base/rounding.h"
#include "geometry/vec3.h"

/// A triangle in coordinates of its own plane, and distances to it.
namespace its::simplifier {

/// A distance to a triangle, of a point of another one that was cut, errs by less than this many unit roundoffs
/// of S₀, twice the largest coordinate. Derived in docs/design/simplify.md, "Rounding": below 191.
inline constexpr double distance_roundings = 256;

/// Triangle abc with a = (0, 0, 0), b = (bx, 0, 0), c = (cx, cy, 0) in the orthonormal frame (ex, ey, n) at a;
/// ab is the longest edge, so that 0 ≤ cx ≤ bx and the frame is orthonormal, and c in its plane, up to a few
/// roundings for any shape of triangle, a segment or a point included.
struct Frame {
    Vec3 a, ex, ey, n;
    double bx, cx, cy;

    /// In the frame's coordinates: z is the height over the plane.
    Vec3 local(const Vec3& p) const {
        const Vec3 d = p - a;
        return {dot(d, ex), dot(d, ey), dot(d, n)};
    }
    Vec3 b() const { return a + bx * ex; }
    Vec3 c() const { return a + (cx * ex + cy * ey); }
};

/// Some unit vector perpendicular to the unit vector e.
inline Vec3 perpendicular(const Vec3& e) {
    const int axis = std::abs(e.x) <= std::abs(e.y) ? (std::abs(e.x) <= std::abs(e.z) ? 0 : 2)
                                                    : (std::abs(e.y) <= std::abs(e.z) ? 1 : 2);
    Vec3 other;
    other[axis] = 1;
    const Vec3 v = other - dot(other, e) * e;
    return (1 / norm(v)) * v;
}

inline Frame make_frame(Vec3 a, Vec3 b, Vec3 c) {
    const double ab = dot(b - a, b - a), bc = dot(c - b, c - b), ca = dot(a - c, a - c);
    if (bc > ab && bc >= ca)
        std::swap(a, b), std::swap(b, c);  // b c a
    else if (ca > ab && ca > bc)
        std::swap(a, c), std::swap(b, c);  // c a b
    Frame f{.a = a, .ex = b - a, .ey = {}, .n = {}, .bx = norm(b - a), .cx = 0, .cy = 0};
    f.ex = f.bx > 0 ? (1 / f.bx) * f.ex : Vec3{1, 0, 0};
    const Vec3 ac = c - a;
    f.cx = dot(ac, f.ex);
    Vec3 rest = ac - f.cx * f.ex;
    rest = rest - dot(rest, f.ex) * f.ex;  // twice is enough (Kahan)
    f.cy = norm(rest);
    f.ey = f.cy > 0 ? (1 / f.cy) * rest : perpendicular(f.ex);
    if (std::abs(dot(f.ey, f.ex)) > 0x1p-50) f.ey = perpendicular(f.ex);  // rest was all rounding
    f.n = cross(f.ex, f.ey);
    return f;
}

/// What the distance of a point to a frame's triangle needs besides the frame.
struct EdgeTerms {
    double inverse_ab, inverse_bc, inverse_ca;  ///< 1/length², 0 of an edge without length
    double unit_bc, unit_ca;                    ///< 1/length

    explicit EdgeTerms(const Frame& f) {
        const auto inverse = [](double x) { return x > 0 ? 1 / x : 0.0; };
        const double bc = (f.cx - f.bx) * (f.cx - f.bx) + f.cy * f.cy, ca = f.cx * f.cx + f.cy * f.cy;
        inverse_ab = inverse(f.bx * f.bx);
        inverse_bc = inverse(bc);
        inverse_ca = inverse(ca);
        unit_bc = inverse(std::sqrt(bc));
        unit_ca = inverse(std::sqrt(ca));
    }
};

/// Squared distance of the point (x, y, z), frame coordinates, to the triangle; straight selections, so that
/// loops over points become vector code with the same bits.
ITS_INLINE double squared_distance(const Frame& f, const EdgeTerms& e, double x, double y, double z) {
    const auto unit = [](double t) { return t < 0.0 ? 0.0 : (t > 1.0 ? 1.0 : t); };
    const double dx = f.cx - f.bx, dy = f.cy, xb = x - f.bx;
    const double on_ab = x - unit(x * f.bx * e.inverse_ab) * f.bx;
    const double ab = on_ab * on_ab + y * y;
    const double s = unit((xb * dx + y * dy) * e.inverse_bc);
    const double bc = (xb - s * dx) * (xb - s * dx) + (y - s * dy) * (y - s * dy);
    const double t = unit((x * f.cx + y * f.cy) * e.inverse_ca);
    const double ca = (x - t * f.cx) * (x - t * f.cx) + (y - t * f.cy) * (y - t * f.cy);
    const double edges = ab < bc ? (ab < ca ? ab : ca) : (bc < ca ? bc : ca);
    const double from_bc = (xb * -dy + y * dx) * e.unit_bc, from_ca = (x * f.cy - y * f.cx) * e.unit_ca;
    // The triangle's box as well: where two edges meet under a small angle, their two signs alone would, with
    // roundings, take in points far beyond the corner.
    const bool inside =
        (y >= 0.0) & (y <= f.cy) & (x >= 0.0) & (x <= f.bx) & (from_bc >= 0.0) & (from_ca >= 0.0);
    return (inside ? 0.0 : edges) + z * z;
}

inline double squared_distance(const Frame& f, const EdgeTerms& e, const Vec3& p) {
    const Vec3 l = f.local(p);
    return squared_distance(f, e, l.x, l.y, l.z);
}

}  // namespace its::simplifier
