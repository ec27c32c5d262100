#include "distance/grid_distance.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/rounding.h"
#include "base/simd.h"
#include "distance/triangle_tree.h"
#include "geometry/vec3.h"

namespace its {

namespace {

constexpr int lanes = 8;
constexpr int padded_points = 32;  // 27 points, the last one repeated
constexpr double infinity = std::numeric_limits<double>::infinity();

/// A node of the triangle tree that may be nearest to a point of a cube.
struct Node {
    std::uint32_t level;
    std::uint32_t index;
};

/// The 27 points of a group in structure-of-arrays form.
struct alignas(64) Packet {
    double x[padded_points], y[padded_points], z[padded_points];
    double squared[padded_points];  ///< smallest computed squared distance so far
    double bound[padded_points];    ///< an upper bound on the distance
};

struct Cube {
    Vec3 centre;
    double half;
};

/// Lower bounds on the distance between a cube and eight sibling spheres, less the radii; not below −radius.
ITS_CLONES void distances_to_cube(const TriangleTree::Spheres& s, std::uint64_t begin, const Cube& cube,
                                  double* out) {
    for (int i = 0; i < lanes; ++i) {
        const double dx = std::abs(s.x[begin + i] - cube.centre.x) - cube.half;
        const double dy = std::abs(s.y[begin + i] - cube.centre.y) - cube.half;
        const double dz = std::abs(s.z[begin + i] - cube.centre.z) - cube.half;
        const double cx = dx > 0 ? dx : 0, cy = dy > 0 ? dy : 0, cz = dz > 0 ? dz : 0;
        out[i] = std::sqrt(cx * cx + cy * cy + cz * cz) - s.radius[begin + i];
    }
}

/// Improves the packet by one triangle, eight points at a time, where its sphere allows an improvement.
ITS_CLONES void improve(Packet& packet, const TriangleTree::Record& t, double sx, double sy, double sz,
                        double radius) {
    for (int chunk = 0; chunk < padded_points; chunk += lanes) {
        int near = 0;
        for (int i = chunk; i < chunk + lanes; ++i) {
            const double dx = packet.x[i] - sx, dy = packet.y[i] - sy, dz = packet.z[i] - sz;
            const double reach = packet.bound[i] + radius;
            near |= dx * dx + dy * dy + dz * dz <= reach * reach;
        }
        if (!near) continue;
        for (int i = chunk; i < chunk + lanes; ++i) {
            const double d = squared_distance(t, packet.x[i], packet.y[i], packet.z[i]);
            const double best = d < packet.squared[i] ? d : packet.squared[i];
            const double root = std::sqrt(best);
            packet.squared[i] = best;
            packet.bound[i] = root < packet.bound[i] ? root : packet.bound[i];
        }
    }
}

double distance_to_cube(const TriangleTree::Spheres& s, std::uint64_t i, const Cube& cube) {
    const double dx = std::max(std::abs(s.x[i] - cube.centre.x) - cube.half, 0.0);
    const double dy = std::max(std::abs(s.y[i] - cube.centre.y) - cube.half, 0.0);
    const double dz = std::max(std::abs(s.z[i] - cube.centre.z) - cube.half, 0.0);
    return std::sqrt(dx * dx + dy * dy + dz * dz) - s.radius[i];
}

/// One thread's walk over octree and triangle tree.
class Descent {
public:
    Descent(const Octree& octree, const TriangleTree& tree, std::vector<std::vector<double>>& distance)
        : octree_(octree), tree_(tree), distance_(distance) {}

