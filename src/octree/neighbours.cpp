#include "octree/neighbours.h"

#include "base/platform/compiler.h"

namespace its::octree {

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
