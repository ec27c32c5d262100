#pragma once

#include <cstdint>
#include <vector>

#include "base/array.h"
#include "octree/octree.h"

namespace its::signs {

/// The side of every cell by the sign rule, exactly: the signs of distances do not tell it where these are 0.
/// It is that of the cell's lowest corner, displaced as in geometry/predicates.h; the whole of a cell that has
/// no finer ones and does not meet M is on that side.
struct CellSides {
    /// inside[k][group]: bit c: child c. All 0 where the rule has no inside.
    std::vector<Array<std::uint8_t>> inside;
    /// The winding number of each surface cell; empty where those of all grid points of level 0 are 0 or 1:
    /// then the bits say it.
    Array<std::int32_t> winding;
};

/// The sides under a rule that has no inside.
inline CellSides no_inside(const octree::Octree& octree) {
    CellSides sides;
    for (const octree::Level& level : octree.levels)
        sides.inside.emplace_back(std::vector<std::uint8_t>(level.groups()));
    return sides;
}

}  // namespace its::signs
