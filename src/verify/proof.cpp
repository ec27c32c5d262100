#include "verify/proof.h"

#include <algorithm>
#include <vector>

#include "geometry/vec3.h"

namespace its::verifier {
namespace {

/// Halvings of a cell's polygon, far beyond what gaps that shrink with the square of the size need; pieces
/// after which coarse_gap will do; and pieces in all, so that the proof ends for certain.
constexpr int max_halvings = 64;
constexpr std::uint64_t many_pieces = 1 << 13, max_pieces = 1 << 20;

struct Piece {
    Polygon polygon;
    int halvings = 0;
};

/// The state of one polygon's proof.
class Bounding {
public:
    Bounding(const Lattice& lattice, const Goal& goal, const Cell& cell, double width, const double (&v)[8],
             double local_low, double local_high, ProofTally& tally)
        : lattice_(lattice),
          goal_(goal),
          cell_(cell),
          width_(width),
          v_(v),
          local_low_(local_low),
          local_high_(local_high),
          local_slack_(coarse_gap),
          displacement_(piece_error(lattice, width)),
          tally_(tally) {
        const auto slope = slopes(v);
        // The pieces reach beyond the cell by rounding, where slopes are larger by a factor of 1 + 2⁻³⁰ at
        // most.
        // A vertex may stand for a point of M that is as far beyond the cell's face as walk() cuts: in a
        // neighbour, where slopes are at most 1 for values of a distance.
        double steepest = 0;
        for (const double s : slope) steepest += std::max(s, width);
        attained_error_ = evaluation_error(v) +
                          2 * steepest * (displacement_ + cell_dilation(lattice) / width) * (1 + 0x1p-20);
        error_ = evaluation_error(v) + (slope[0] + slope[1] + slope[2]) * displacement_ * (1 + 0x1p-20);
        for (const double value : v)
            smallest_ = std::min(smallest_, value), largest_ = std::max(largest_, value);
    }

    void run(const Polygon& polygon) {
        stack_.push_back({polygon, 0});
        while (!stack_.empty()) {
            const Piece piece = stack_.back();
            stack_.pop_back();
            ++pieces_;
            const Expansion expansion(v_, piece.polygon);
            Bounds bounds = expansion.cheap();
            if (wanting(outward(bounds))) expansion.sharpen(bounds);
            const Bounds b = outward(bounds);
            note_attained(b, piece.polygon);
            if (!(wanting(b) && split(piece, expansion))) settle(b, piece.polygon);
        }
        tally_.pieces += pieces_;
    }

private:
    /// Widened by all rounding. f on the cell itself is a mean of the corner values.
    Bounds outward(const Bounds& b) const {
        return {std::max(b.low - error_, smallest_), std::min(b.high + error_, largest_),
                b.attained_low + attained_error_, b.attained_high - attained_error_};
    }

    void note_attained(const Bounds& r, const Polygon& polygon) {
        if (r.attained_low < tally_.attained_low) {
            tally_.attained_low = r.attained_low;
            tally_.low_at = vertex(polygon, false);
        }
        if (r.attained_high > tally_.attained_high) {
            tally_.attained_high = r.attained_high;
            tally_.high_at = vertex(polygon, true);
        }
        tally_.excess = std::max(
            {tally_.excess, r.attained_high - goal_.strict_outer, goal_.strict_inner - r.attained_low});
        const double above = r.attained_high - local_high_, below = local_low_ - r.attained_low;
        if (std::max(above, below) > tally_.local_excess) {
            tally_.local_excess = std::max(above, below);
            tally_.local_excess_at = vertex(polygon, above > below);
        }
    }

    /// Is there anything left that smaller pieces could show? That a limit is passed, or, once one is, by more
    /// than is known.
    bool wanting(const Bounds& b) const {
        const double gap = (pieces_ < many_pieces ? fine_gap : coarse_gap) + error_ + attained_error_;
        const bool up = b.high - b.attained_high > gap, down = b.attained_low - b.low > gap;
        const double beyond = tally_.excess, local_beyond = std::max(local_slack_, tally_.local_excess);
        return (up && (b.high > goal_.proven_outer + beyond || b.high > local_high_ + local_beyond)) ||
               (down && (b.low < goal_.proven_inner - beyond || b.low < local_low_ - local_beyond)) ||
               (up && b.high > goal_.tight_outer && tally_.attained_high < goal_.tight_outer) ||
               (down && b.low < goal_.tight_inner && tally_.attained_low > goal_.tight_inner);
    }

