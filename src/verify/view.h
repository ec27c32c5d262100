#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/double_double.h"
#include "shell/shell_data.h"
#include "verify/lattice.h"

/// The verifier's own way of reading the arrays of a shell; lattice units throughout.
namespace its::verifier {

using Point3 = std::array<DoubleDouble, 3>;  ///< with digits to spare, so that its rounding does not count

/// A cell as the arrays know it.
struct CellEntry {
    std::uint64_t group = no_group;  ///< sibling group on its level, or no_group: the cell is not in the octree
    int child = 0;
    int level = 0;
    bool marked = false;        ///< its mask bit: the builder says that it meets M
    std::uint64_t surface = 0;  ///< number among the surface cells, if marked
};

/// Reads cells, grid values and f. Only to be used on arrays that passed the structure check.
/// All members may be called from any number of threads.
class View {
public:
    explicit View(const shell::ShellData& data);

    const shell::ShellData& data() const { return data_; }
    const Lattice& lattice() const { return lattice_; }

    /// Whether surface cells may be of any level. They are numbered from level 0 on.
    bool adaptive() const { return first_.size() > 1; }
    /// The levels that have surface cells are those below this one.
    int surface_levels() const { return int(first_.size()); }
    /// Bit c: child c of a group is a surface cell.
    unsigned surface_bits(int level, std::uint64_t group) const;
    /// Number of surface cells before this group; also for one past the last group of its level.
    std::uint64_t first_surface(int level, std::uint64_t group) const {
        return first_[std::size_t(level)][group];
    }
    std::uint64_t surface_cells() const { return first_.back().back(); }

    /// Group on `level` whose parent cell has these coordinates (on level + 1), or no_group. O(log groups).
    std::uint64_t group(int level, const Cell& parent) const;

    /// The finest cell with these coordinates, each in [0, lattice.cells()).
    CellEntry cell(const Cell& cell) const {
        return cell_of(group(0, {cell[0] >> 1, cell[1] >> 1, cell[2] >> 1}), cell);
    }

    /// The same where the sibling group (or no_group) is known, of any level that has surface cells.
    CellEntry cell_of(std::uint64_t group, const Cell& cell, int level = 0) const;

    /// The cell of the octree without finer ones that holds a finest cell; where all surface cells are of level
    /// 0, cell(). O(levels · log groups).
    CellEntry leaf(const Cell& finest) const;

    /// Stored value F_level(g) of the grid point with these coordinates in cells of the level. False if no
    /// cell of the level touches it.
    bool stored(int level, const std::array<std::int64_t, 3>& g, double& value) const;

    /// F_level at a point in the root cube, in cells of the level: trilinear between the corners of the
    /// level's lattice cell; a corner that is no grid point of the level has the value of F_{level + 1}.
    DoubleDouble sum_from(int level, const Point3& x) const;

    /// f at a point of the root cube, in lattice units.
    DoubleDouble value(const Point3& x) const { return sum_from(0, x); }

    /// f at the eight corners (x + 2y + 4z) of the entry's own cell if it is a surface cell, else of finest
    /// cell `cell`, whether the octree has it or not.
    void corners(const Cell& cell, const CellEntry& entry, double (&out)[8]) const;

private:
    const shell::ShellData& data_;
    Lattice lattice_;
    std::vector<std::vector<std::uint64_t>> first_;  ///< by level
};

/// Trilinear interpolation of corner values at t in [0, 1]³.
DoubleDouble trilinear(const double (&corner)[8], const Point3& t);

/// Largest difference of corner values along the cell's edges, per axis: bounds |∂f/∂axis| in the cell.
std::array<double, 3> slopes(const double (&corner)[8]);

/// Lattice coordinates: error ≤ 2⁻¹⁰⁰ of the root's side.
Point3 to_lattice(const Lattice& lattice, const Vec3& p);

}  // namespace its::verifier
