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
constexpr double open_factor =
    2;  // nodes of more than this many half cubes are opened; measured, see docs/design/distance.md
constexpr double infinity = std::numeric_limits<double>::infinity();

/// A node of the triangle tree that may hold the triangle nearest to some point of a cube.
struct Candidate {
    std::uint32_t level, index;
    double distance;  ///< from the cube's centre: to the triangle, or a lower bound for what is in the sphere
};

/// A node seen from the centres of eight child cubes.
struct Opened {
    std::uint32_t level, index;
    double distance[lanes];  ///< as Candidate::distance
};

struct Points {
    double x[lanes], y[lanes], z[lanes];
};

/// Points of a group in structure-of-arrays form; the last one is repeated to fill up whole lanes.
struct alignas(64) Packet {
    double x[padded_points], y[padded_points], z[padded_points];
    double from_centre[padded_points];  ///< distance to the group's centre, rounded up
    double squared[padded_points];      ///< smallest computed squared distance so far
    double bound[padded_points];        ///< an upper bound on the distance
    int size;                           ///< a multiple of the lanes
    double largest_bound;
};

/// distance[i] = lower bound on the distance from point i to what is in the sphere.
ITS_CLONES void sphere_distances(const Points& p, double sx, double sy, double sz, double radius,
                                 double* distance) {
    for (int i = 0; i < lanes; ++i) {
        const double dx = p.x[i] - sx, dy = p.y[i] - sy, dz = p.z[i] - sz;
        distance[i] = std::sqrt(dx * dx + dy * dy + dz * dz) - radius;
    }
}

/// distance[i] = distance from point i to triangle `lane` of the block.
ITS_CLONES void triangle_distances(const Points& p, const TriangleBlock& t, std::uint64_t lane,
                                   double* distance) {
    for (int i = 0; i < lanes; ++i) distance[i] = std::sqrt(squared_distance(t, lane, p.x[i], p.y[i], p.z[i]));
}

ITS_INLINE double larger(double a, double b) {
    return a < b ? b : a;
}
ITS_INLINE double smaller(double a, double b) {
    return b < a ? b : a;
}

/// The largest of eight numbers, without a chain of dependent comparisons.
ITS_INLINE double largest(const double* v) {
    double half[4], quarter[2];
    for (int i = 0; i < 4; ++i) half[i] = larger(v[i], v[i + 4]);
    for (int i = 0; i < 2; ++i) quarter[i] = larger(half[i], half[i + 2]);
    return larger(quarter[0], quarter[1]);
}

struct Sphere {
    double x, y, z, radius;
};

/// Bit i is set if point i of the packet may be nearer to the sphere's content than its bound.
ITS_CLONES unsigned may_improve(const Packet& packet, const Sphere& s) {
    unsigned points = 0;
    for (int chunk = 0; chunk < packet.size; chunk += lanes) {
        double gap[lanes];
        for (int i = 0; i < lanes; ++i) {
            const double dx = packet.x[chunk + i] - s.x, dy = packet.y[chunk + i] - s.y,
                         dz = packet.z[chunk + i] - s.z;
            const double reach = packet.bound[chunk + i] + s.radius;
            gap[i] = reach * reach - (dx * dx + dy * dy + dz * dz);
        }
        if (!(largest(gap) > 0)) continue;
        for (int i = 0; i < lanes; ++i) points |= unsigned(gap[i] > 0) << (chunk + i);
    }
    return points;
}

ITS_INLINE void update_largest_bound(Packet& packet) {
    double highest[lanes];
    for (int i = 0; i < lanes; ++i) highest[i] = packet.bound[i];
    for (int chunk = lanes; chunk < packet.size; chunk += lanes)
        for (int i = 0; i < lanes; ++i) highest[i] = larger(highest[i], packet.bound[chunk + i]);
    packet.largest_bound = largest(highest);
}

/// Improves some points of the packet by the eight triangles of a block, eight triangles at a time.
ITS_CLONES void improve_points(Packet& packet, unsigned points, const TriangleBlock& block) {
    for (; points != 0; points &= points - 1) {
        const int p = __builtin_ctz(points);
        double squared[lanes];
        for (int i = 0; i < lanes; ++i)
            squared[i] = -squared_distance(block, std::uint64_t(i), packet.x[p], packet.y[p], packet.z[p]);
        const double best = smaller(packet.squared[p], -largest(squared));
        packet.squared[p] = best;
        packet.bound[p] = smaller(packet.bound[p], std::sqrt(best));
    }
    update_largest_bound(packet);
}

