#pragma once

#include <array>
#include <utility>

#include "shell/shell_data.h"
#include "surface/grid.h"
#include "surface/level_cells.h"

/// A cell of any lattice beside the cells on which f is trilinear.
namespace its::surface {

/// Proven bounds of f in a cell beside g, the trilinear function of the cell's own corner values; in finest
/// cell widths, rounding included.
class CellPieces {
public:
    CellPieces(const shell::ShellData& shell, const Grid& grid);

    /// Where f ≤ bound in the cell, g is at most the result, which is −∞ where f is above everywhere. With
    /// direction −1 f and g count with the opposite sign, and so do bound and result.
    double reach(const LevelCell& cell, double bound, int direction) const;

    /// Bounds {least, most} of f − g where low ≤ g ≤ high; {0, 0} if that is nowhere.
    std::pair<double, double> difference(const LevelCell& cell, double low, double high) const;

private:
    struct Place;

    template <class F>
    class Walk;

    /// fn(f, g, error): values of both at the eight corners of a box, in each box of those that cover the cell,
    /// on which f and g are trilinear, and a bound of their rounding errors.
    template <class F>
    void for_pieces(const LevelCell& cell, F fn) const;

    const shell::ShellData& shell_;
    const Grid& grid_;
    double plane_error_;
};

}  // namespace its::surface
