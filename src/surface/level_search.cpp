#include "surface/level_search.h"

#include <algorithm>
#include <utility>

#include "base/progress.h"

namespace its::surface {

namespace {

constexpr double first_reach = 0.25;  // finest cell widths that the cells collected at first allow for
constexpr double round_share = 0.2;   // of the progress that is left, for a round
constexpr double growth = 1.0 / 16;   // by which a move exceeds what the last one lacked

class LevelSearch {
public:
    LevelSearch(const LevelSource& source, SurfaceSide side, double bound, const Progress& progress)
        : source_(source),
          parts_(progress),
          frame_{source.grid(), side, bound},
          bound_(bound),
          away_(side == SurfaceSide::outer ? 1 : -1) {}

    CertifiedLevel run() {
        collect(first_reach);
        // A level is refused when f on its surface comes back by as much as the level has moved. The next one
        // moves by more than that, so moves grow; what comes back is bounded, so they end.
        double refused = 0, move = 0;
        for (double back = deficit(0); back >= move; back = deficit(move)) {
            refused = move;
            move = back * (1 + growth) + surface_gap;
        }
        CertifiedLevel best = current();
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
        return best;
    }

private:
    CertifiedLevel current() const { return {frame_.level, {}, range_}; }

    void collect(double reach) {
        reach_ = reach;
        const double far = bound_ + away_ * reach;
        cells_ = source_.cells(std::min(bound_, far), std::max(bound_, far), parts_.next(round_share));
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
    double bound_, away_, reach_ = 0;
    std::vector<LevelCell> cells_;
    SurfaceRange range_{0, 0};
};

}  // namespace

CertifiedLevel find_certified_level(const LevelSource& source, SurfaceSide side, double bound,
                                    const Progress& progress) {
    return LevelSearch(source, side, bound, progress).run();
}

}  // namespace its::surface
