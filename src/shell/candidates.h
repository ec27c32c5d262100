#pragma once

#include <array>
#include <span>

#include "its/base.h"

/// The paper's extremes: a trilinear function takes its extremes over a planar polygon at one of finitely
/// many candidate points. See docs/design/candidates.md.
namespace its::shell {

/// Extremes of a function over a set, and points of the set where they are attained.
struct Range {
    double min = 0, max = 0;
    Vec3 argmin, argmax;
};

/// Extremes, over a convex planar polygon, of the trilinear interpolation of 8 corner values of the unit cell.
/// Not a bound but attained values, within about 1e-12 of the true extremes relative to the corner values'
/// magnitude; the certified extremes are found otherwise.
/// \param corner   values at the cell's corners, index x + 2y + 4z
/// \param polygon  1 vertex or more in [0, 1]³ up to rounding, in order, coplanar up to rounding; may be a
/// point
///                 or a segment
Range candidate_extremes(const std::array<double, 8>& corner, std::span<const Vec3> polygon);

}  // namespace its::shell