    /// Solves a group, given the nodes that can be nearest to a point of its cube.
    void solve(int level, std::uint64_t group, std::span<const Node> nodes) {
        const double step = std::ldexp(1.0, level);
        const Cell parent = morton_decode(octree_.levels[level].parent[group]);
        const Vec3 corner = {2 * step * parent[0], 2 * step * parent[1], 2 * step * parent[2]};
        double* const solved = &distance_[level][group_points * group];
        const bool root = level == octree_.depth;
        for (int i = 0; i < padded_points; ++i) {
            const int p = std::min(i, group_points - 1);
            packet_.x[i] = corner.x + step * (p % 3);
            packet_.y[i] = corner.y + step * (p / 3 % 3);
            packet_.z[i] = corner.z + step * (p / 9);
            packet_.squared[i] = infinity;
            packet_.bound[i] = root ? infinity : inherited_bound(solved, p, step);
        }
        const Cube cube = {corner + step * Vec3{1, 1, 1}, step};
        for (const Node node : nodes) visit(node, cube);
        for (int p = 0; p < group_points; ++p) solved[p] = std::sqrt(packet_.squared[p]);
    }

    /// Appends to `stack` what of its nodes [begin, end), the group's, can be nearest to a point of child c's
    /// cube. Also seeds the child group's corners with what is known there.
    void pass_on(int level, std::uint64_t group, int child, std::uint64_t child_group, std::vector<Node>& stack,
                 std::size_t begin, std::size_t end) {
        const double half = std::ldexp(0.5, level);
        const std::uint64_t code = octree_.levels[level].parent[group] << 3 | std::uint64_t(child);
        const Cell at = morton_decode(code);
        const Cube cube = {2 * half * Vec3{at[0] + 0.5, at[1] + 0.5, at[2] + 0.5}, half};
        const double* const known = &distance_[level][group_points * group];
        double* const seed = &distance_[level - 1][group_points * child_group];
        double least = infinity, most = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const double d = known[group_point(child, corner)];
            seed[corner_point(corner)] = d;
            least = std::min(least, d);
            most = std::max(most, d);
        }
        // Every point of the cube is within √3·half of a corner, and within 2√3·half of each.
        const double radius = std::sqrt(3.0) * half;
        const double bound = std::min(most + radius, least + 2 * radius);
        for (std::size_t i = begin; i < end; ++i) narrow(stack[i], cube, bound, stack);
    }

private:
    /// The group's point at corner x + 2y + 4z of its cube.
    static int corner_point(int corner) {
        return 2 * (corner & 1) + 6 * (corner >> 1 & 1) + 18 * (corner >> 2);
    }

    /// D(p) ≤ D(g) + |p − g| over the cube's corners g; rounded up.
    static double inherited_bound(const double* solved, int p, double step) {
        static constexpr double outward = 1 + 4 * unit_roundoff;
        static const double length[4] = {0, 1, std::sqrt(2.0), std::sqrt(3.0)};
        const int at[3] = {p % 3, p / 3 % 3, p / 9};
        double bound = infinity;
        for (int corner = 0; corner < 8; ++corner) {
            int squared = 0;  // of the offset, in steps: each component 0, 1 or 2
            for (int axis = 0; axis < 3; ++axis) {
                const int offset = at[axis] - 2 * (corner >> axis & 1);
                squared += offset * offset;
            }
            if (squared <= 3)
                bound = std::min(bound, (solved[corner_point(corner)] + step * length[squared]) * outward);
        }
        return bound * outward;
    }

    /// Adds the node, or what of it can be near, to `out`: nodes much larger than the cube are opened.
    void narrow(Node node, const Cube& cube, double bound, std::vector<Node>& out) {
        const auto& s = tree_.levels[node.level];
        if (!(distance_to_cube(s, node.index, cube) < bound)) return;
        if (node.level == 0 || s.radius[node.index] <= cube.half) {
            out.push_back(node);
            return;
        }
        const std::uint64_t begin = TriangleTree::arity * node.index;
        double distance[lanes];
        distances_to_cube(tree_.levels[node.level - 1], begin, cube, distance);
        for (int i = 0; i < lanes; ++i)
            if (distance[i] < bound) narrow({node.level - 1, std::uint32_t(begin + i)}, cube, bound, out);
    }

    double largest_bound() const { return *std::max_element(packet_.bound, packet_.bound + padded_points); }

