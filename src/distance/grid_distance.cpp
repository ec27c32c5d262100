#include "distance/grid_distance.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/parallel.h"
#include "base/platform/compiler.h"
#include "base/rounding.h"
#include "distance/packet.h"
#include "distance/triangle_tree.h"
#include "geometry/vec3.h"
#include "octree/neighbours.h"

namespace its::distance {

namespace {

constexpr std::uint32_t all_points = (1u << octree::group_points) - 1;

/// A triangle (level 0) or a node of the triangle tree that may hold the triangle nearest to some point of a
/// cube.
struct Candidate {
    std::uint32_t level, index;
    double distance;  ///< from the cube's centre: to the triangle, or a lower bound for what is in the node
};

/// The same, seen from the centres of eight child cubes.
struct Opened {
    std::uint32_t level, index;
    double distance[lanes];
};

constexpr std::uint32_t corner_points = [] {
    std::uint32_t bits = 0;
    for (int corner = 0; corner < 8; ++corner) bits |= 1u << octree::group_point(corner, corner);
    return bits;
}();

/// What a group shares with the group next to it on the lower side along the axes in the bits of `direction`.
constexpr const octree::SharedPoints& shared_with_lower(unsigned direction) {
    return octree::shared_points[unsigned(octree::itself) - (direction & 1) - 3 * (direction >> 1 & 1) -
                                 9 * (direction >> 2)];
}

/// Groups by such a direction, no_group where there is none or it is not solved yet; at 0 the group itself.
using Neighbours = std::array<std::uint64_t, 8>;

Neighbours alone(std::uint64_t group) {
    Neighbours n;
    n.fill(octree::no_group);
    n[0] = group;
    return n;
}

/// Of child `child`, if `n` are those of its parent's group in level `above`.
Neighbours neighbours_of_child(const octree::Level& above, const Neighbours& n, unsigned child) {
    Neighbours result;
    for (unsigned direction = 0; direction < 8; ++direction) {
        const std::uint64_t group = n[direction & ~child];
        const unsigned place = child ^ direction;  // within that group
        const unsigned mask = group == octree::no_group ? 0u : above.mask[group];
        result[direction] = mask >> place & 1u ? above.first.rank(group, int(place)) : octree::no_group;
    }
    return result;
}

/// What is found at the 27 points of the groups.
struct Solution {
    std::vector<std::vector<double>> distance;
    std::vector<std::vector<std::uint32_t>> nearest;  ///< triangles, in the tree's order; none for level 0
};

/// What a group inherits from its parent.
struct Inheritance {
    std::vector<Candidate> candidates;
    std::array<std::uint32_t, 8> seed;  ///< triangles nearest to the corners of its cube
    int seeds = 0;

    void add_seed(std::uint32_t triangle) {
        if (!is_seed(triangle)) seed[std::size_t(seeds++)] = triangle;
    }
    bool is_seed(std::uint32_t triangle) const {
        return std::find(seed.begin(), seed.begin() + seeds, triangle) != seed.begin() + seeds;
    }
};

/// One thread's walk over octree and triangle tree.
class Descent {
public:
    Descent(const octree::Octree& octree, const TriangleTree& tree, Solution& solution)
        : octree_(octree),
          tree_(tree),
          solution_(solution),
          slack_(TriangleTree::widening * unit_roundoff * std::ldexp(2.0, octree.depth)),
          inherited_(std::size_t(octree.depth) + 1),
          opened_(std::size_t(octree.depth) + 1) {}

    /// What the group of a level that solve() and open() work on has inherited. May be set by the caller.
    Inheritance& inherited(int level) { return inherited_[std::size_t(level)]; }

    /// Solves a group. The corners of its cube are known from its parent, unless it is the root; what it shares
    /// with its neighbours is known from them.
    void solve(int level, const Neighbours& neighbours) {
        const std::uint64_t group = neighbours[0];
        std::uint32_t known = level == octree_.depth ? 0 : corner_points;
        for (const std::size_t direction : {1, 2, 4, 3, 5, 6, 7}) {
            if (neighbours[direction] == octree::no_group || (shared_with_lower(direction).bits & ~known) == 0)
                continue;
            copy_shared(level, group, neighbours[direction], shared_with_lower(direction));
            known |= shared_with_lower(direction).bits;
        }
        fill_packet(level, group, all_points & ~known);
        if (packet_.count == 0) return;

        const Inheritance& from = inherited(level);
        for (int i = 0; i < from.seeds; ++i) {
            const std::uint32_t t = from.seed[std::size_t(i)];
            improve_all(packet_, tree_.block[t / lanes], t % lanes, t);
        }
        entries_.clear();
        const double farthest = reach(packet_) + slack_;
        for (const Candidate& c : from.candidates) {
            if (c.distance > farthest) continue;
            if (c.level > 0)
                entries_.add(tree_.nodes(c.level, c.index), c.level, c.index);
            else if (!from.is_seed(c.index))
                improve_near(packet_, tree_.block[c.index / lanes], c.index % lanes, c.index, c.distance);
        }
        if (!entries_.id.empty())
            for (int i = 0; i < packet_.count; ++i) search(tree_, entries_, packet_, i);
        store(level, group);
    }

