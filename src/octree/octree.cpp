#include "octree/octree.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace its::octree {

std::uint64_t Octree::find(int level, std::uint64_t parent) const {
    const auto& parents = levels[level].parent;
    const auto it = std::lower_bound(parents.begin(), parents.end(), parent);
    return it != parents.end() && *it == parent ? std::uint64_t(it - parents.begin()) : no_group;
}

CellPlace Octree::surface_place(std::uint64_t cell) const {
    int level = 0;
    for (; cell >= surface_ranks(level).back(); ++level) cell -= surface_ranks(level).back();
    const Ranks& ranks = surface_ranks(level);
    const std::uint64_t group = ranks.find(cell);
    unsigned mask = surface_mask(level, group);
    for (std::uint64_t skip = cell - ranks[group]; skip > 0; --skip) mask &= mask - 1;
    return {group, std::countr_zero(mask), level};
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
    return {std::move(parent), std::move(mask)};
}

}  // namespace

Octree make_octree(int depth, std::span<const std::uint64_t> surface) {
    Octree octree{.depth = depth, .levels = {}};
    octree.levels.reserve(std::size_t(depth) + 1);
    octree.levels.push_back(make_level(surface));
    for (int k = 1; k <= depth; ++k) octree.levels.push_back(make_level(octree.levels[k - 1].parent));
    return octree;
}

}  // namespace its::octree
