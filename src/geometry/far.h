#pragma once

#include <cmath>

#include "geometry/scaling.h"

/// f beyond the root cube, f(v) = f(clamp(v)) + |v − clamp(v)|, where the distance in cell widths, or its
/// square, is beyond all doubles, though that in mesh units may not be.
namespace its::geometry {

/// In cell widths. Nearer points are computed with in lattice coordinates, whose squares stay below 2⁸⁰⁴.
inline constexpr double far_cells = 0x1p400;

/// \param u  lattice coordinates, infinite where they are too large
inline bool far_beyond(const Vec3& u) {
    return !(largest_magnitude(u) < far_cells);
}

/// p − clamp(p) of a point that is far from the box for its size; 0 on axes along which p is in the box.
/// Nothing overflows: the box is far smaller than the largest doubles.
inline Vec3 beyond(const Vec3& p, const Box& box) {
    Vec3 away;
    for (int axis = 0; axis < 3; ++axis)
        away[axis] = p[axis] < box.min[axis]   ? p[axis] - box.min[axis]
                     : p[axis] > box.max[axis] ? p[axis] - box.max[axis]
                                               : 0.0;
    return away;
}

/// Along axes that are clamped f(clamp(v)) does not change, and the distance |away| does.
inline void set_beyond(Vec3& gradient, const Vec3& away) {
    const Vec3 scaled = times_power(away, -exponent_of(away));
    const double distance = norm(scaled);
    if (distance == 0) return;
    for (int axis = 0; axis < 3; ++axis)
        gradient[axis] = scaled[axis] == 0 ? gradient[axis] : scaled[axis] / distance;
}

}  // namespace its::geometry
