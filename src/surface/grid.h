#pragma once

#include <algorithm>
#include <cstdint>

#include "its/base.h"
#include "octree/lattice.h"

/// Where lattice cells and the vertices on their edges are, in mesh units.
namespace its::surface {

/// A cubical lattice over the root cube. Positions are doubles that grow strictly along each axis: all that the
/// proofs need is that a vertex on a lattice edge lies strictly between the edge's ends.
struct Grid {
    Vec3 origin;
    double step = 0;          ///< cell width
    std::uint32_t cells = 0;  ///< per side of the root
    double clearance = 0;     ///< least distance of a vertex from the ends of its edge, in cells

    /// Exact on the shell's own lattice, since the result is a double and so is i·step.
    double position(int axis, std::uint32_t i) const { return origin[axis] + double(i) * step; }

    double width(int axis, std::uint32_t i) const { return position(axis, i + 1) - position(axis, i); }

    /// At `fraction` of the way from lattice point i to the next.
    double between(int axis, std::uint32_t i, double fraction) const {
        return position(axis, i) + fraction * width(axis, i);
    }
};

/// The clearance of vertices near the origin, and in units of the last place of coordinates far from it.
inline constexpr double least_clearance = 0x1p-10, clearance_in_ulps = 512, most_clearance = 0x1p-4;

/// Where on an edge the level is, from the values at its ends minus the level, which differ in sign.
inline double crossing_fraction(double from, double to, double clearance) {
    return std::clamp(from / (from - to), clearance, 1 - clearance);
}

}  // namespace its::surface
