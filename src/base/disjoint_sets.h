#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace its {

/// Sets of the numbers below `count`, at first of one each; the lowest member stands for its set. Union by
/// index and path halving (Tarjan and van Leeuwen 1984): near-linear in practice.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t count) : parent_(count) {
        std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
    }

    /// The lowest member of the set of i.
    std::uint32_t find(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    /// \return whether the two were in different sets
    bool join(std::uint32_t i, std::uint32_t j) {
        i = find(i), j = find(j);
        parent_[std::max(i, j)] = std::min(i, j);
        return i != j;
    }

private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace its
