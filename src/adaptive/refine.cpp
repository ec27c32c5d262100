#include "adaptive/refine.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "adaptive/refiner.h"
#include "base/parallel.h"
#include "base/progress.h"

namespace its::adaptive {

using octree::group_point;
using octree::group_points;

namespace {

constexpr std::uint64_t leaf_grain = 64, copy_grain = 512;

}  // namespace

Refiner::Refiner(const Task& task, const Progress& progress)
    : task_(task),
      parts_(progress),
      tree_(task.lattice.depth),
      triangles_(task.open != nullptr ? task.open->triangles_of_mesh()
                                      : std::uint32_t(task.mesh.triangles.size())),
      search_(task.positions, task.mesh.triangles.first(triangles_), task.lattice.cells()) {
    pools_.emplace_back(task.mesh.triangles.size());
    for (std::size_t i = 0; i < pools_[0].size(); ++i) pools_[0][i] = std::uint32_t(i);
    live_.push_back(pools_[0].size());
    leaves_.resize(1);
    leaves_[0] = {.count = std::uint32_t(pools_[0].size())};
    splits_ = {0};
}

Refined Refiner::run() {
    while (!splits_.empty()) {
        // The passes up to this one make the coarsest leaves that the lattice and γ are meant for.
        if (passes_ > task_.least_depth && !affordable()) {
            complete_ = false;
            break;
        }
        ++passes_;
        Stage stage(parts_.next(0.15), "refinement", 4);
        halve_leaves();
        stage.advance(1);
        gather_affected();
        update_values();
        stage.advance(1);
        judge();
        stage.advance(2);
    }
    return finish();
}

bool Refiner::affordable() const {
    const std::uint64_t groups = tree_.size() + splits_.size();
    std::uint64_t pairs = 0, coming = 0;
    for (const auto& pool : pools_) pairs += pool.size();
    for (const std::uint32_t leaf : splits_) coming += leaves_[leaf].count;
    // A copy of each list that is to be halved, and lists of four children: as many as a plane meets on
    // average.
    const std::uint64_t lists = 4 * (2 * pairs + 5 * coming);
    return 8 * groups + 1 <= task_.max_cells &&
           groups * bytes_per_group + lists + hanging_.bytes() <= task_.max_bytes &&
           leaves_.size() + 8 * splits_.size() < none;  // numbers of leaves, of which there are more
}

/// Groups of a level in Morton order; their leaves follow those of the levels below.
void Refiner::put_level(int level, const std::vector<std::uint32_t>& order, double scale, Refined& result) {
    std::vector<std::uint64_t> parent(order.size());
    std::vector<std::uint8_t> subdivided(order.size()), surface(order.size()), inside(order.size());
    std::vector<double> values(group_points * order.size());
    parallel_for(order.size(), copy_grain, [&](std::uint64_t i) {
        const Group& group = tree_[order[i]];
        parent[i] = group.parent;
        subdivided[i] = group.subdivided;
        surface[i] = group.surface;
        for (int c = 0; c < 8; ++c)
            if (task_.open == nullptr && (group.inside >> group_point(c, 0) & 1))
                inside[i] |= std::uint8_t(1u << c);
        for (std::size_t p = 0; p < group_points; ++p) values[group_points * i + p] = scale * group.value[p];
    });
    if (level == 0)
        result.octree.levels.emplace_back(std::move(parent), std::move(surface));
    else
        result.octree.levels.emplace_back(std::move(parent), std::move(subdivided), std::move(surface));
    result.values.push_back(std::move(values));
    result.sides.inside.emplace_back(std::move(inside));
}

/// Of the leaves in this order, the numbers of those that miss the window.
std::vector<std::uint64_t> Refiner::coarse_leaves(const std::vector<std::uint32_t>& leaves) const {
    std::vector<std::vector<std::uint64_t>> found(chunk_count(leaves.size(), leaf_grain));
    for_chunks(leaves.size(), leaf_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        Fit fit(task_.lattice, task_.positions, task_.mesh.triangles);
        for (std::uint64_t i = begin; i < end; ++i) {
            const Leaf& leaf = leaves_[leaves[i]];
            double value[8];
            corner_values(tree_[leaf.group], leaf.child, value);
            if (!fit.within(cube_of(leaf), value, triangles_of(leaf), task_.lower, task_.upper))
                found[chunk].push_back(i);
        }
    });
    std::vector<std::uint64_t> all;
    for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
    return all;
}

Refined Refiner::finish() {
    std::vector<std::vector<std::uint32_t>> order(std::size_t(tree_.depth()) + 1);
    for (std::uint32_t g = 0; g < tree_.size(); ++g) order[std::size_t(tree_[g].level)].push_back(g);
    hanging_ = {};
    int finest = 0;  // of the levels
    while (order[std::size_t(finest)].empty()) ++finest;

    Refined result;
    result.depth = tree_.depth() - finest;
    result.octree.depth = result.depth;
    result.distances = distances_;
    result.passes = passes_;
    std::vector<std::uint32_t> leaves;  // in order
    for (int level = finest; level <= tree_.depth(); ++level) {
        auto& groups = order[std::size_t(level)];
        std::sort(groups.begin(), groups.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return tree_[a].parent < tree_[b].parent; });
        for (const std::uint32_t g : groups)
            for (unsigned left = tree_[g].surface; left != 0; left &= left - 1)
                leaves.push_back(number_of({g, std::countr_zero(left)}));
    }
    if (!complete_) result.coarse = coarse_leaves(leaves);
    tree_.forget_links();

    std::vector<std::int32_t> winding(only_bits_ ? 0 : leaves.size());
    result.corners_inside.resize(leaves.size());
    result.offset.resize(leaves.size() + 1);
    for (std::size_t i = 0; i < leaves.size(); ++i) {
        const Leaf& leaf = leaves_[leaves[i]];
        result.offset[i + 1] = result.offset[i] + triangles_of(leaf).size();
        for (int c = 0; c < 8 && task_.open == nullptr; ++c)  // sides are not constant off M under that rule
            if (tree_[leaf.group].inside >> group_point(leaf.child, c) & 1)
                result.corners_inside[i] |= std::uint8_t(1u << c);
        if (!winding.empty()) winding[i] = leaf.winding;
    }
    result.triangle.resize(result.offset.back());
    parallel_for(leaves.size(), copy_grain, [&](std::uint64_t i) {
        const auto list = triangles_of(leaves_[leaves[i]]);
        std::copy(list.begin(), list.end(), result.triangle.begin() + std::ptrdiff_t(result.offset[i]));
    });
    std::vector<std::vector<std::uint32_t>>().swap(pools_);
    leaves_ = {};
    if (!winding.empty()) result.sides.winding = std::move(winding);
    const double scale = std::ldexp(1.0, -finest);
    for (int level = finest; level <= tree_.depth(); ++level)
        put_level(level - finest, order[std::size_t(level)], scale, result);
    return result;
}

Refined refine(const Task& task, const Progress& progress) {
    return Refiner(task, progress).run();
}

}  // namespace its::adaptive
