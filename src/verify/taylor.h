#pragma once

#include <algorithm>
#include <cmath>

#include "verify/polygon.h"

/// Bounds of a trilinear function over a polygon; coordinates of the cell, [0, 1]³ but for rounding.
namespace its::verifier {

/// The exact Taylor expansion of a trilinear function about `centre`:
/// f(centre + d) = f + g·d + h_xy dx dy + h_xz dx dz + h_yz dy dz + h_xyz dx dy dz.
struct Taylor {
    Vec3 centre, g;
    double f = 0, h_xy = 0, h_xz = 0, h_yz = 0, h_xyz = 0;

    double at(const Vec3& d) const {
        return f + g.x * d.x + g.y * d.y + g.z * d.z + h_xy * d.x * d.y + h_xz * d.x * d.z + h_yz * d.y * d.z +
               h_xyz * d.x * d.y * d.z;
    }
};

/// Expands the interpolation of corner values v (corner x + 2y + 4z) about c.
inline Taylor expand(const double (&v)[8], const Vec3& c) {
    const auto lerp = [](double a, double b, double t) { return a + t * (b - a); };
    const double x00 = lerp(v[0], v[1], c.x), x10 = lerp(v[2], v[3], c.x);
    const double x01 = lerp(v[4], v[5], c.x), x11 = lerp(v[6], v[7], c.x);
    const double d00 = v[1] - v[0], d10 = v[3] - v[2], d01 = v[5] - v[4], d11 = v[7] - v[6];
    Taylor out;
    out.centre = c;
    const double y0 = lerp(x00, x10, c.y), y1 = lerp(x01, x11, c.y);
    out.f = lerp(y0, y1, c.z);
    out.g.x = lerp(lerp(d00, d10, c.y), lerp(d01, d11, c.y), c.z);
    out.g.y = lerp(x10 - x00, x11 - x01, c.z);
    out.g.z = y1 - y0;
    out.h_xy = lerp(d10 - d00, d11 - d01, c.z);
    out.h_xz = lerp(d01 - d00, d11 - d10, c.y);
    out.h_yz = (x11 - x01) - (x10 - x00);
    out.h_xyz = (d11 - d01) - (d10 - d00);
    return out;
}

/// What is known of f over the hull of a polygon's vertices. `low` ≤ f ≤ `high`, and f takes the values
/// `attained_low` and `attained_high` at vertices; all four up to evaluation_error.
struct Range {
    double low = 0, high = 0, attained_low = 0, attained_high = 0;
    double remainder = 0;  ///< of the expansion: high − attained_high ≤ 2 · remainder, and so below
    int split_axis = 0;    ///< whose halving shrinks the remainder most
    double split_at = 0;
};

/// Rounding of everything in Range, for corner values up to V in size: less than 310 · 2⁻⁵³ V in all, where a
/// lerp adds 5, a difference doubles; the terms are counted in docs/design/verify.md.
inline double evaluation_error(const double (&v)[8]) {
    double largest = 0;
    for (const double value : v) largest = std::max(largest, std::abs(value));
    return 512 * 0x1p-53 * largest;
}

inline Range range(const double (&v)[8], const Polygon& polygon) {
    Vec3 low = polygon.vertex[0], high = low;
    for (int i = 1; i < polygon.count; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], polygon.vertex[i][axis]);
            high[axis] = std::max(high[axis], polygon.vertex[i][axis]);
        }
    Vec3 centre, r;
    for (int axis = 0; axis < 3; ++axis) {
        centre[axis] = 0.5 * (low[axis] + high[axis]);
        r[axis] = std::max(high[axis] - centre[axis], centre[axis] - low[axis]);
    }
    const Taylor taylor = expand(v, centre);
    Range out;
    double linear_low = 0, linear_high = 0;
    for (int i = 0; i < polygon.count; ++i) {
        const Vec3& p = polygon.vertex[i];
        const Vec3 d = {p.x - centre.x, p.y - centre.y, p.z - centre.z};
        const double linear = taylor.g.x * d.x + taylor.g.y * d.y + taylor.g.z * d.z;
        const double value = taylor.at(d);
        linear_low = i == 0 ? linear : std::min(linear_low, linear);
        linear_high = i == 0 ? linear : std::max(linear_high, linear);
        out.attained_low = i == 0 ? value : std::min(out.attained_low, value);
        out.attained_high = i == 0 ? value : std::max(out.attained_high, value);
    }
    const double xy = std::abs(taylor.h_xy) * r.x * r.y, xz = std::abs(taylor.h_xz) * r.x * r.z;
    const double yz = std::abs(taylor.h_yz) * r.y * r.z, xyz = std::abs(taylor.h_xyz) * r.x * r.y * r.z;
    out.remainder = xy + xz + yz + xyz;
    out.low = taylor.f + linear_low - out.remainder;
    out.high = taylor.f + linear_high + out.remainder;
    const double gain[3] = {xy + xz, xy + yz, xz + yz};
    out.split_axis = gain[0] >= gain[1] && gain[0] >= gain[2] ? 0 : gain[1] >= gain[2] ? 1 : 2;
    out.split_at = centre[out.split_axis];
    return out;
}

}  // namespace its::verifier