    /// Sees the candidates of the group from the centres of its subdivided children's cubes.
    void open(int level, std::uint64_t group) {
        const double half = std::ldexp(0.5, level);
        const octree::Cell parent = octree::morton_decode(octree_.levels[level].parent[group]);
        ChildCubes cubes;
        cubes.half = half;
        for (int c = 0; c < lanes; ++c) {
            cubes.centre.x[c] = half * (4.0 * parent[0] + 1 + 2 * (c & 1));
            cubes.centre.y[c] = half * (4.0 * parent[1] + 1 + 2 * (c >> 1 & 1));
            cubes.centre.z[c] = half * (4.0 * parent[2] + 1 + 2 * (c >> 2));
            const bool subdivided = octree_.levels[level].mask[group] >> c & 1;
            cubes.limit[c] = subdivided ? limit(level, group, c, infinity) : -infinity;
        }
        std::vector<Opened>& opened = opened_[std::size_t(level)];
        opened.clear();
        for (const Candidate& c : inherited(level).candidates) open_node(c.level, c.index, cubes, opened);
    }

    /// Hands to child c's group the nodes of open() that can be nearest to a point of its cube, and what is
    /// known at the cube's corners.
    void pass_on(int level, std::uint64_t group, int child, std::uint64_t child_group) {
        Inheritance& to = inherited(level - 1);
        to.seeds = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const std::uint64_t from = octree::group_points * group + octree::group_point(child, corner);
            const std::uint64_t at = octree::group_points * child_group + octree::group_point(corner, corner);
            solution_.distance[level - 1][at] = solution_.distance[level][from];
            const std::uint32_t nearest = solution_.nearest[level][from];
            if (level > 1) solution_.nearest[level - 1][at] = nearest;
            to.add_seed(nearest);
        }
        const std::vector<Opened>& opened = opened_[std::size_t(level)];
        double at_centre = infinity;
        for (const Opened& o : opened)
            if (o.level == 0) at_centre = std::min(at_centre, o.distance[child]);
        const double farthest = limit(level, group, child, at_centre);
        to.candidates.clear();
        for (const Opened& o : opened)
            if (o.distance[child] < farthest) to.candidates.push_back({o.level, o.index, o.distance[child]});
    }

private:
    void copy_shared(int level, std::uint64_t group, std::uint64_t neighbour,
                     const octree::SharedPoints& shared) {
        double* const d = solution_.distance[level].data();
        for (std::size_t i = 0; i < std::size_t(shared.count); ++i)
            d[octree::group_points * group + shared.ours[i]] =
                d[octree::group_points * neighbour + shared.theirs[i]];
        if (level == 0) return;
        std::uint32_t* const n = solution_.nearest[level].data();
        for (std::size_t i = 0; i < std::size_t(shared.count); ++i)
            n[octree::group_points * group + shared.ours[i]] =
                n[octree::group_points * neighbour + shared.theirs[i]];
    }

    void fill_packet(int level, std::uint64_t group, std::uint32_t points) {
        const double step = std::ldexp(1.0, level);
        const octree::Cell parent = octree::morton_decode(octree_.levels[level].parent[group]);
        packet_.count = std::popcount(points);
        for (int i = 0; i < (packet_.count + lanes - 1) / lanes * lanes; ++i) {
            const int p = std::countr_zero(points);
            if (i + 1 < packet_.count) points &= points - 1;
            const int x = p % 3, y = p / 3 % 3, z = p / 9;
            packet_.point[i] = p;
            packet_.x[i] = step * (2.0 * parent[0] + x);
            packet_.y[i] = step * (2.0 * parent[1] + y);
            packet_.z[i] = step * (2.0 * parent[2] + z);
            packet_.from_centre[i] = step * root[(x != 1) + (y != 1) + (z != 1)] + slack_;
            packet_.squared[i] = infinity;
        }
    }

    void store(int level, std::uint64_t group) {
        double* const distance = &solution_.distance[level][octree::group_points * group];
        for (int i = 0; i < packet_.count; ++i) distance[packet_.point[i]] = std::sqrt(packet_.squared[i]);
        if (level == 0) return;
        std::uint32_t* const nearest = &solution_.nearest[level][octree::group_points * group];
        for (int i = 0; i < packet_.count; ++i) nearest[packet_.point[i]] = std::uint32_t(packet_.nearest[i]);
    }

