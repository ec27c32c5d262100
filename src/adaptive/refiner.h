#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "adaptive/fit.h"
#include "adaptive/growing_tree.h"
#include "adaptive/hanging_distances.h"
#include "adaptive/refine.h"
#include "base/progress.h"
#include "distance/point_distances.h"
#include "octree/voxelise.h"

namespace its::adaptive {

/// What a leaf's test says.
enum class Verdict : std::uint8_t {
    fits,
    halve,   ///< whatever its neighbours do
    misses,  ///< the window, with hanging corners
    coarse,  ///< misses it because of a coarser leaf beside it
};

/// One refinement, pass by pass: docs/design/adaptive.md. Each part has a file of its own.
class Refiner {
public:
    Refiner(const Task& task, const Progress& progress);
    Refined run();

private:
    // Cells and their points: refiner.h.

    int level_of(const Leaf& leaf) const {
        return leaf.group == none ? tree_.depth() + 1 : tree_[leaf.group].level;
    }
    std::uint64_t code_of(const Leaf& leaf) const {
        return leaf.group == none ? 0 : tree_[leaf.group].parent << 3 | leaf.child;
    }
    std::span<const std::uint32_t> list_of(const Leaf& leaf) const {
        if (leaf.count == 0) return {};  // its pool may be gone
        return std::span(pools_[leaf.pool]).subspan(leaf.begin, leaf.count);
    }
    /// Of these, those that are M's: they come first.
    std::span<const std::uint32_t> of_mesh(std::span<const std::uint32_t> list) const {
        if (task_.open == nullptr) return list;
        return list.first(std::size_t(std::lower_bound(list.begin(), list.end(), triangles_) - list.begin()));
    }
    std::span<const std::uint32_t> triangles_of(const Leaf& leaf) const { return of_mesh(list_of(leaf)); }
    std::uint32_t number_of(const Place& place) const {
        return tree_.links(place.group).child[std::size_t(place.child)];
    }
    std::int32_t number_by_rule(std::int32_t winding) const {
        return task_.rule == SignRule::even_odd ? winding & 1 : winding;
    }
    void queue(std::uint32_t group) {
        if (std::exchange(tree_[group].waiting, true)) return;
        work_[std::size_t(tree_[group].level)].push_back(group);
    }
    Cube parent_cube(const Group& group) const {
        const double width = std::ldexp(2.0, group.level);
        const octree::Cell at = octree::morton_decode(group.parent);
        return {{width * at[0], width * at[1], width * at[2]}, width};
    }
    static Vec3 point_in(const Cube& parent, int p) {
        const double half = 0.5 * parent.width;
        const int x = p % 3, y = p / 3 % 3, z = p / 9;
        return parent.corner + Vec3{half * x, half * y, half * z};
    }
    /// Of a lattice point; no_key on the root's boundary, where no point hangs.
    std::uint64_t key_of(const Group& group, int p) const {
        const octree::Cell at = octree::morton_decode(group.parent);
        const std::array<int, 3> half = {p % 3, p / 3 % 3, p / 9};
        std::uint64_t key = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::uint64_t i = (2 * std::uint64_t{at[axis]} + std::uint64_t(half[axis])) << group.level;
            if (i >= task_.lattice.cells()) return HangingDistances::no_key;
            key |= i << 21 * axis;
        }
        return key;
    }
    static int corner_number(int point) {
        return (point % 3) / 2 + (point / 3 % 3) / 2 * 2 + (point / 9) / 2 * 4;
    }
    void corner_values(const Group& group, int child, double (&value)[8]) const {
        for (int c = 0; c < 8; ++c) value[c] = group.value[std::size_t(octree::group_point(child, c))];
    }
    Cube cube_of(const Leaf& leaf) const {
        const Group& group = tree_[leaf.group];
        const Cube parent = parent_cube(group);
        const double half = 0.5 * parent.width;
        const int c = leaf.child;
        return {parent.corner + Vec3{half * (c & 1), half * (c >> 1 & 1), half * (c >> 2)}, half};
    }
    std::uint32_t hanging_corners(const Leaf& leaf) const {
        return points_of_child[leaf.child] & ~tree_[leaf.group].free;
    }

    // Passes, limits and the result: refine.cpp.

    bool affordable() const;
    // A group's values twice, when they are put in order, or once with its links; its leaves, four at most as a
    // rule, with their bounds.
    static constexpr std::uint64_t bytes_per_group = 2 * sizeof(Group) + 4 * (sizeof(Leaf) + 32);
    Refined finish();
    std::vector<std::uint64_t> coarse_leaves(const std::vector<std::uint32_t>& leaves) const;
    void put_level(int level, const std::vector<std::uint32_t>& order, double scale, Refined& result);

