#pragma once

#include "geometry/trilinear.h"
#include "its/inspect.h"
#include "its/query.h"
#include "query/index.h"

/// The side of a point in a cell that meets M.
namespace its::query {

/// A point in a surface cell.
struct SurfacePoint {
    std::uint64_t group;  ///< of level 0
    unsigned child;
    octree::Cell finest;
    Vec3 local;  ///< in the cell, [0, 1)
};

/// Rounding that the decisions by f allow for, in cell widths: 512u. f̂ errs by 32u·V; each of three legs of a
/// walk may lose twice as much where it picks the lower end; V ≤ 2, since a corner of a cell that meets M is at
/// most √3 and some rounding away from M. 7·64u < 512u. See docs/design/query.md.
inline constexpr double walk_margin = 512 * unit_roundoff;

/// f as ThinShell::value computes it in a surface cell.
ITS_INLINE double surface_value(const QueryIndex& index, const SurfacePoint& at, double (&value)[8]) {
    corner_values(index.levels[0], at.group, at.child, value);
    return geometry::trilinear(value, at.local);
}

/// The side by f and the local bounds [lower, upper] of the surface cell, where they tell it without a walk: 1
/// outside, −1 inside, 0 not known. For SignRule::winding: f rises from p to a corner with f > 0, or falls to
/// one with f < 0, without meeting M.
ITS_INLINE int side_by_bounds(double f, float lower, float upper) {
    const double high = upper > 0 ? double(upper) : 0.0, low = lower < 0 ? double(lower) : 0.0;
    return int(f > high + walk_margin) - int(f < low - walk_margin);
}

/// Whether the side is constant where M is not, as a function of the winding number is: all that is below needs
/// it.
inline bool constant_off_surface(SignRule rule) {
    return rule != SignRule::generalized;
}

/// For the other rules: on the surface exactly where a triangle holds the point, else the sign of f.
Side side_by_sign_of_field(const QueryIndex& index, const Vec3& point, double f);

/// The exact side of any point in a surface cell, by whatever it takes.
Side decide(const QueryIndex& index, const Vec3& point, const SurfacePoint& at);

/// How decide() came to its answer; for statistics.
enum class Decision : std::uint8_t { bounds, walk, local };
Decision how_decided(const QueryIndex& index, const SurfacePoint& at);

}  // namespace its::query