/// Improves the packet by one triangle, eight points at a time, where it can be nearer than what is known: from
/// its distance to the centre, and from its sphere.
ITS_CLONES void improve(Packet& packet, const TriangleBlock& t, std::uint64_t lane, double from_centre,
                        const Sphere& s) {
    bool changed = false;
    for (int chunk = 0; chunk < packet.size; chunk += lanes) {
        double gap[lanes];  // positive where the triangle can be nearer
        for (int i = 0; i < lanes; ++i) {
            const double dx = packet.x[chunk + i] - s.x, dy = packet.y[chunk + i] - s.y,
                         dz = packet.z[chunk + i] - s.z;
            const double reach = packet.bound[chunk + i] + s.radius;
            const double in_sphere = reach * reach - (dx * dx + dy * dy + dz * dz);
            const double in_reach = packet.bound[chunk + i] + packet.from_centre[chunk + i] - from_centre;
            gap[i] = smaller(in_sphere, in_reach);
        }
        if (!(largest(gap) > 0)) continue;
        changed = true;
        for (int i = chunk; i < chunk + lanes; ++i) {
            const double d = squared_distance(t, lane, packet.x[i], packet.y[i], packet.z[i]);
            const double best = smaller(packet.squared[i], d);
            packet.squared[i] = best;
            packet.bound[i] = smaller(packet.bound[i], std::sqrt(best));
        }
    }
    if (changed) update_largest_bound(packet);
}

/// The group's point at corner x + 2y + 4z of its cube.
constexpr int corner_point(int corner) {
    return 2 * (corner & 1) + 6 * (corner >> 1 & 1) + 18 * (corner >> 2);
}

/// What is the same for all groups; lengths in steps (half a cube).
struct GroupShape {
    int inner[group_points];              ///< the 19 points that are no corners, then the corners
    double from_centre[group_points];     ///< of each point
    double from_corner[group_points][8];  ///< infinity where it exceeds √3: another corner is nearer
    static constexpr int inner_count = group_points - 8;

    GroupShape() {
        int inner_end = 0, corner_end = inner_count;
        for (int p = 0; p < group_points; ++p) {
            const int at[3] = {p % 3, p / 3 % 3, p / 9};
            from_centre[p] = 0;
            for (const int a : at) from_centre[p] += (a - 1) * (a - 1);
            inner[from_centre[p] == 3 ? corner_end++ : inner_end++] = p;
            from_centre[p] = std::sqrt(from_centre[p]);
            for (int corner = 0; corner < 8; ++corner) {
                int squared = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    const int offset = at[axis] - 2 * (corner >> axis & 1);
                    squared += offset * offset;
                }
                from_corner[p][corner] = squared <= 3 ? std::sqrt(double(squared)) : infinity;
            }
        }
    }
};
const GroupShape shape;

/// One thread's walk over octree and triangle tree.
class Descent {
public:
    Descent(const Octree& octree, const TriangleTree& tree, std::vector<std::vector<double>>& distance)
        : octree_(octree),
          tree_(tree),
          distance_(distance),
          slack_(TriangleTree::widening * unit_roundoff * std::ldexp(2.0, octree.depth)),
          lists_(std::size_t(octree.depth) + 1),
          opened_(std::size_t(octree.depth) + 1) {}

    /// The candidates of the group of a level that solve() and open() work on. May be changed by the caller.
    std::vector<Candidate>& list(int level) { return lists_[level]; }

