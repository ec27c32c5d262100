#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "adaptive/refiner.h"
#include "base/parallel.h"
#include "geometry/vec3.h"

/// Values of f at grid points: free ones, distances, hanging ones.
namespace its::adaptive {

using octree::group_point;
using octree::group_points;

namespace {

constexpr std::uint64_t group_grain = 64, copy_grain = 512;
constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

void Refiner::gather_affected() {
    work_.assign(std::size_t(tree_.depth()) + 1, {});
    const std::uint32_t count = tree_.size() - first_new_;
    std::vector<std::vector<std::uint32_t>> found(chunk_count(count, group_grain));
    for_chunks(count, group_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) {
            const std::uint32_t group = first_new_ + std::uint32_t(i);
            found[chunk].push_back(group);
            for (int n = 0; n < octree::neighbours; ++n) {
                const std::uint32_t next = tree_.links(group).around[std::size_t(n)];
                if (n != octree::itself && next != none) gather_towards(next, opposite(n), found[chunk]);
            }
        }
    });
    for (const auto& part : found)
        for (const std::uint32_t group : part) queue(group);
}

void Refiner::gather_towards(std::uint32_t group, int direction, std::vector<std::uint32_t>& found) const {
    if (tree_[group].free != all_points) found.push_back(group);
    for (unsigned left = tree_[group].subdivided & children_towards[std::size_t(direction)]; left != 0;
         left &= left - 1)
        gather_towards(tree_.links(group).child[std::size_t(std::countr_zero(left))], direction, found);
}

void Refiner::update_values() {
    open_.swap(missing_);
    missing_.clear();
    for (int level = tree_.depth(); level >= 0; --level) {
        const std::vector<std::uint32_t>& groups = work_[std::size_t(level)];
        if (groups.empty()) continue;
        find_free(groups);
        find_distances(groups);
        parallel_for(groups.size(), copy_grain,
                     [&](std::uint64_t i) { copy_from_owners(groups[i], deferred_[i]); });
        set_values(groups);
    }
    std::sort(open_.begin(), open_.end());
    open_.erase(std::unique(open_.begin(), open_.end()), open_.end());
    for (const auto& level : work_)
        for (const std::uint32_t group : level) tree_[group].waiting = false;
    work_.clear();
}

void Refiner::find_free(const std::vector<std::uint32_t>& groups) {
    newly_.assign(groups.size(), 0);
    deferred_.assign(groups.size(), 0);
    std::vector<std::vector<Place>> coarse(chunk_count(groups.size(), copy_grain));
    for_chunks(groups.size(), copy_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i)
            newly_[i] = all_points & ~tree_.hanging(groups[i], coarse[chunk]) & ~tree_[groups[i]].free;
    });
    if (!task_.balanced) return;
    for (const auto& part : coarse)
        for (const Place& leaf : part) splits_.push_back(number_of(leaf));
}

double Refiner::value_of(const Group& group, int p, double distance) const {
    if (task_.open != nullptr) {
        const octree::Cell at = octree::morton_decode(group.parent);
        const auto index = [&](std::size_t axis, int half) {
            return (2 * std::uint64_t{at[axis]} + std::uint64_t(half)) << group.level;
        };
        distance =
            std::min(distance, task_.open->to_flip({index(0, p % 3), index(1, p / 3 % 3), index(2, p / 9)}));
    }
    return group.inside >> p & 1 ? 0.0 - distance : distance;  // +0 stays +0
}

void Refiner::find_distances(const std::vector<std::uint32_t>& groups) {
    std::atomic<std::uint64_t> evaluated = 0;
    for_chunks(groups.size(), group_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        distance::PointDistances search(search_);
        std::uint64_t count = 0;
        for (std::uint64_t i = begin; i < end; ++i)
            count += find_in_group(groups[i], newly_[i], search, deferred_[i]);
        evaluated.fetch_add(count, std::memory_order_relaxed);
    });
    distances_ += evaluated;
}

std::uint32_t Refiner::copy_known(std::uint32_t number, std::uint32_t& wanted) {
    Group& group = tree_[number];
    std::uint32_t others = 0;
    for (int n = 0; n < octree::neighbours && wanted != 0; ++n) {
        const octree::SharedPoints& shared = octree::shared_points[std::size_t(n)];
        const std::uint32_t next = tree_.links(number).around[std::size_t(n)];
        if (n == octree::itself || next == none || (shared.bits & wanted) == 0) continue;
        const Group& other = tree_[next];
        if (next < number) others |= shared.bits;
        for (std::size_t i = 0; i < std::size_t(shared.count); ++i) {
            const unsigned ours = shared.ours[i], theirs = shared.theirs[i];
            if ((wanted >> ours & other.free >> theirs & 1) == 0) continue;
            group.value[ours] = other.value[theirs];
            wanted &= ~(1u << ours);
        }
    }
    return others & wanted;
}