    /// Improves the packet by all triangles below the node that can be nearest to one of its points.
    void visit(Node node, const Cube& cube) {
        const auto& s = tree_.levels[node.level];
        if (node.level == 0) {
            if (distance_to_cube(s, node.index, cube) < largest_bound()) try_triangle(node.index);
            return;
        }
        const std::uint64_t begin = TriangleTree::arity * node.index;
        double distance[lanes];
        distances_to_cube(tree_.levels[node.level - 1], begin, cube, distance);
        std::array<int, lanes> order;
        for (int i = 0; i < lanes; ++i) order[i] = i;
        std::sort(order.begin(), order.end(), [&](int i, int j) {
            return std::pair(distance[i], i) < std::pair(distance[j], j);
        });
        for (const int i : order) {
            if (!(distance[i] < largest_bound())) return;  // so is padding, which is infinitely far
            visit({node.level - 1, std::uint32_t(begin + i)}, cube);
        }
    }

    void try_triangle(std::uint64_t i) {
        const auto& s = tree_.levels[0];
        improve(packet_, tree_.record[i], s.x[i], s.y[i], s.z[i], s.radius[i]);
    }

    const Octree& octree_;
    const TriangleTree& tree_;
    std::vector<std::vector<double>>& distance_;
    Packet packet_;
};

/// A group whose subtree is still to be solved, with its candidates.
struct Task {
    std::uint64_t group;
    std::vector<Node> nodes;
};

/// Solves the subtree below a group depth first; candidate lists are stacked in `nodes`, the group's own being
/// [begin, end).
void solve_subtree(Descent& descent, const Octree& octree, int level, std::uint64_t group, std::vector<Node>& nodes,
                   std::size_t begin, std::size_t end) {
    descent.solve(level, group, std::span(nodes).subspan(begin, end - begin));
    if (level == 0) return;
    std::uint64_t child_group = octree.levels[level].first[group];
    for (unsigned mask = octree.levels[level].mask[group]; mask != 0; mask &= mask - 1, ++child_group) {
        descent.pass_on(level, group, std::countr_zero(mask), child_group, nodes, begin, end);
        solve_subtree(descent, octree, level - 1, child_group, nodes, end, nodes.size());
        nodes.resize(end);
    }
}

constexpr std::uint64_t enough_tasks = 256;

}  // namespace

std::vector<std::vector<double>> grid_distances(const Octree& octree, std::span<const Vec3> positions,
                                                std::span<const Triangle> triangles, const Progress& progress) {
    const TriangleTree tree = make_triangle_tree(positions, triangles, std::ldexp(2.0, octree.depth));
    std::vector<std::vector<double>> distance;
    for (const Level& level : octree.levels) distance.emplace_back(group_points * level.groups());

    const std::uint32_t top = std::uint32_t(tree.levels.size() - 1);
    std::vector<Task> tasks(1);
    tasks[0].group = 0;
    for (std::uint32_t i = 0; i < tree.levels[top].size(); ++i)
        if (tree.levels[top].radius[i] > 0) tasks[0].nodes.push_back({top, i});

    // Breadth first while there are few groups, then every subtree by itself.
    int level = octree.depth;
    for (; level > 0 && octree.levels[level].groups() < enough_tasks; --level) {
        std::vector<Task> below(octree.levels[level - 1].groups());
        parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
            Descent descent(octree, tree, distance);
            auto& [group, nodes] = tasks[i];
            const std::size_t end = nodes.size();
            descent.solve(level, group, nodes);
            std::uint64_t child_group = octree.levels[level].first[group];
            for (unsigned mask = octree.levels[level].mask[group]; mask != 0; mask &= mask - 1, ++child_group) {
                descent.pass_on(level, group, std::countr_zero(mask), child_group, nodes, 0, end);
                below[child_group].group = child_group;
                below[child_group].nodes.assign(nodes.begin() + std::ptrdiff_t(end), nodes.end());
                nodes.resize(end);
            }
        });
        tasks = std::move(below);
    }
    Stage stage(progress, "distance", tasks.size());
    parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
        Descent descent(octree, tree, distance);
        std::vector<Node> nodes = tasks[i].nodes;
        solve_subtree(descent, octree, level, tasks[i].group, nodes, 0, nodes.size());
        stage.advance(1);
    });
    return distance;
}

}  // namespace its
