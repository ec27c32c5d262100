#pragma once

#include <compare>
#include <cstdint>
#include <vector>

#include "octree/lattice.h"
#include "octree/morton.h"

namespace its::signs {

/// Corners of finest cells in which inside and outside meet away from M, and how far from each that is.
class HolePoints {
public:
    struct Point {
        std::uint64_t code;  ///< Morton code of the lattice point
        double distance;

        friend auto operator<=>(const Point&,
                                const Point&) = default;  // NOLINT(modernize-use-nullptr): its own
    };

    HolePoints() = default;
    /// Of several distances of a point the least counts.
    explicit HolePoints(std::vector<Point> points);

    /// Makes the distances of the 27 points of a group at least as small.
    /// \param parent  the cell that the group halves, of level `level` + 1
    void shorten(const octree::Cell& parent, int level, double* distance) const;

    bool empty() const { return code_.empty(); }
    /// Of the lattice point with this Morton code; infinite where it is none of these. Precondition: not empty.
    double distance(std::uint64_t code) const;

private:
    bool may_have(std::uint64_t block) const { return filter_[place(block)]; }
    static std::size_t place(std::uint64_t block);

    static constexpr int filter_bits = 20;
    std::vector<std::uint64_t> code_;  ///< in ascending order
    std::vector<double> distance_;
    std::vector<bool> filter_;  ///< by hash of code / 8: some of these eight points may be here
};

}  // namespace its::signs
