#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "base/parallel.h"
#include "octree/octree.h"

namespace its::octree {

namespace {

/// The groups around a group, itself included: index (1 + dx) + 3(1 + dy) + 9(1 + dz), or no_group.
using Neighbours = std::array<std::uint64_t, 27>;

/// The neighbours of the group below child `child` of the group with these neighbours.
Neighbours below(const Level& level, const Neighbours& around, int child) {
    Neighbours result;
    for (int n = 0; n < 27; ++n) {
        // Position of the neighbouring cell in cells of the level, from the corner of the middle group.
        const std::array<int, 3> at = {(child & 1) + n % 3 - 1, (child >> 1 & 1) + n / 3 % 3 - 1,
                                       (child >> 2) + n / 9 - 1};
        int group = 0, cell = 0;
        for (int axis = 2; axis >= 0; --axis) {
            group = 3 * group + (at[axis] + 2) / 2;  // −1 → 0; 0, 1 → 1; 2 → 2
            cell = 2 * cell + (at[axis] & 1);
        }
        const std::uint64_t g = around[group];
        const unsigned mask = g == no_group ? 0 : level.mask[g];
        result[n] = mask >> cell & 1 ? level.first.rank(g, cell) : no_group;
    }
    return result;
}

/// Points of the middle group that no group before it in Morton order has.
std::uint64_t own_points(const Neighbours& around) {
    std::uint64_t count = 0;
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 3; ++x) {
                bool own = true;
                // The groups with this point: a step, or none, towards each face that it lies in.
                for (int dz = std::min(z - 1, 0); dz <= std::max(z - 1, 0); ++dz)
                    for (int dy = std::min(y - 1, 0); dy <= std::max(y - 1, 0); ++dy)
                        for (int dx = std::min(x - 1, 0); dx <= std::max(x - 1, 0); ++dx)
                            own &= around[13 + dx + 3 * dy + 9 * dz] >= around[13];  // no_group is greatest
                count += own;
            }
    return count;
}

std::uint64_t count_below(const Octree& octree, int level, const Neighbours& around) {
    std::uint64_t count = own_points(around);
    if (level == 0) return count;
    const Level& l = octree.levels[level];
    for (unsigned mask = l.mask[around[13]]; mask != 0; mask &= mask - 1)
        count += count_below(octree, level - 1, below(l, around, std::countr_zero(mask)));
    return count;
}

}  // namespace

std::uint64_t count_grid_points(const Octree& octree) {
    Neighbours root;
    root.fill(no_group);
    root[13] = 0;
    // Breadth first until there are enough groups for all threads, then every subtree by itself.
    constexpr std::size_t enough = 256;
    std::vector<Neighbours> front = {root};
    int level = octree.depth;
    std::uint64_t count = 0;
    for (; level > 0 && front.size() < enough; --level) {
        std::vector<Neighbours> next;
        for (const Neighbours& around : front) {
            count += own_points(around);
            for (unsigned mask = octree.levels[level].mask[around[13]]; mask != 0; mask &= mask - 1)
                next.push_back(below(octree.levels[level], around, std::countr_zero(mask)));
        }
        front = std::move(next);
    }
    std::vector<std::uint64_t> parts(front.size());
    parallel_for(front.size(), 1, [&](std::uint64_t i) { parts[i] = count_below(octree, level, front[i]); });
    return std::accumulate(parts.begin(), parts.end(), count);
}

}  // namespace its::octree