    /// Solves a group, whose candidates are in list(level). The corners of its cube are known from its parent,
    /// unless it is the root.
    void solve(int level, std::uint64_t group) {
        const double step = std::ldexp(1.0, level);
        double* const solved = &distance_[level][group_points * group];
        const int count = level == octree_.depth ? group_points : GroupShape::inner_count;
        fill_packet(level, group, step, solved, count);

        std::vector<Candidate>& candidates = lists_[level];
        std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
            return a.distance != b.distance ? a.distance < b.distance
                                            : (a.level != b.level ? a.level < b.level : a.index < b.index);
        });
        const double radius = std::sqrt(3.0) * step + slack_;
        for (const Candidate& c : candidates) {
            if (c.distance >= packet_.largest_bound + radius) break;
            if (c.level == 0)
                try_triangle(c.index, c.distance);
            else
                visit(c.level, c.index);
        }
        for (int i = 0; i < count; ++i) solved[shape.inner[i]] = std::sqrt(packet_.squared[i]);
    }

    /// Sees list(level), the candidates of the group, from the centres of its subdivided children's cubes.
    void open(int level, std::uint64_t group) {
        const double half = std::ldexp(0.5, level);
        const Cell parent = morton_decode(octree_.levels[level].parent[group]);
        ChildCubes cubes;
        cubes.half = half;
        for (int c = 0; c < lanes; ++c) {
            cubes.centre.x[c] = half * (4.0 * parent[0] + 1 + 2 * (c & 1));
            cubes.centre.y[c] = half * (4.0 * parent[1] + 1 + 2 * (c >> 1 & 1));
            cubes.centre.z[c] = half * (4.0 * parent[2] + 1 + 2 * (c >> 2));
            const bool subdivided = octree_.levels[level].mask[group] >> c & 1;
            cubes.limit[c] = subdivided ? limit(level, group, c, infinity) : -infinity;
        }
        opened_[level].clear();
        for (const Candidate& c : lists_[level]) open_node(c.level, c.index, cubes, opened_[level]);
    }

    /// Puts into list(level − 1) the nodes of open() that can be nearest to a point of child c's cube, and
    /// seeds the child group's corners with the distances that are known there.
    void pass_on(int level, std::uint64_t group, int child, std::uint64_t child_group) {
        const double* const known = &distance_[level][group_points * group];
        double* const seed = &distance_[level - 1][group_points * child_group];
        for (int corner = 0; corner < 8; ++corner)
            seed[corner_point(corner)] = known[group_point(child, corner)];
        const std::vector<Opened>& opened = opened_[level];
        double at_centre = infinity;
        for (const Opened& o : opened)
            if (o.level == 0) at_centre = std::min(at_centre, o.distance[child]);
        const double farthest = limit(level, group, child, at_centre);
        std::vector<Candidate>& list = lists_[level - 1];
        list.clear();
        for (const Opened& o : opened)
            if (o.distance[child] < farthest) list.push_back({o.level, o.index, o.distance[child]});
    }

