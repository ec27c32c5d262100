#pragma once

#include <numbers>

#include "base/platform/compiler.h"

/// What expansions of the winding number of patches have in common.
namespace its::winding {

inline constexpr double whole_sphere = 4 * std::numbers::pi;
/// Bounds of some tens of roundings are widened by far more.
inline constexpr double outward = 1 + 0x1p-40, inward = 1 - 0x1p-40;
/// The error of an expansion is looked at where a patch is farther away than this many of its radii.
inline constexpr double least_gap = 0.25;

/// Bound on the error of a patch's solid angle over 4π: scale · ∫ (|a| + |b|)³ dA + rounding.
struct PatchError {
    double scale, rounding;
};

/// The solid angle is ∫ n·K(r + u) dA, with r from the point of expansion to the patch's centroid and u = a −
/// b, b from there to the point. Term k of the Taylor series about r is at most (k + 1) |u|ᵏ / |r|ᵏ⁺²; those of
/// k ≥ 3 add up to at most |u|³/|r|⁵ (4 − 3t)/(1 − t)² for |u| ≤ t|r|, t < 1. And |u| ≤ |a| + |b|. Rounding:
/// the sums have below 2⁹ |n|/|r|² in all, of below 2⁵ roundings each; moments are off by those of their
/// centres.
///
/// \param length  |r|
///
/// \param most  > |u|, < length
///
/// \param reach  the largest coordinate
ITS_INLINE PatchError patch_error(double length, double most, double area, double reach) {
    const double gap = length - most, inverse = 1 / length, near = 1 / gap;
    const double q = gap * inverse, over = length * near, inverse2 = inverse * inverse;  // 1 − t
    return {(1 + 3 * q) * (over * over) * (inverse2 * inverse2 * inverse) * (outward / whole_sphere),
            area * (0x1p-38 * inverse2 + 0x1p-43 * reach * (near * near) * near) * (outward / whole_sphere)};
}

}  // namespace its::winding
