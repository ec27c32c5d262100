#include "verify/proof.h"

#include <algorithm>
#include <vector>

#include "geometry/vec3.h"

namespace its::verifier {
namespace {

/// Halvings of a cell's polygon, and pieces in all: both far beyond what a remainder that shrinks with the
/// square of the size needs, and the proof's end for certain.
constexpr int max_halvings = 48;
constexpr std::uint64_t max_pieces = 1 << 18;

struct Piece {
    Polygon polygon;
    int halvings = 0;
};

/// The state of one polygon's proof.
class Bounding {
public:
    Bounding(const Lattice& lattice, const Goal& goal, const Cell& cell, const double (&v)[8], double local_low,
             double local_high, ProofTally& tally)
        : lattice_(lattice),
          goal_(goal),
          cell_(cell),
          v_(v),
          local_low_(local_low),
          local_high_(local_high),
          local_slack_(0.5 * proven_tolerance(lattice)),
          displacement_(piece_error(lattice)),
          tally_(tally) {
        const auto slope = slopes(v);
        // The pieces reach beyond the cell by rounding, where slopes are larger by a factor of 1 + 2⁻³⁰ at
        // most.
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
            const Range r = enclose(piece.polygon);
            note_attained(r, piece.polygon);
            if (!(wanting(r) && split(piece, r))) settle(r, piece.polygon);
        }
        tally_.pieces += pieces_;
    }

private:
    /// Outward by all rounding. f on the cell itself is a mean of the corner values.
    Range enclose(const Polygon& polygon) const {
        Range r = range(v_, polygon);
        r.low = std::max(r.low - error_, smallest_);
        r.high = std::min(r.high + error_, largest_);
        r.attained_low += error_;
        r.attained_high -= error_;
        return r;
    }

    void note_attained(const Range& r, const Polygon& polygon) {
        if (r.attained_low < tally_.attained_low) {
            tally_.attained_low = r.attained_low;
            tally_.low_at = vertex(polygon, false);
        }
        if (r.attained_high > tally_.attained_high) {
            tally_.attained_high = r.attained_high;
            tally_.high_at = vertex(polygon, true);
        }
    }

    /// Is there anything left that smaller pieces could show?
    bool wanting(const Range& r) const {
        const bool outer = r.high > goal_.proven_outer && r.attained_high <= goal_.proven_outer;
        const bool inner = r.low < goal_.proven_inner && r.attained_low >= goal_.proven_inner;
        const bool local_up = r.high > local_high_ + local_slack_ && r.attained_high <= local_high_;
        const bool local_down = r.low < local_low_ - local_slack_ && r.attained_low >= local_low_;
        const bool tight_up = r.high > goal_.tight_outer && tally_.attained_high < goal_.tight_outer;
        const bool tight_down = r.low < goal_.tight_inner && tally_.attained_low > goal_.tight_inner;
        return outer || inner || local_up || local_down || tight_up || tight_down;
    }

    /// Pushes two halves, which overlap by the displacement of the vertices. False if that is of no use.
    bool split(const Piece& piece, const Range& r) {
        // high − attained_high ≤ 2 · remainder + 2 · error: at a quarter of the tolerance, all is said.
        if (r.remainder <= 0.25 * proof_tolerance) return false;
        if (piece.halvings >= max_halvings || pieces_ + stack_.size() >= max_pieces) return false;
        Piece half;
        half.halvings = piece.halvings + 1;
        for (const bool above : {true, false}) {
            const double plane = r.split_at + (above ? -2 : 2) * displacement_;
            if (clip(piece.polygon, r.split_axis, plane, above, half.polygon)) stack_.push_back(half);
        }
        return true;
    }

    void settle(const Range& r, const Polygon& polygon) {
        tally_.low = std::min(tally_.low, r.low);
        tally_.high = std::max(tally_.high, r.high);
        if (r.attained_high > goal_.outer || r.attained_low < goal_.inner)
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
        return from_lattice(lattice_, corner + polygon.vertex[at]);
    }

    const Lattice& lattice_;
    const Goal& goal_;
    const Cell& cell_;
    const double (&v_)[8];
    double local_low_, local_high_, local_slack_, displacement_;
    double error_ = 0, smallest_ = infinity, largest_ = -infinity;
    std::uint64_t pieces_ = 0;
    std::vector<Piece> stack_;
    ProofTally& tally_;
};

}  // namespace

void ProofTally::add(const ProofTally& o) {
    if (o.attained_low < attained_low) attained_low = o.attained_low, low_at = o.low_at;
    if (o.attained_high > attained_high) attained_high = o.attained_high, high_at = o.high_at;
    if (o.local_margin < local_margin) local_margin = o.local_margin, local_at = o.local_at;
    if (o.uncovered_depth > uncovered_depth) uncovered_depth = o.uncovered_depth, uncovered_at = o.uncovered_at;
    if (unlisted == 0 && o.unlisted > 0) unlisted_at = o.unlisted_at;
    pairs += o.pairs, pieces += o.pieces;
    low = std::min(low, o.low), high = std::max(high, o.high);
    violations += o.violations, undecided += o.undecided, overflow += o.overflow;
    local_violations += o.local_violations, local_pairs += o.local_pairs;
    uncovered += o.uncovered, grazing += o.grazing;
    listed += o.listed, unlisted += o.unlisted;
}

void bound_polygon(const Lattice& lattice, const Goal& goal, const Cell& cell, const double (&v)[8],
                   double local_low, double local_high, const Polygon& polygon, ProofTally& tally) {
    Bounding(lattice, goal, cell, v, local_low, local_high, tally).run(polygon);
}

}  // namespace its::verifier
