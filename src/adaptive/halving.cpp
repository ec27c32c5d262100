#include <algorithm>

#include "adaptive/refiner.h"
#include "adaptive/windings.h"
#include "base/parallel.h"

/// Halving leaves: groups, lists of triangles, sides.
namespace its::adaptive {

using octree::group_point;
using octree::group_points;

namespace {

constexpr std::uint64_t group_grain = 64;

}  // namespace

void Refiner::halve_leaves() {
    std::sort(splits_.begin(), splits_.end(), [&](std::uint32_t a, std::uint32_t b) {
        const Leaf &p = leaves_[a], &q = leaves_[b];
        return std::pair(-level_of(p), code_of(p)) < std::pair(-level_of(q), code_of(q));
    });
    first_new_ = tree_.size();
    for (auto begin = splits_.begin(); begin != splits_.end();) {
        const int level = level_of(leaves_[*begin]);
        const auto end =
            std::find_if(begin, splits_.end(), [&](std::uint32_t i) { return level_of(leaves_[i]) != level; });
        halve_level({begin, end}, level - 1);
        begin = end;
    }
    splits_.clear();
    drop_lists();
}

void Refiner::halve_level(std::span<const std::uint32_t> leaves, int level) {
    octree::Voxels above;
    for (const std::uint32_t i : leaves) {
        above.cell.push_back(code_of(leaves_[i]));
        above.offset.push_back(above.triangle.size());
        const auto list = list_of(leaves_[i]);
        above.triangle.insert(above.triangle.end(), list.begin(), list.end());
    }
    above.offset.push_back(above.triangle.size());
    octree::Voxels below = octree::halve(above, task_.positions, task_.mesh.triangles, level, tree_.depth(),
                                         task_.lattice.dilation());
    const std::uint32_t begin = tree_.size(), first = std::uint32_t(leaves_.size());
    tree_.resize(begin + std::uint32_t(leaves.size()));
    for (std::size_t i = 0; i < leaves.size(); ++i) link_above(leaves[i], begin + std::uint32_t(i));
    parallel_for(leaves.size(), group_grain, [&](std::uint64_t i) {
        set_group(begin + std::uint32_t(i), level, leaves_[leaves[i]], above, i);
    });
    if (task_.open != nullptr) below = with_holes(std::move(below), begin, level);
    leaves_.resize(first + below.cell.size());
    parallel_for(leaves.size(), group_grain,
                 [&](std::uint64_t i) { set_leaves(begin + std::uint32_t(i), below, first); });
    live_.push_back(below.triangle.size());
    pools_.push_back(std::move(below.triangle));
    tree_.link_around(begin, begin + std::uint32_t(leaves.size()));
}

octree::Voxels Refiner::with_holes(octree::Voxels below, std::uint32_t begin, int level) const {
    octree::Voxels result;
    std::size_t next = 0;
    for (std::uint32_t group = begin; group < tree_.size(); ++group)
        for (unsigned child = 0; child < 8; ++child) {
            const std::uint64_t code = tree_[group].parent << 3 | child;
            std::span<const std::uint32_t> list;
            if (next < below.cell.size() && below.cell[next] == code) {
                list = std::span(below.triangle)
                           .subspan(below.offset[next], below.offset[next + 1] - below.offset[next]);
                ++next;
            }
            const std::uint32_t corners = tree_[group].inside & points_of_child[child];
            const bool mixed = corners != 0 && corners != points_of_child[child];
            if (of_mesh(list).empty() && !mixed && !task_.open->flips_in(level, code)) continue;
            result.cell.push_back(code);
            result.offset.push_back(result.triangle.size());
            result.triangle.insert(result.triangle.end(), list.begin(), list.end());
        }
    result.offset.push_back(result.triangle.size());
    return result;
}

void Refiner::link_above(std::uint32_t leaf, std::uint32_t group) {
    Leaf& old = leaves_[leaf];
    old.split = true;
    live_[old.pool] -= old.count;
    tree_[group].above = old.group;
    if (old.group == none) return;
    Group& above = tree_[old.group];
    above.surface &= std::uint8_t(~(1u << old.child));
    above.subdivided |= std::uint8_t(1u << old.child);
    tree_.links(old.group).child[old.child] = group;
}

void Refiner::set_group(std::uint32_t number, int level, const Leaf& old, const octree::Voxels& above,
                        std::uint64_t i) {
    Group& group = tree_[number];
    group.parent = above.cell[i];
    group.level = std::int8_t(level);
    group.free = group.inside = 0;
    group.subdivided = group.surface = 0;
    group.waiting = false;
    group.value.fill(0);
    tree_.links(number).child.fill(none);
    if (task_.rule == SignRule::unsigned_rule) return;
    const octree::Cell at = octree::morton_decode(group.parent);
    const std::int64_t step = std::int64_t{1} << level;
    const auto winding = windings_in_cell(
        task_.mesh, task_.lattice, {2 * step * at[0], 2 * step * at[1], 2 * step * at[2]}, step,
        std::span(above.triangle).subspan(above.offset[i], above.offset[i + 1] - above.offset[i]), old.winding);
    if (task_.open != nullptr) {
        std::array<Vec3, group_points> points;
        for (std::size_t p = 0; p < group_points; ++p) {
            const auto half = std::int64_t(p);
            points[p] =
                task_.lattice.position({step * (2 * at[0] + half % 3), step * (2 * at[1] + half / 3 % 3),
                                        step * (2 * at[2] + half / 9)});
        }
        group.inside = task_.open->inside(points, winding);
    }
    for (int p = 0; p < group_points && task_.open == nullptr; ++p) {
        const std::int32_t w = number_by_rule(winding[std::size_t(p)]);
        if (w >= 1) group.inside |= 1u << p;
        if (w < 0 || w > 1) only_bits_.store(false, std::memory_order_relaxed);
    }
    // Kept in the values until the leaves are made: whole numbers.
    for (int c = 0; c < 8; ++c) group.value[std::size_t(c)] = winding[std::size_t(group_point(c, 0))];
}

void Refiner::set_leaves(std::uint32_t number, const octree::Voxels& below, std::uint32_t first) {
    Group& group = tree_[number];
    auto at = std::uint64_t(std::lower_bound(below.cell.begin(), below.cell.end(), group.parent << 3) -
                            below.cell.begin());
    for (; at < below.cell.size() && below.cell[at] >> 3 == group.parent; ++at) {
        const int child = int(below.cell[at] & 7);
        group.surface |= std::uint8_t(1u << child);
        tree_.links(number).child[std::size_t(child)] = first + std::uint32_t(at);
        leaves_[first + at] = {.begin = below.offset[at],
                               .count = std::uint32_t(below.offset[at + 1] - below.offset[at]),
                               .group = number,
                               .winding = number_by_rule(std::int32_t(group.value[std::size_t(child)])),
                               .pool = std::uint16_t(pools_.size()),
                               .child = std::uint8_t(child)};
    }
}

void Refiner::drop_lists() {
    std::uint64_t total = 0, live = 0;
    for (std::size_t i = 0; i < pools_.size(); ++i) {
        if (live_[i] == 0) std::vector<std::uint32_t>().swap(pools_[i]);
        total += pools_[i].size();
        live += live_[i];
    }
    constexpr std::size_t many_pools = 60000;
    if (total <= 2 * live && pools_.size() < many_pools) return;
    std::vector<std::uint32_t> all;
    all.reserve(live);
    for (std::uint64_t i = 0; i < leaves_.size(); ++i) {
        Leaf& leaf = leaves_[i];
        if (leaf.split) continue;
        const auto list = list_of(leaf);
        leaf.begin = all.size();
        all.insert(all.end(), list.begin(), list.end());
        leaf.pool = 0;
    }
    pools_.clear();
    pools_.push_back(std::move(all));
    live_ = {live};
}

}  // namespace its::adaptive
