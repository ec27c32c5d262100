#include "octree/neighbours.h"

namespace its::octree {

namespace {

/// Where the neighbours of each child are: which neighbour of the parent, and which child of that.
struct ChildTable {
    std::uint8_t neighbour[8][neighbours], child[8][neighbours];

    constexpr ChildTable() : neighbour{}, child{} {
        for (int c = 0; c < 8; ++c)
            for (int n = 0; n < neighbours; ++n) {
                const int offset[3] = {n % 3, n / 3 % 3, n / 9};
                int parent = 0, place = 0, stride = 1;
                for (int axis = 0; axis < 3; ++axis, stride *= 3) {
                    const int at = (c >> axis & 1) + offset[axis] + 1;  // 1 to 4: half cells from the corner
                    parent += stride * (at / 2);                        // of neighbour 0
                    place += (at & 1) << axis;
                }
                neighbour[c][n] = std::uint8_t(parent);
                child[c][n] = std::uint8_t(place);
            }
    }
};
constexpr ChildTable table;

}  // namespace

Around around_child(const Level& level, const Around& parent, int child) {
    Around around;
    for (std::size_t n = 0; n < neighbours; ++n) {
        const std::uint64_t group = parent[table.neighbour[child][n]];
        const int place = table.child[child][n];
        const unsigned mask = group == no_group ? 0 : level.mask[group];
        around[n] = mask >> place & 1 ? level.first.rank(group, place) : no_group;
    }
    return around;
}

}  // namespace its::octree
