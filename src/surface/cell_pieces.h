#pragma once

#include <span>
#include <vector>

#include "its/base.h"
#include "shell/shell_data.h"
#include "surface/grid.h"
#include "surface/hull.h"
#include "surface/level_cells.h"

/// Cells of any lattice beside the boxes on which f is trilinear.
namespace its::surface {

/// Proven bounds of f in cells beside g, the trilinear function of a cell's own corner values; in finest cell
/// widths, rounding included. In one pass over the boxes that the cells meet.
class CellPieces {
public:
    CellPieces(const shell::ShellData& shell, const Grid& grid);

    /// Of each cell: where f ≤ bound in it, g is at most the result, which is −∞ where f is above everywhere.
    /// With direction −1 f and g count with the opposite sign, and so do bound and result. Where g is below
    /// matters[i] the result may be anything below that.
    std::vector<double> reaches(std::span<const LevelCell> cells, double bound, int direction,
                                std::span<const double> matters, const Progress& progress) const;

    /// Of each cell: bounds of f where |g − level| ≤ band[i] in it; {level, level} if that is nowhere.
    std::vector<SurfaceRange> ranges(std::span<const LevelCell> cells, double level,
                                     std::span<const double> band, const Progress& progress) const;

private:
    template <class Pass>
    class Join;

    template <class Pass>
    void join(std::span<const LevelCell> cells, Pass& pass, const Progress& progress) const;

    /// The lattice along an axis.
    struct Axis {
        std::vector<double> plane;  ///< in finest cells, as computed
        std::vector<double> scale;  ///< of each cell: 1 / width
        /// Cells that have more than a face in finest cells x to y − 1: first[x] to last[y].
        std::vector<std::uint32_t> first, last;
    };

    static Axis make_axis(const shell::ShellData& shell, const Grid& grid, int axis);

    const shell::ShellData& shell_;
    std::array<Axis, 3> axes_;
    double plane_error_, value_error_;
};

}  // namespace its::surface
