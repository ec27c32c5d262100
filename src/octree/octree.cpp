#include "octree/octree.h"

#include <algorithm>
#include <bit>

namespace its {

std::uint64_t Octree::find(int level, std::uint64_t parent) const {
    const auto& parents = levels[level].parent;
    const auto it = std::lower_bound(parents.begin(), parents.end(), parent);
    return it != parents.end() && *it == parent ? std::uint64_t(it - parents.begin()) : no_group;
}

namespace {

/// The level whose marked children are `marked` (Morton codes of its cells, strictly ascending).
Level make_level(const std::vector<std::uint64_t>& marked) {
    Level level;
    for (const std::uint64_t cell : marked) {
        if (level.parent.empty() || level.parent.back() != cell >> 3) {
            level.parent.push_back(cell >> 3);
            level.mask.push_back(0);
        }
        level.mask.back() |= std::uint8_t(1u << (cell & 7));
    }
    level.parent.shrink_to_fit();
    level.mask.shrink_to_fit();
    level.first.resize(level.parent.size() + 1, 0);
    for (std::size_t i = 0; i < level.mask.size(); ++i)
        level.first[i + 1] = level.first[i] + std::uint64_t(std::popcount(level.mask[i]));
    return level;
}

}  // namespace

Octree make_octree(int depth, const std::vector<std::uint64_t>& surface) {
    Octree octree{.depth = depth, .levels = {}};
    octree.levels.reserve(std::size_t(depth) + 1);
    octree.levels.push_back(make_level(surface));
    for (int k = 1; k <= depth; ++k) octree.levels.push_back(make_level(octree.levels[k - 1].parent));
    return octree;
}

}  // namespace its
