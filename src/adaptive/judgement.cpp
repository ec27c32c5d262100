#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "adaptive/refiner.h"
#include "base/parallel.h"
#include "geometry/vec3.h"

/// Which leaves keep to the window, and which are to blame where one does not.
namespace its::adaptive {

using octree::group_point;

namespace {

constexpr std::uint64_t leaf_grain = 64;
constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

void Refiner::judge() {
    std::erase_if(open_, [&](std::uint32_t i) { return leaves_[i].split; });
    std::vector<Verdict> verdict(open_.size());
    for_chunks(open_.size(), leaf_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        Fit fit(task_.lattice, task_.positions, task_.mesh.triangles);
        for (std::uint64_t i = begin; i < end; ++i) verdict[i] = first_verdict(leaves_[open_[i]], fit);
    });
    evaluate_hanging(verdict);
    std::vector<std::int8_t> worst(open_.size());
    for_chunks(open_.size(), leaf_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        Fit fit(task_.lattice, task_.positions, task_.mesh.triangles);
        for (std::uint64_t i = begin; i < end; ++i)
            if (verdict[i] == Verdict::misses) verdict[i] = second_verdict(leaves_[open_[i]], fit, worst[i]);
    });
    for (std::size_t i = 0; i < open_.size(); ++i) {
        const Leaf& leaf = leaves_[open_[i]];
        if (verdict[i] == Verdict::halve && level_of(leaf) > 0) splits_.push_back(open_[i]);
        if (verdict[i] == Verdict::halve && level_of(leaf) == 0) complete_ = false;
        if (verdict[i] != Verdict::coarse) continue;
        missing_.push_back(open_[i]);
        split_around(leaf.group, worst[i]);
    }
    open_.clear();
    std::sort(splits_.begin(), splits_.end());
    splits_.erase(std::unique(splits_.begin(), splits_.end()), splits_.end());
}

Verdict Refiner::first_verdict(const Leaf& leaf, Fit& fit) const {
    const int level = level_of(leaf);
    const Cube cube = cube_of(leaf);
    if (tree_.depth() - level < task_.least_depth) return Verdict::halve;
    const auto list = triangles_of(leaf);
    if (list.empty() && task_.open != nullptr && level > task_.open->flip_level()) return Verdict::halve;
    if (list.size() > task_.many_triangles && cube.width > task_.many_width) return Verdict::halve;
    if (task_.also && task_.also(level, code_of(leaf))) return Verdict::halve;
    double value[8];
    corner_values(tree_[leaf.group], leaf.child, value);
    if (fit.within(cube, value, list, task_.lower, task_.upper)) return Verdict::fits;
    return hanging_corners(leaf) == 0 ? Verdict::halve : Verdict::misses;
}

Verdict Refiner::second_verdict(const Leaf& leaf, Fit& fit, std::int8_t& worst) const {
    const Group& group = tree_[leaf.group];
    double value[8], error = -1;
    corner_values(group, leaf.child, value);
    for (int c = 0; c < 8; ++c) {
        const int p = group_point(leaf.child, c);
        if (group.free >> p & 1) continue;
        const double distance = *hanging_.find(key_of(group, p));
        if (std::abs(value[c] - distance) > error) {
            error = std::abs(value[c] - distance);
            worst = std::int8_t(p);
        }
        value[c] = distance;
    }
    return fit.within(cube_of(leaf), value, triangles_of(leaf), task_.lower, task_.upper) ? Verdict::coarse
                                                                                          : Verdict::halve;
}

void Refiner::evaluate_hanging(const std::vector<Verdict>& verdict) {
    struct Wanted {
        std::uint64_t key;
        std::uint32_t leaf;
        std::int32_t point;
        double distance;
    };
    std::vector<Wanted> wanted;
    for (std::size_t i = 0; i < open_.size(); ++i) {
        if (verdict[i] != Verdict::misses) continue;
        const Leaf& leaf = leaves_[open_[i]];
        for (std::uint32_t left = hanging_corners(leaf); left != 0; left &= left - 1) {
            const int p = std::countr_zero(left);
            const std::uint64_t key = key_of(tree_[leaf.group], p);
            if (hanging_.find(key) == nullptr) wanted.push_back({key, open_[i], p, 0});
        }
    }
    std::sort(wanted.begin(), wanted.end(), [](const Wanted& a, const Wanted& b) {
        return std::pair(a.key, a.leaf) < std::pair(b.key, b.leaf);
    });
    wanted.erase(std::unique(wanted.begin(), wanted.end(),
                             [](const Wanted& a, const Wanted& b) { return a.key == b.key; }),
                 wanted.end());
    std::sort(wanted.begin(), wanted.end(), [](const Wanted& a, const Wanted& b) {
        return std::pair(a.leaf, a.point) < std::pair(b.leaf, b.point);
    });
    for_chunks(wanted.size(), leaf_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        distance::PointDistances search(search_);
        for (std::uint64_t i = begin; i < end;) {
            std::uint64_t next = i;
            const Leaf& leaf = leaves_[wanted[i].leaf];
            const Group& group = tree_[leaf.group];
            const Cube cube = cube_of(leaf), parent = parent_cube(group);
            const double half = 0.5 * cube.width;
            search.begin(cube.corner + Vec3{half, half, half}, half);
            for (; next < end && wanted[next].leaf == wanted[i].leaf; ++next)
                search.add(point_in(parent, wanted[next].point), infinity);
            search.solve(triangles_of(leaf));
            for (std::uint64_t j = i; j < next; ++j)
                wanted[j].distance = value_of(group, wanted[j].point, search.distance(int(j - i)));
            i = next;
        }
    });
    distances_ += wanted.size();
    for (const Wanted& w : wanted) hanging_.insert(w.key, w.distance);
}

void Refiner::split_around(std::uint32_t group, int point) {
    const Sharings& shared = sharings[std::size_t(point)];
    for (int i = 0; i < shared.count; ++i) {
        const int n = shared.with[std::size_t(i)].direction;
        if (tree_.links(group).around[std::size_t(n)] != none) continue;
        const Place leaf = tree_.leaf_around(group, n);
        if (tree_.is_surface(leaf)) splits_.push_back(number_of(leaf));
    }
}

}  // namespace its::adaptive
