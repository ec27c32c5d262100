#include "distance/point_distances.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/vec3.h"

namespace its::distance {

SearchTree::SearchTree(std::span<const Vec3> positions, std::span<const Triangle> triangles, double coordinates)
    : tree(make_triangle_tree(positions, triangles, coordinates)), slot(triangles.size()), size(coordinates) {
    constexpr std::uint64_t grain = 65536;
    parallel_for(slot.size(), grain, [&](std::uint64_t i) { slot[tree.source[i]] = std::uint32_t(i); });
}

PointDistances::PointDistances(const SearchTree& search)
    : search_(search), slack_(TriangleTree::widening * unit_roundoff * search.size) {}

void PointDistances::begin(const Vec3& centre, double half) {
    centre_ = centre;
    half_ = half;
    packet_.count = 0;
}

void PointDistances::add(const Vec3& point, double bound) {
    const int i = packet_.count++;
    packet_.x[i] = point.x;
    packet_.y[i] = point.y;
    packet_.z[i] = point.z;
    packet_.from_centre[i] = norm(point - centre_) + slack_;
    const double widened = bound + slack_;  // a distance as small as the bound is to be found, not left out
    packet_.squared[i] = widened * widened;
}

void PointDistances::solve(std::span<const std::uint32_t> near) {
    const int last = packet_.count - 1;
    for (int i = packet_.count; i % lanes != 0; ++i) {  // lanes past the last point repeat it
        packet_.x[i] = packet_.x[last];
        packet_.y[i] = packet_.y[last];
        packet_.z[i] = packet_.z[last];
        packet_.from_centre[i] = packet_.from_centre[last];
        packet_.squared[i] = packet_.squared[last];
    }
    const TriangleTree& tree = search_.tree;
    seeds_ = int(std::min<std::size_t>(near.size(), seed_.size()));
    for (int i = 0; i < seeds_; ++i) {
        const std::uint32_t t = search_.slot[near[near.size() * std::size_t(i) / std::size_t(seeds_)]];
        seed_[std::size_t(i)] = t;
        improve_all(packet_, tree.block[t / lanes], t % lanes, t);
    }
    if (!(reach(packet_) < infinity)) improve_by_nearest_block();
    near_.clear();
    entries_.clear();
    open_nodes(tree.top(), 0, reach(packet_) + slack_);
    std::sort(near_.begin(), near_.end(), [](const Near& a, const Near& b) { return a.distance < b.distance; });
    for (const Near& n : near_)
        if (std::find(seed_.begin(), seed_.begin() + seeds_, n.triangle) == seed_.begin() + seeds_)
            improve_near(packet_, tree.block[n.triangle / lanes], n.triangle % lanes, n.triangle, n.distance);
    if (!entries_.id.empty())
        for (int i = 0; i < packet_.count; ++i) search(tree, entries_, packet_, i);
}

/// By the triangles of one block, found from the top by the nearest node each time: some bound, where there is
/// none.
void PointDistances::improve_by_nearest_block() {
    const TriangleTree& tree = search_.tree;
    std::uint32_t index = 0;  // of a block of nodes
    for (std::uint32_t level = tree.top(); level > 0; --level) {
        double distance[lanes];
        nodes_distances(tree.levels[level - 1][index], centre_.x, centre_.y, centre_.z, distance);
        const std::uint64_t count =
            std::min<std::uint64_t>(lanes, tree.count(level) - std::uint64_t{index} * lanes);
        index = index * lanes + std::uint32_t(std::min_element(distance, distance + count) - distance);
    }
    for (std::uint32_t i = 0; i < lanes; ++i)  // lanes past the last triangle repeat it
        improve_all(packet_, tree.block[index], i, index * lanes + i);
}

/// Gathers what is in a block of eight nodes of a level and can be nearest to some point of the cube: nodes
/// that are not much larger than the cube as they are, of others what they consist of. Level 0 are triangles.
void PointDistances::open_nodes(std::uint32_t level, std::uint32_t first_block, double farthest) {
    const TriangleTree& tree = search_.tree;
    double distance[lanes];
    if (level == 0)
        block_distances(tree.block[first_block], centre_.x, centre_.y, centre_.z, distance);
    else
        nodes_distances(tree.levels[level - 1][first_block], centre_.x, centre_.y, centre_.z, distance);
    const std::uint64_t count =
        std::min<std::uint64_t>(lanes, tree.count(level) - std::uint64_t{first_block} * lanes);
    for (std::uint32_t i = 0; i < count; ++i) {
        if (!(distance[i] < farthest)) continue;
        const std::uint32_t index = first_block * lanes + i;
        if (level == 0)
            near_.push_back({index, distance[i]});
        else if (tree.levels[level - 1][first_block].radius[i] > open_factor * half_)
            open_nodes(level - 1, index, farthest);
        else
            entries_.add(tree.levels[level - 1][first_block], level, index);
    }
}

double PointDistances::distance(int i) const {
    return std::sqrt(packet_.squared[i]);
}

}  // namespace its::distance