    /// How far from the centre of child c's cube anything that is nearest to a point of the cube can be. Every
    /// point is within `radius` of the centre and of a corner: let B = min(D(centre), largest D(corner)) +
    /// radius, then no point of the cube is farther than B from M, and what is farther than B + radius from the
    /// centre is farther than B from all of the cube. `at_centre`: an upper bound on D(centre), besides those
    /// from the corners.
    double limit(int level, std::uint64_t group, int child, double at_centre) const {
        const double radius = root[3] * std::ldexp(0.5, level);
        const double* const known = &solution_.distance[level][octree::group_points * group];
        double least = infinity, most = 0;
        for (int corner = 0; corner < 8; ++corner) {
            least = std::min(least, known[octree::group_point(child, corner)]);
            most = std::max(most, known[octree::group_point(child, corner)]);
        }
        return std::min({at_centre, least + radius, most}) + 2 * radius + 2 * slack_;
    }

    struct ChildCubes {
        Points centre;
        double half;
        double limit[lanes];
    };

    /// Appends the node, or what it consists of where it is much larger than the cubes, unless it is out of
    /// reach of all.
    void open_node(std::uint32_t level, std::uint32_t index, const ChildCubes& cubes,
                   std::vector<Opened>& out) {
        Opened o{level, index, {}};
        if (level == 0)
            triangle_distances(cubes.centre, tree_.block[index / lanes], index % lanes, o.distance);
        else
            node_distances(cubes.centre, tree_.nodes(level, index), index % lanes, o.distance);
        bool near = false;
        for (int c = 0; c < lanes; ++c) near |= o.distance[c] < cubes.limit[c];
        if (!near) return;
        if (level > 0 && tree_.nodes(level, index).radius[index % lanes] > open_factor * cubes.half) {
            const std::uint32_t begin = lanes * index;
            const std::uint64_t end = std::min<std::uint64_t>(begin + lanes, tree_.count(level - 1));
            for (std::uint32_t i = begin; i < end; ++i) open_node(level - 1, i, cubes, out);
            return;
        }
        out.push_back(o);
    }

    static constexpr double root[4] = {0, 1, std::numbers::sqrt2, std::numbers::sqrt3};

    const octree::Octree& octree_;
    const TriangleTree& tree_;
    Solution& solution_;
    double slack_;  ///< more than the rounding errors of two distances together
    Packet packet_;
    Entries entries_;
    std::vector<Inheritance> inherited_;  ///< by level: of the group being solved there
    std::vector<std::vector<Opened>> opened_;
};

/// A group whose subtree is still to be solved.
struct Task {
    std::uint64_t group = 0;
    Inheritance inheritance;
};

/// fn(child, child group) for each subdivided child, after handing it what it inherits.
template <class F>
void for_children(Descent& descent, const octree::Octree& octree, int level, std::uint64_t group, F&& fn) {
    descent.open(level, group);
    std::uint64_t child_group = octree.levels[level].first[group];
    for (unsigned mask = octree.levels[level].mask[group]; mask != 0; mask &= mask - 1, ++child_group) {
        const int child = std::countr_zero(mask);
        descent.pass_on(level, group, child, child_group);
        fn(child, child_group);
    }
}

/// Solves a group and all below it, depth first in Morton order: lower neighbours come before.
void solve_subtree(Descent& descent, const octree::Octree& octree, int level, const Neighbours& neighbours) {
    descent.solve(level, neighbours);
    if (level == 0) return;
    for_children(descent, octree, level, neighbours[0], [&](int child, std::uint64_t) {
        solve_subtree(descent, octree, level - 1,
                      neighbours_of_child(octree.levels[level], neighbours, unsigned(child)));
    });
}

constexpr std::uint64_t enough_tasks = 64;

}  // namespace

std::vector<std::vector<double>> grid_distances(const octree::Octree& octree, std::span<const Vec3> positions,
                                                std::span<const Triangle> triangles, const Progress& progress) {
    const TriangleTree tree = make_triangle_tree(positions, triangles, std::ldexp(2.0, octree.depth));
    Solution solution;
    for (const octree::Level& level : octree.levels) {
        solution.distance.emplace_back(octree::group_points * level.groups());
        solution.nearest.emplace_back(solution.nearest.empty() ? 0 : octree::group_points * level.groups());
    }

    std::vector<Task> tasks(1);
    for (std::uint32_t i = 0; i < tree.count(tree.top()); ++i)
        tasks[0].inheritance.candidates.push_back({tree.top(), i, 0.0});

    // Breadth first while there are few groups, then every subtree by itself.
    int level = octree.depth;
    for (; level > 0 && octree.levels[level].groups() < enough_tasks; --level) {
        std::vector<Task> below(octree.levels[level - 1].groups());
        parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
            Descent descent(octree, tree, solution);
            descent.inherited(level) = tasks[i].inheritance;
            descent.solve(level, alone(tasks[i].group));
            for_children(descent, octree, level, tasks[i].group, [&](int, std::uint64_t child_group) {
                below[child_group] = {child_group, descent.inherited(level - 1)};
            });
        });
        tasks = std::move(below);
    }
    Stage stage(progress, "distance", tasks.size());
    parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
        Descent descent(octree, tree, solution);
        descent.inherited(level) = tasks[i].inheritance;
        solve_subtree(descent, octree, level, alone(tasks[i].group));
        stage.advance(1);
    });
    return std::move(solution.distance);
}

}  // namespace its::distance
