#include "octree/neighbours.h"

#include "base/platform/compiler.h"

namespace its::octree {

Around around_cell(const Octree& octree, int level, const Cell& at) {
    Around around;
    const std::uint32_t side = octree.depth + 1 >= level ? 1u << (octree.depth + 1 - level) : 0;
    for (int n = 0; n < neighbours; ++n) {
        const Cell other = {at[0] + std::uint32_t(n % 3) - 1, at[1] + std::uint32_t(n / 3 % 3) - 1,
                            at[2] + std::uint32_t(n / 9) - 1};
        const bool exists = other[0] < side && other[1] < side && other[2] < side;  // −1 wraps around
        around[std::size_t(n)] = exists ? octree.find(level - 1, morton_encode(other)) : no_group;
    }
    return around;
}

ITS_CLONES Around around_child(const Level& level, const Around& parent, int child) {
    Around around;
    for (std::size_t n = 0; n < neighbours; ++n) {
        const std::uint64_t group = parent[child_neighbours.neighbour[child][n]];
        const int place = child_neighbours.child[child][n];
        const unsigned mask = group == no_group ? 0 : level.mask[group];
        around[n] = mask >> place & 1 ? level.first.rank(group, place) : no_group;
    }
    return around;
}

}  // namespace its::octree