    /// Pushes two halves, which overlap by the displacement of the vertices. False where that is not possible.
    bool split(const Piece& piece, const Expansion& expansion) {
        if (piece.halvings >= max_halvings || pieces_ + stack_.size() >= max_pieces) return false;
        Vec3 n;
        double middle = 0;
        if (!(expansion.halving(n, middle) > 16 * displacement_)) return false;
        Piece half;
        half.halvings = piece.halvings + 1;
        for (const double side : {1.0, -1.0}) {
            const auto height = [&](const Vec3& v) { return side * (dot(n, v) - middle) + 4 * displacement_; };
            if (clip(piece.polygon, height, half.polygon)) stack_.push_back(half);
        }
        return true;
    }

    void settle(const Bounds& r, const Polygon& polygon) {
        tally_.low = std::min(tally_.low, r.low);
        tally_.high = std::max(tally_.high, r.high);
        if (r.attained_high > goal_.strict_outer || r.attained_low < goal_.strict_inner)
            ++tally_.violations;
        else if (r.high > goal_.proven_outer || r.low < goal_.proven_inner)
            ++tally_.undecided;
        const double margin = std::min(local_high_ - r.high, r.low - local_low_);
        if (r.attained_high > local_high_ || r.attained_low < local_low_) ++tally_.local_violations;
        if (margin < tally_.local_margin) {
            tally_.local_margin = margin;
            tally_.local_at = vertex(polygon, local_high_ - r.high < r.low - local_low_);
        }
    }

    /// The polygon's vertex with the highest or lowest f, in mesh units.
    Vec3 vertex(const Polygon& polygon, bool highest) const {
        double best = 0;
        int at = 0;
        for (int i = 0; i < polygon.count; ++i) {
            const double value = (highest ? 1 : -1) * expand(v_, polygon.vertex[i]).f;
            if (i == 0 || value > best) best = value, at = i;
        }
        const Vec3 corner = {double(cell_[0]), double(cell_[1]), double(cell_[2])};
        return lattice_.from_lattice(width_ * (corner + polygon.vertex[at]));
    }

    const Lattice& lattice_;
    const Goal& goal_;
    const Cell& cell_;
    double width_;
    const double (&v_)[8];
    double local_low_, local_high_, local_slack_, displacement_;
    double error_ = 0, attained_error_ = 0, smallest_ = infinity, largest_ = -infinity;
    std::uint64_t pieces_ = 0;
    std::vector<Piece> stack_;
    ProofTally& tally_;
};

}  // namespace

void ProofTally::add(const ProofTally& o) {
    if (o.attained_low < attained_low) attained_low = o.attained_low, low_at = o.low_at;
    if (o.attained_high > attained_high) attained_high = o.attained_high, high_at = o.high_at;
    if (o.local_margin < local_margin) local_margin = o.local_margin, local_at = o.local_at;
    if (o.local_excess > local_excess) local_excess = o.local_excess, local_excess_at = o.local_excess_at;
    excess = std::max(excess, o.excess);
    if (o.uncovered_depth > uncovered_depth) uncovered_depth = o.uncovered_depth, uncovered_at = o.uncovered_at;
    if (unlisted == 0 && o.unlisted > 0) unlisted_at = o.unlisted_at;
    pairs += o.pairs, pieces += o.pieces;
    low = std::min(low, o.low), high = std::max(high, o.high);
    violations += o.violations, undecided += o.undecided, overflow += o.overflow;
    local_violations += o.local_violations, local_pairs += o.local_pairs;
    uncovered += o.uncovered, grazing += o.grazing;
    listed += o.listed, unlisted += o.unlisted;
}

void bound_polygon(const Lattice& lattice, const Goal& goal, const Cell& cell, double width,
                   const double (&v)[8], double local_low, double local_high, const Polygon& polygon,
                   ProofTally& tally) {
    Bounding(lattice, goal, cell, width, v, local_low, local_high, tally).run(polygon);
}

}  // namespace its::verifier
