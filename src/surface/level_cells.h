#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "field/field.h"
#include "octree/octree.h"

/// The finest lattice cells that a level set can run through.
namespace its::surface {

/// A cell of a cubical lattice and the function's values at its corners x + 2y + 4z, in finest cell widths.
struct LevelCell {
    octree::Cell at;
    std::array<double, 8> value;
};

/// All cells of the finest lattice whose corner values are neither all below `low` nor all at or above `high`,
/// low ≤ high: every level set of a level in [low, high] runs through these only. In a fixed order.
///
/// The value at a lattice point is F_j of the finest level j that has it as a grid point, or else means of
/// neighbours on the lattice twice as wide, x before y before z: the same bits from every cell that shares it.
/// Each of at most `depth` halvings rounds three times: a value errs by value_roundings(depth)·u times the
/// largest value.
std::vector<LevelCell> find_level_cells(const octree::Octree& octree, const field::Field& field, double low,
                                        double high, const Progress& progress);

inline constexpr double value_roundings(int depth) {
    return 3.0 * (depth + 1);
}

}  // namespace its::surface
