#include "adaptive/growing_tree.h"

#include "base/parallel.h"

namespace its::adaptive {

namespace {

constexpr std::uint64_t group_grain = 512;

}  // namespace

void GrowingTree::link_around(std::uint32_t begin, std::uint32_t end) {
    const auto& table = octree::child_neighbours;
    parallel_for(end - begin, group_grain, [&](std::uint64_t i) {
        const Group& group = groups_[begin + i];
        Links& links = links_[begin + i];
        if (group.above == none) {
            links.around.fill(none);
        } else {
            const Links& above = links_[group.above];
            const auto child = std::size_t(group.parent & 7);
            for (std::size_t n = 0; n < octree::neighbours; ++n) {
                const std::uint32_t next = above.around[table.neighbour[child][n]];
                const int place = table.child[child][n];
                const bool there = next != none && (groups_[next].subdivided >> place & 1);
                links.around[n] = there ? links_[next].child[std::size_t(place)] : none;
            }
        }
        links.around[octree::itself] = std::uint32_t(begin + i);
    });
    // Each entry of an older group is for one new group: no two threads write the same.
    parallel_for(end - begin, group_grain, [&](std::uint64_t i) {
        const auto& around = links_[begin + i].around;
        for (std::size_t n = 0; n < octree::neighbours; ++n)
            if (around[n] < begin)
                links_[around[n]].around[std::size_t(opposite(int(n)))] = std::uint32_t(begin + i);
    });
}

Place GrowingTree::leaf_around(std::uint32_t group, int direction) const {
    const auto& table = octree::child_neighbours;
    while (groups_[group].above != none) {
        const auto child = std::size_t(groups_[group].parent & 7);
        const int place = table.child[child][direction];
        direction = table.neighbour[child][direction];
        group = groups_[group].above;
        const std::uint32_t there = links_[group].around[std::size_t(direction)];
        if (there != none) return {there, place};
    }
    return {};
}

std::uint32_t GrowingTree::hanging(std::uint32_t group, std::vector<Place>& too_coarse) const {
    std::uint32_t points = 0;
    for (int n = 0; n < octree::neighbours; ++n) {
        if (links_[group].around[std::size_t(n)] != none) continue;
        const Place leaf = leaf_around(group, n);
        if (!is_surface(leaf)) continue;
        points |= octree::shared_points[std::size_t(n)].bits;
        if (groups_[leaf.group].level > groups_[group].level + 1 &&
            (groups_[group].surface & children_towards[std::size_t(n)]) != 0)
            too_coarse.push_back(leaf);
    }
    return points;
}

}  // namespace its::adaptive
