#pragma once

#include <cstdint>
#include <vector>

#include "field/field.h"
#include "octree/octree.h"

/// Cells of a lattice coarser than the finest that a level set may run through.
namespace its::surface {

/// A lattice cell as one number, in the order of z, then y, then x.
inline std::uint64_t key_of(const octree::Cell& at) {
    return at[0] | std::uint64_t{at[1]} << 21 | std::uint64_t{at[2]} << 42;
}
inline octree::Cell cell_of(std::uint64_t key) {
    return {std::uint32_t(key & 0x1fffff), std::uint32_t(key >> 21 & 0x1fffff), std::uint32_t(key >> 42)};
}

/// Finds cells from the top of the octree down, so that the work follows the coarse cells and not the finest.
class CoarseCells {
public:
    /// \param ratio  width of a cell in finest cells, at least 1
    /// \param side   cells along the root cube
    CoarseCells(const octree::Octree& octree, const field::Field& field, double ratio, std::uint32_t side);

    /// Keys, in order, of the cells in which grid values lie on both sides of a level in [low, high], or on
    /// one. Values between grid points may be beyond those of a cell: what is missed joins over crossed faces.
    std::vector<std::uint64_t> find(double low, double high) const;

private:
    friend class CoarseFinder;

    /// Of all grid values in a group and below.
    struct ValueRange {
        double least, most;
    };

    const octree::Octree& octree_;
    const field::Field& field_;
    double ratio_;
    std::uint32_t side_;
    int level_;  ///< the coarsest whose cells are no wider than those of the lattice
    std::vector<std::vector<ValueRange>> ranges_;
};

}  // namespace its::surface