std::uint64_t Refiner::find_in_group(std::uint32_t number, std::uint32_t newly,
                                     distance::PointDistances& search, std::uint32_t& deferred) {
    Group& group = tree_[number];
    const Cube parent = parent_cube(group);
    std::array<int, group_points> points;
    std::size_t count = 0;
    std::uint32_t wanted = newly;
    for (std::uint32_t left = newly & (group.level < tree_.depth() ? corner_points : 0); left != 0;
         left &= left - 1) {  // the parent's corners are free, too
        const int p = std::countr_zero(left);
        const int above = group_point(int(group.parent & 7), corner_number(p));
        group.value[std::size_t(p)] = tree_[group.above].value[std::size_t(above)];
        wanted &= ~(1u << p);
    }
    deferred = copy_known(number, wanted);
    for (std::uint32_t left = wanted & ~deferred; left != 0; left &= left - 1) {
        const int p = std::countr_zero(left);
        if (const double* const found = hanging_.find(key_of(group, p)))
            group.value[std::size_t(p)] = *found;
        else
            points[count++] = p;
    }
    if (count == 0) return 0;
    search.begin(parent.corner + Vec3{0.5 * parent.width, 0.5 * parent.width, 0.5 * parent.width},
                 0.5 * parent.width);
    for (std::size_t i = 0; i < count; ++i)
        search.add(point_in(parent, points[i]), bound_at(group, parent, points[i]));
    search.solve(some_list(number));
    for (std::size_t i = 0; i < count; ++i)
        group.value[std::size_t(points[i])] = value_of(group, points[i], search.distance(int(i)));
    return count;
}

double Refiner::bound_at(const Group& group, const Cube& parent, int p) const {
    constexpr int middle = octree::itself;
    if (task_.open != nullptr || !(group.free >> middle & 1)) return infinity;  // values may be less
    return std::abs(group.value[middle]) + norm(point_in(parent, p) - point_in(parent, middle));
}

std::span<const std::uint32_t> Refiner::some_list(std::uint32_t number) const {
    const Group& group = tree_[number];
    if (group.surface == 0) return {};
    std::span<const std::uint32_t> most;
    for (unsigned left = group.surface; left != 0; left &= left - 1) {
        const auto list = triangles_of(leaves_[number_of({number, std::countr_zero(left)})]);
        if (list.size() > most.size()) most = list;
    }
    return most;
}

void Refiner::copy_from_owners(std::uint32_t number, std::uint32_t deferred) {
    for (; deferred != 0; deferred &= deferred - 1) {
        const int p = std::countr_zero(deferred);
        const Sharings& shared = sharings[std::size_t(p)];
        std::uint32_t first = number;
        int there = p;
        for (int i = 0; i < shared.count; ++i) {
            const Sharing& with = shared.with[std::size_t(i)];
            const std::uint32_t next = tree_.links(number).around[std::size_t(with.direction)];
            if (next >= first) continue;
            first = next;
            there = with.point;
        }
        tree_[number].value[std::size_t(p)] = tree_[first].value[std::size_t(there)];
    }
}

void Refiner::set_values(const std::vector<std::uint32_t>& groups) {
    std::vector<std::uint32_t> changed(groups.size());
    parallel_for(groups.size(), copy_grain, [&](std::uint64_t i) {
        Group& group = tree_[groups[i]];
        const bool first_time = groups[i] >= first_new_;
        group.free |= newly_[i];
        changed[i] = first_time ? all_points : newly_[i];
        const std::uint32_t hanging = all_points & ~group.free;
        if (hanging == 0) return;
        double corner[8];
        corner_values(tree_[group.above], int(group.parent & 7), corner);
        for (std::uint32_t left = hanging; left != 0; left &= left - 1) {
            const int p = std::countr_zero(left);
            const double value = interpolated(corner, p);
            if (std::exchange(group.value[std::size_t(p)], value) != value) changed[i] |= 1u << p;
        }
    });
    for (std::size_t i = 0; i < groups.size(); ++i) {
        if (changed[i] == 0) continue;
        const Group& group = tree_[groups[i]];
        for (unsigned left = group.surface | group.subdivided; left != 0; left &= left - 1) {
            const int child = std::countr_zero(left);
            if ((points_of_child[std::size_t(child)] & changed[i]) == 0) continue;
            const std::uint32_t below = number_of({groups[i], child});
            if (group.surface >> child & 1)
                open_.push_back(below);
            else
                queue(below);
        }
    }
}

}  // namespace its::adaptive
