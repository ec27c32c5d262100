#include "octree/octree.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace its {

std::uint64_t Octree::find(int level, std::uint64_t parent) const {
    const auto& parents = levels[level].parent;
    const auto it = std::lower_bound(parents.begin(), parents.end(), parent);
    return it != parents.end() && *it == parent ? std::uint64_t(it - parents.begin()) : no_group;
}

namespace {

/// The level whose marked children are `marked` (Morton codes of its cells, strictly ascending).
Level make_level(std::span<const std::uint64_t> marked) {
    std::vector<std::uint64_t> parent;
    std::vector<std::uint8_t> mask;
    for (const std::uint64_t cell : marked) {
        if (parent.empty() || parent.back() != cell >> 3) {
            parent.push_back(cell >> 3);
            mask.push_back(0);
        }
        mask.back() |= std::uint8_t(1u << (cell & 7));
    }
    parent.shrink_to_fit();
    mask.shrink_to_fit();
    std::vector<std::uint64_t> first(parent.size() + 1, 0);
    for (std::size_t i = 0; i < mask.size(); ++i)
        first[i + 1] = first[i] + std::uint64_t(std::popcount(mask[i]));
    return {std::move(parent), std::move(mask), std::move(first)};
}

}  // namespace

Octree make_octree(int depth, std::span<const std::uint64_t> surface) {
    Octree octree{.depth = depth, .levels = {}};
    octree.levels.reserve(std::size_t(depth) + 1);
    octree.levels.push_back(make_level(surface));
    for (int k = 1; k <= depth; ++k) octree.levels.push_back(make_level(octree.levels[k - 1].parent));
    return octree;
}

}  // namespace its
