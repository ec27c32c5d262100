#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "base/single.h"
#include "its/base.h"
#include "its/mesh.h"
#include "octree/lattice.h"

/// Where lattice cells and the vertices on their edges are, in mesh units.
namespace its::surface {

/// A cubical lattice over the root cube. Positions grow strictly along each axis: all that the proofs need is
/// that a vertex on a lattice edge lies strictly between the edge's ends.
struct Grid {
    Vec3 origin;
    double step = 0;          ///< cell width
    std::uint32_t cells = 0;  ///< per side of the root
    double clearance = 0;     ///< least distance of a vertex from the ends of its edge, in cells
    Rounding rounding = {};   ///< of all positions
    double unit = 0;          ///< Rounding::unit(), in cells: at most most_unit

    /// Without rounding exact on the shell's own lattice, since the result is a double and so is i·step.
    double position(int axis, std::uint32_t i) const {
        return rounding.nearest(axis, origin[axis] + double(i) * step);
    }

    double width(int axis, std::uint32_t i) const { return position(axis, i + 1) - position(axis, i); }

    /// How far, in cells, a vertex on an edge may be moved along it: by the clearance, and where numbers are
    /// rounded by a unit, which is at most 4/3 of one in a cell whose ends are rounded too.
    double displacement() const { return clearance + 1.5 * unit; }

    /// At `fraction` of the way from lattice point i to the next, and strictly between them.
    double between(int axis, std::uint32_t i, double fraction) const {
        const double from = position(axis, i), to = position(axis, i + 1);
        const double x = from + fraction * (to - from);
        if (rounding.kind == Rounding::Kind::none) return x;
        return std::clamp(rounding.nearest(axis, x), rounding.next(from, 1), rounding.next(to, -1));
    }
};

/// The clearance of vertices near the origin, and in units of the last place of coordinates far from it.
inline constexpr double least_clearance = 0x1p-10, clearance_in_ulps = 512, most_clearance = 0x1p-4;

/// Of 32-bit numbers a cell must be four units wide: its ends are at least three apart, and between them there
/// are at least two.
inline constexpr double most_unit = 0.25;

/// Nothing where doubles, or the numbers that are asked for, cannot tell the lattice's positions apart.
/// \param step  cell width in mesh units
/// \param cells per side of the root
std::optional<Grid> make_grid(const octree::Lattice& lattice, double step, std::uint32_t cells,
                              const Rounding& rounding);

/// Coordinates about an origin are relative to the root cube's centre where it is far away for its size.
/// \throws OptionError if there are no such numbers
Rounding make_rounding(const octree::Lattice& lattice, Coordinates coordinates);

/// Where on an edge the level is, from the values at its ends minus the level, which differ in sign.
inline double crossing_fraction(double from, double to, double clearance) {
    return std::clamp(from / (from - to), clearance, 1 - clearance);
}

}  // namespace its::surface
