#include "surface/level_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/progress.h"
#include "surface/polygonise.h"

namespace its::surface {

namespace {

constexpr double first_reach = 0.25;  // finest cell widths that the cells collected at first allow for
constexpr double round_share = 0.2;   // of the progress that is left, for a round
constexpr double growth = 1.0 / 16;   // by which a move exceeds what the last one lacked

class LevelSearch {
public:
    /// \param most  no level can be farther from `bound` within the root cube
    LevelSearch(const LevelSource& source, SurfaceSide side, double bound, double least_move, double most,
                const Progress& progress)
        : source_(source),
          parts_(progress),
          frame_{source.grid(), side, bound},
          bound_(bound),
          away_(side == SurfaceSide::outer ? 1 : -1),
          least_move_(least_move),
          most_(most) {}

    CertifiedLevel run() {
        collect(first_reach);
        // A level is refused when f on its surface comes back by as much as the level has moved. The next one
        // moves by more than that, so moves grow; what comes back is bounded, so they end.
        double refused = least_move_, move = least_move_;
        if (!(move <= most_)) refuse_open_level();
        for (double back = deficit(move); back >= move; back = deficit(move)) {
            if (!(move < most_)) refuse_open_level();
            refused = move;
            move = std::min(back * (1 + growth) + surface_gap, most_);
        }
        CertifiedLevel best = current();
        // Ends: the difference halves, and moves of at most most_ are doubles much finer than the precision.
        while (move - refused > level_precision) {
            const double middle = 0.5 * (move + refused);
            if (deficit(middle) < middle) {
                move = middle;
                best = current();
            } else {
                refused = middle;
            }
        }
        best.cells = std::move(cells_);
        best.covered = covered();
        return best;
    }

private:
    CertifiedLevel current() const { return {frame_.level, {}, {}, range_}; }

    SurfaceRange covered() const {
        const double far = bound_ + away_ * reach_;
        return {std::min(bound_, far), std::max(bound_, far)};
    }

    void collect(double reach) {
        reach_ = reach;
        const SurfaceRange levels = covered();
        cells_ = source_.cells(levels.lower, levels.upper, parts_.next(round_share));
    }

    /// How far f on the surface of the moved level comes back towards M from that level.
    double deficit(double move) {
        while (move > reach_) collect(2 * reach_);
        frame_.level = bound_ + away_ * move;
        const bool outer = away_ > 0;
        range_ = source_.bound(frame_, cells_, outer ? RangeEnds::lower : RangeEnds::upper,
                               parts_.next(round_share));
        // In the end it is this difference that counts: it has no rounding that the sum above could hide.
        const double margin = outer ? range_.lower - bound_ : bound_ - range_.upper;
        return move - margin;
    }

    const LevelSource& source_;
    Parts parts_;  ///< each round takes a fifth of what is left
    SurfaceFrame frame_;
    double bound_, away_, least_move_, most_, reach_ = 0;
    std::vector<LevelCell> cells_;
    SurfaceRange range_{0, 0};
};

}  // namespace

double most_level(const shell::ShellData& shell, SurfaceSide side) {
    double most = shell.lattice.largest_value();
    if (side == SurfaceSide::inner) return most;
    const Array<double>& values = shell.field.values[std::size_t(shell.lattice.depth)];
    for (int c = 0; c < 8; ++c) most = std::min(most, values[std::size_t(octree::group_point(c, c))]);
    return most;
}

CertifiedLevel find_certified_level(const LevelSource& source, const shell::ShellData& shell, SurfaceSide side,
                                    double bound, double least_move, const Progress& progress) {
    const double most = most_level(shell, side) - (side == SurfaceSide::outer ? bound : -bound);
    return LevelSearch(source, side, bound, least_move, most, progress).run();
}

}  // namespace its::surface
