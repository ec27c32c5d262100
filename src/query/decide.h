#pragma once

#include <optional>

#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/query.h"
#include "query/index.h"
#include "winding/mesh_winding.h"

/// The side of a point in a cell that meets M.
namespace its::query {

/// Of a point with these lattice coordinates, in this finest cell. Exact: differences with what floor()
/// selects, and a power of two.
ITS_INLINE SurfacePoint surface_point(const Place& at, const octree::Cell& finest, const Vec3& u) {
    SurfacePoint p{at.group, at.child, at.level, finest, {}};
    if (at.level > 0)
        for (std::uint32_t& i : p.corner) i = i >> at.level << at.level;
    p.local = local_in(u, p.corner);
    if (at.level > 0) p.local = 1.0 / double(std::uint32_t{1} << at.level) * p.local;
    return p;
}

/// Rounding that the decisions by f allow for, in cell widths: 512u. f̂ errs by 32u·V; each of three legs of a
/// walk may lose twice as much where it picks the lower end; V ≤ 2, since a corner of a cell that meets M is at
/// most √3 and some rounding away from M. 7·64u < 512u. See docs/design/query.md.
inline constexpr double walk_margin = 512 * unit_roundoff;

/// f as ThinShell::value computes it in a surface cell.
ITS_INLINE double surface_value(const QueryIndex& index, const SurfacePoint& at, double (&value)[8]) {
    corner_values(index.levels[std::size_t(at.level)], at.group, at.child, value);
    return geometry::trilinear(value, at.local);
}

/// The same margin of an adaptive shell, where values are larger in larger cells: 256u times the largest.
ITS_INLINE double margin_of(const double (&value)[8]) {
    double largest = 0;
    for (const double v : value) {
        const double size = v < 0 ? -v : v;
        largest = size > largest ? size : largest;
    }
    return 256 * unit_roundoff * largest;
}

/// The side by f and the bounds of a surface cell of an adaptive shell, where hanging corners have no sign: the
/// corner that a walk would end at is among those beyond the bound, and these are all on one side. 0: not
/// known.
ITS_INLINE int side_by_corners(double f, const double (&value)[8], unsigned inside, float lower, float upper) {
    const double margin = margin_of(value);
    unsigned above = 0, below = 0;
    for (unsigned c = 0; c < 8; ++c) {
        above |= unsigned(value[c] > double(upper)) << c;
        below |= unsigned(value[c] < double(lower)) << c;
    }
    const unsigned ends = f > double(upper) + margin ? above : f < double(lower) - margin ? below : 0;
    if (ends == 0) return 0;
    if ((ends & inside) == 0) return 1;
    return (ends & ~inside) == 0 ? -1 : 0;
}

/// The side by f and the local bounds [lower, upper] of the surface cell, where they tell it without a walk: 1
/// outside, −1 inside, 0 not known. For SignRule::winding: f rises from p to a corner with f > 0, or falls to
/// one with f < 0, without meeting M.
ITS_INLINE int side_by_bounds(double f, float lower, float upper) {
    const double high = upper > 0 ? double(upper) : 0.0, low = lower < 0 ? double(lower) : 0.0;
    return int(f > high + walk_margin) - int(f < low - walk_margin);
}

/// Bit c: the corner c of a surface cell of an adaptive shell, displaced, is inside.
unsigned corners_inside(const QueryIndex& index, const SurfacePoint& at, std::uint64_t cell);

/// The exact side of any point in a surface cell, which under SignRule::generalized is steady, by whatever it
/// takes.
Side decide(const QueryIndex& index, const Vec3& point, const SurfacePoint& at);

/// The exact side of a point with these lattice coordinates in the root cube.
Side classify_in_root(const QueryIndex& index, const Vec3& point, const Vec3& u);

/// Whether a triangle holds the point, exactly.
bool on_surface(const QueryIndex& index, const Vec3& point);

/// NaN on the surface.
WindingNumber winding_off_surface(const QueryIndex& index, const winding::MeshWinding& mesh, const Vec3& point);

/// Inside or on the surface.
/// \throws OptionError if that is uncertain and nothing is said
bool contained(Side side, const std::optional<bool>& when_uncertain);

/// How decide() came to its answer; for statistics.
enum class Decision : std::uint8_t { bounds, walk, local };
Decision how_decided(const QueryIndex& index, const SurfacePoint& at);

}  // namespace its::query