    // Halving leaves: halving.cpp.

    void halve_leaves();
    /// Halves leaves of one level, in Morton order.
    void halve_level(std::span<const std::uint32_t> leaves, int level);
    /// The cells that meet M, and those in which inside and outside meet in a hole, in groups from `begin` on;
    /// with the triangles of both M and F.
    octree::Voxels with_holes(octree::Voxels below, std::uint32_t begin, int level) const;
    void link_above(std::uint32_t leaf, std::uint32_t group);
    /// All but what is around, and the leaves. The list of the cell is number i of `above`.
    void set_group(std::uint32_t number, int level, const Leaf& old, const octree::Voxels& above,
                   std::uint64_t i);
    void set_leaves(std::uint32_t number, const octree::Voxels& below, std::uint32_t first);
    /// Frees lists that no leaf has any more: whole pools, and where most is gone, what is left moves into one.
    void drop_lists();

    // Values of f at the grid points: values.cpp.

    /// Groups in which points may have become free: the new ones and those around, on all finer levels too.
    void gather_affected();
    /// Groups whose points are all free have nothing to become.
    void gather_towards(std::uint32_t group, int direction, std::vector<std::uint32_t>& found) const;
    /// From coarse to fine.
    void update_values();
    /// Which points have become free, and, for balance, which surface leaves touch some that are two levels
    /// finer or more.
    void find_free(const std::vector<std::uint32_t>& groups);
    /// Of a distance to M, what is the value there: the sign of its side, and in holes at most the distance to
    /// where sides meet.
    double value_of(const Group& group, int p, double distance) const;
    /// Sets the values of points that have become free, but for those that another group is to find.
    void find_distances(const std::vector<std::uint32_t>& groups);
    /// Values that groups around had before.
    /// \param wanted  points; those that are found are taken out \returns  of the others, those that a group
    ///                around with a lower number finds
    std::uint32_t copy_known(std::uint32_t number, std::uint32_t& wanted);
    /// \param deferred  receives the points whose values another group finds
    std::uint64_t find_in_group(std::uint32_t number, std::uint32_t newly, distance::PointDistances& search,
                                std::uint32_t& deferred);
    /// Of the distance at a point, from that at the middle, where it is known.
    double bound_at(const Group& group, const Cube& parent, int p) const;
    /// Triangles of a surface leaf in the group; none if it has none.
    std::span<const std::uint32_t> some_list(std::uint32_t number) const;
    /// The first of the groups that share a point has found its value.
    void copy_from_owners(std::uint32_t number, std::uint32_t deferred);
    /// Interpolates the hanging points; then passes on which values have changed: leaves are open again, groups
    /// below wait.
    void set_values(const std::vector<std::uint32_t>& groups);

    // Judging leaves: judgement.cpp.

    /// Leaves whose values are new. Those that miss the window are halved if they would even with the distances
    /// at their hanging corners; else the coarser leaves are beside the corner that is most wrong.
    void judge();
    Verdict first_verdict(const Leaf& leaf, Fit& fit) const;
    Verdict second_verdict(const Leaf& leaf, Fit& fit, std::int8_t& worst) const;
    /// Distances at the hanging corners of leaves that miss the window, each once.
    void evaluate_hanging(const std::vector<Verdict>& verdict);
    /// Halves the leaves because of which a point hangs.
    void split_around(std::uint32_t group, int point);

    const Task& task_;
    Parts parts_;
    GrowingTree tree_;
    Blocks<Leaf> leaves_;
    std::vector<std::vector<std::uint32_t>> pools_;  ///< lists of triangles
    std::vector<std::uint64_t> live_;                ///< of each pool: triangles that leaves still have
    std::uint32_t
        triangles_;  ///< of M; what follows them in lists are those of the surface that fills its holes
    distance::SearchTree search_;
    HangingDistances hanging_;
    std::atomic<bool> only_bits_ = true;

    std::uint32_t first_new_ = 0;                   ///< the first group of this pass
    std::vector<std::uint32_t> splits_;             ///< leaves to be halved next
    std::vector<std::uint32_t> open_, missing_;     ///< leaves to be judged, and those to be judged again
    std::vector<std::vector<std::uint32_t>> work_;  ///< by level: groups that wait
    std::vector<std::uint32_t> newly_;              ///< of the groups at work: points that have become free
    std::vector<std::uint32_t> deferred_;           ///< of these, points whose values other groups find
    std::uint64_t distances_ = 0;
    int passes_ = 0;
    bool complete_ = true;
};

}  // namespace its::adaptive
