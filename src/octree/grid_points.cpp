#include <algorithm>
#include <bit>
#include <numeric>

#include "base/parallel.h"
#include "octree/neighbours.h"

namespace its::octree {

namespace {

/// Points of the middle group that no group before it in Morton order has.
std::uint64_t own_points(const Around& around) {
    std::uint64_t count = 0;
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 3; ++x) {
                bool own = true;
                // The groups with this point: a step, or none, towards each face that it lies in.
                for (int dz = std::min(z - 1, 0); dz <= std::max(z - 1, 0); ++dz)
                    for (int dy = std::min(y - 1, 0); dy <= std::max(y - 1, 0); ++dy)
                        for (int dx = std::min(x - 1, 0); dx <= std::max(x - 1, 0); ++dx)
                            own &= around[itself + dx + 3 * dy + 9 * dz] >=
                                   around[itself];  // no_group is greatest
                count += own;
            }
    return count;
}

std::uint64_t count_below(const Octree& octree, int level, const Around& around) {
    std::uint64_t count = own_points(around);
    if (level == 0) return count;
    const Level& l = octree.levels[level];
    for (unsigned mask = l.mask[around[itself]]; mask != 0; mask &= mask - 1)
        count += count_below(octree, level - 1, around_child(l, around, std::countr_zero(mask)));
    return count;
}

}  // namespace

std::uint64_t count_grid_points(const Octree& octree) {
    Around root;
    root.fill(no_group);
    root[itself] = 0;
    // Breadth first until there are enough groups for all threads, then every subtree by itself.
    constexpr std::size_t enough = 256;
    std::vector<Around> front = {root};
    int level = octree.depth;
    std::uint64_t count = 0;
    for (; level > 0 && front.size() < enough; --level) {
        std::vector<Around> next;
        for (const Around& around : front) {
            count += own_points(around);
            for (unsigned mask = octree.levels[level].mask[around[itself]]; mask != 0; mask &= mask - 1)
                next.push_back(around_child(octree.levels[level], around, std::countr_zero(mask)));
        }
        front = std::move(next);
    }
    std::vector<std::uint64_t> parts(front.size());
    parallel_for(front.size(), 1, [&](std::uint64_t i) { parts[i] = count_below(octree, level, front[i]); });
    return std::accumulate(parts.begin(), parts.end(), count);
}

}  // namespace its::octree
