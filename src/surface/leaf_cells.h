#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "field/field.h"
#include "octree/octree.h"

/// The cells of an adaptive shell on which f is trilinear, where level sets run.
namespace its::surface {

/// A set of cells of any level.
class CellSet {
public:
    /// Of a cell of a level with this Morton code, in a root cube of 2^(depth + 1) finest cells a side.
    static std::uint64_t key(int depth, int level, std::uint64_t code) {
        return std::uint64_t{1} << 3 * (depth + 1 - level) | code;  // a bit above the code tells the level
    }

    CellSet() : CellSet(std::span<const std::uint64_t>()) {}
    explicit CellSet(std::span<const std::uint64_t> keys);

    bool has(std::uint64_t key) const {
        for (std::uint64_t at = place(key);; at = (at + 1) & (slots_.size() - 1)) {
            if (slots_[at] == key) return true;
            if (slots_[at] == 0) return false;
        }
    }

private:
    std::uint64_t place(std::uint64_t key) const { return key * 0x9e3779b97f4a7c15 >> shift_; }

    int shift_;
    std::vector<std::uint64_t> slots_;
};

/// A cell and f at its corners x + 2y + 4z, in finest cell widths.
struct LeafCell {
    octree::Cell at;  ///< within its level
    int level;
    std::array<double, 8> value;
};

/// What a level set between two levels meets.
struct LeafCells {
    std::vector<LeafCell>
        cells;        ///< that it may run through, in a fixed order; together with others they tile space
    CellSet divided;  ///< cells that some of these are in
};

/// Leaves of the octree that meet M are as large as they are, or halved; so are others that no finer hat
/// reaches into; those that one does are halved as far as it does. Values at lattice points as in
/// find_level_cells().
/// \param halved  keys of cells, of those found before, to be replaced by their halves
LeafCells find_leaf_cells(const octree::Octree& octree, const field::Field& field, double low, double high,
                          const CellSet& halved, const Progress& progress);

}  // namespace its::surface