private:
    void fill_packet(int level, std::uint64_t group, double step, const double* solved, int count) {
        static constexpr double outward = 1 + 8 * unit_roundoff;
        const Cell parent = morton_decode(octree_.levels[level].parent[group]);
        packet_.size = (count + lanes - 1) / lanes * lanes;
        packet_.largest_bound = 0;
        for (int i = 0; i < packet_.size; ++i) {
            const int p = shape.inner[std::min(i, count - 1)];
            const int x = p % 3, y = p / 3 % 3, z = p / 9;
            packet_.x[i] = step * (2.0 * parent[0] + x);
            packet_.y[i] = step * (2.0 * parent[1] + y);
            packet_.z[i] = step * (2.0 * parent[2] + z);
            packet_.from_centre[i] = step * shape.from_centre[p] + slack_;
            packet_.squared[i] = infinity;
            double bound = infinity;  // D(p) ≤ D(g) + |p − g| for the corners g, if they are known
            if (count < group_points)
                for (int c = 0; c < 8; ++c)
                    bound = std::min(bound, solved[corner_point(c)] + step * shape.from_corner[p][c]);
            packet_.bound[i] = bound * outward + slack_;
            packet_.largest_bound = std::max(packet_.largest_bound, packet_.bound[i]);
        }
    }

    /// How far from the centre of child c's cube anything that is nearest to a point of the cube can be. Every
    /// point is within `radius` of the centre and of a corner: let B = min(D(centre), largest D(corner)) +
    /// radius, then no point of the cube is farther than B from M, and what is farther than B + radius from the
    /// centre is farther than B from all of the cube. `at_centre`: an upper bound on D(centre), besides those
    /// from the corners.
    double limit(int level, std::uint64_t group, int child, double at_centre) const {
        const double radius = std::sqrt(3.0) * std::ldexp(0.5, level);
        const double* const known = &distance_[level][group_points * group];
        double least = infinity, most = 0;
        for (int corner = 0; corner < 8; ++corner) {
            least = std::min(least, known[group_point(child, corner)]);
            most = std::max(most, known[group_point(child, corner)]);
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
        const Sphere s = sphere(level, index);
        double distance[lanes];
        sphere_distances(cubes.centre, s.x, s.y, s.z, s.radius, distance);
        bool near = false;
        for (int c = 0; c < lanes; ++c) near |= distance[c] < cubes.limit[c];
        if (!near) return;
        if (level > 0 && s.radius > open_factor * cubes.half) {
            const std::uint32_t begin = std::uint32_t(TriangleTree::arity) * index;
            for (std::uint32_t i = begin; i < begin + TriangleTree::arity; ++i)
                open_node(level - 1, i, cubes, out);
            return;
        }
        Opened& o = out.emplace_back();
        o.level = level;
        o.index = index;
        if (level == 0)
            triangle_distances(cubes.centre, tree_.block[index / lanes], index % lanes, o.distance);
        else
            std::copy(distance, distance + lanes, o.distance);
    }

    /// Improves the packet by all triangles below the node that can be nearest to one of its points.
    void visit(std::uint32_t level, std::uint32_t index) {
        const unsigned points =
            may_improve(packet_, sphere(level, index));  // none if it is padding, infinitely far
        if (points == 0) return;
        if (level == 1) {
            improve_points(packet_, points, tree_.block[index]);
            return;
        }
        const std::uint32_t begin = std::uint32_t(TriangleTree::arity) * index;
        for (std::uint32_t i = begin; i < begin + TriangleTree::arity; ++i) visit(level - 1, i);
    }

    void try_triangle(std::uint32_t i, double from_centre) {
        improve(packet_, tree_.block[i / lanes], i % lanes, from_centre, sphere(0, i));
    }

    Sphere sphere(std::uint32_t level, std::uint32_t i) const {
        const auto& s = tree_.levels[level];
        return {s.x[i], s.y[i], s.z[i], s.radius[i]};
    }

    const Octree& octree_;
    const TriangleTree& tree_;
    std::vector<std::vector<double>>& distance_;
    double slack_;  ///< more than the rounding errors of two distances together
    Packet packet_;
    std::vector<std::vector<Candidate>> lists_;  ///< by level: of the group being solved there
    std::vector<std::vector<Opened>> opened_;
};

/// A group whose subtree is still to be solved, with its candidates.
struct Task {
    std::uint64_t group;
    std::vector<Candidate> candidates;
};

/// fn(child group) for each subdivided child, with its candidates in list(level − 1).
template <class F>
void for_children(Descent& descent, const Octree& octree, int level, std::uint64_t group, F&& fn) {
    descent.open(level, group);
    std::uint64_t child_group = octree.levels[level].first[group];
    for (unsigned mask = octree.levels[level].mask[group]; mask != 0; mask &= mask - 1, ++child_group) {
        descent.pass_on(level, group, std::countr_zero(mask), child_group);
        fn(child_group);
    }
}

/// Solves a group and all below it, depth first.
void solve_subtree(Descent& descent, const Octree& octree, int level, std::uint64_t group) {
    descent.solve(level, group);
    if (level > 0)
        for_children(descent, octree, level, group, [&](std::uint64_t child_group) {
            solve_subtree(descent, octree, level - 1, child_group);
        });
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
    for (std::uint32_t i = 0; i < tree.levels[top].size(); ++i)
        if (tree.levels[top].radius[i] > 0) tasks[0].candidates.push_back({top, i, 0.0});

    // Breadth first while there are few groups, then every subtree by itself.
    int level = octree.depth;
    for (; level > 0 && octree.levels[level].groups() < enough_tasks; --level) {
        std::vector<Task> below(octree.levels[level - 1].groups());
        parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
            Descent descent(octree, tree, distance);
            descent.list(level) = tasks[i].candidates;
            descent.solve(level, tasks[i].group);
            for_children(descent, octree, level, tasks[i].group, [&](std::uint64_t child_group) {
                below[child_group] = {child_group, descent.list(level - 1)};
            });
        });
        tasks = std::move(below);
    }
    Stage stage(progress, "distance", tasks.size());
    parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
        Descent descent(octree, tree, distance);
        descent.list(level) = tasks[i].candidates;
        solve_subtree(descent, octree, level, tasks[i].group);
        stage.advance(1);
    });
    return distance;
}

}  // namespace its
