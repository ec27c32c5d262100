#include "adaptive/refine.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "adaptive/fit.h"
#include "adaptive/growing_tree.h"
#include "adaptive/windings.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "distance/point_distances.h"
#include "geometry/vec3.h"
#include "octree/voxelise.h"

namespace its::adaptive {

namespace {

using octree::group_point;
using octree::group_points;

constexpr std::uint64_t group_grain = 64, leaf_grain = 64, copy_grain = 512;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Distances at hanging points, by lattice point. They are no values of f, but tell why it misses the window.
class HangingDistances {
public:
    static constexpr std::uint64_t no_key = ~std::uint64_t{0};
    const double* find(std::uint64_t key) const {
        if (keys_.empty()) return nullptr;
        for (std::uint64_t at = place(key);; at = (at + 1) & mask()) {
            if (keys_[at] == no_key) return nullptr;
            if (keys_[at] == key) return &distance_[at];
        }
    }
    void insert(std::uint64_t key, double distance) {
        if (2 * (size_ + 1) > keys_.size()) grow();
        std::uint64_t at = place(key);
        while (keys_[at] != no_key) at = (at + 1) & mask();
        keys_[at] = key;
        distance_[at] = distance;
        ++size_;
    }
    std::uint64_t bytes() const { return keys_.size() * 16; }

private:
    std::uint64_t mask() const { return keys_.size() - 1; }
    std::uint64_t place(std::uint64_t key) const {  // Fibonacci hashing
        return (key * 0x9e3779b97f4a7c15) >> 20 & mask();
    }
    void grow() {
        std::vector<std::uint64_t> keys(std::max<std::size_t>(64, 2 * keys_.size()), no_key);
        std::vector<double> distance(keys.size());
        keys.swap(keys_);
        distance.swap(distance_);
        size_ = 0;
        for (std::size_t i = 0; i < keys.size(); ++i)
            if (keys[i] != no_key) insert(keys[i], distance[i]);
    }
    std::vector<std::uint64_t> keys_;
    std::vector<double> distance_;
    std::uint64_t size_ = 0;
};

/// What a leaf's test says.
enum class Verdict : std::uint8_t {
    fits,
    halve,   ///< whatever its neighbours do
    misses,  ///< the window, with hanging corners
    coarse,  ///< misses it because of a coarser leaf beside it
};

class Refiner {
public:
    Refiner(const Task& task, const Progress& progress)
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

    Refined run() {
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

private:
    // Cells --------------------------------------------------------------------------------------------------

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

    bool affordable() const {
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
    // A group's values twice, when they are put in order, or once with its links; its leaves, four at most as a
    // rule, with their bounds.
    static constexpr std::uint64_t bytes_per_group = 2 * sizeof(Group) + 4 * (sizeof(Leaf) + 32);

    void halve_leaves() {
        std::sort(splits_.begin(), splits_.end(), [&](std::uint32_t a, std::uint32_t b) {
            const Leaf &p = leaves_[a], &q = leaves_[b];
            return std::pair(-level_of(p), code_of(p)) < std::pair(-level_of(q), code_of(q));
        });
        first_new_ = tree_.size();
        for (auto begin = splits_.begin(); begin != splits_.end();) {
            const int level = level_of(leaves_[*begin]);
            const auto end = std::find_if(begin, splits_.end(),
                                          [&](std::uint32_t i) { return level_of(leaves_[i]) != level; });
            halve_level({begin, end}, level - 1);
            begin = end;
        }
        splits_.clear();
        drop_lists();
    }

    /// Halves leaves of one level, in Morton order.
    void halve_level(std::span<const std::uint32_t> leaves, int level) {
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

    /// The cells that meet M, and those in which inside and outside meet in a hole, in groups from `begin` on;
    /// with the triangles of both M and F.
    octree::Voxels with_holes(octree::Voxels below, std::uint32_t begin, int level) const {
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

    void link_above(std::uint32_t leaf, std::uint32_t group) {
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

    /// All but what is around, and the leaves. The list of the cell is number i of `above`.
    void set_group(std::uint32_t number, int level, const Leaf& old, const octree::Voxels& above,
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
            std::span(above.triangle).subspan(above.offset[i], above.offset[i + 1] - above.offset[i]),
            old.winding);
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

    std::int32_t number_by_rule(std::int32_t winding) const {
        return task_.rule == SignRule::even_odd ? winding & 1 : winding;
    }

    void set_leaves(std::uint32_t number, const octree::Voxels& below, std::uint32_t first) {
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

    /// Frees lists that no leaf has any more: whole pools, and where most is gone, what is left moves into one.
    void drop_lists() {
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

    // Values -------------------------------------------------------------------------------------------------

    void queue(std::uint32_t group) {
        if (std::exchange(tree_[group].waiting, true)) return;
        work_[std::size_t(tree_[group].level)].push_back(group);
    }

    /// Groups in which points may have become free: the new ones and those around, on all finer levels too.
    void gather_affected() {
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

    /// Groups whose points are all free have nothing to become.
    void gather_towards(std::uint32_t group, int direction, std::vector<std::uint32_t>& found) const {
        if (tree_[group].free != all_points) found.push_back(group);
        for (unsigned left = tree_[group].subdivided & children_towards[std::size_t(direction)]; left != 0;
             left &= left - 1)
            gather_towards(tree_.links(group).child[std::size_t(std::countr_zero(left))], direction, found);
    }

    /// From coarse to fine.
    void update_values() {
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

    /// Which points have become free, and, for balance, which surface leaves touch some that are two levels
    /// finer or more.
    void find_free(const std::vector<std::uint32_t>& groups) {
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
    /// Of a distance to M, what is the value there: the sign of its side, and in holes at most the distance to
    /// where sides meet.
    double value_of(const Group& group, int p, double distance) const {
        if (task_.open != nullptr) {
            const octree::Cell at = octree::morton_decode(group.parent);
            const auto index = [&](std::size_t axis, int half) {
                return (2 * std::uint64_t{at[axis]} + std::uint64_t(half)) << group.level;
            };
            distance = std::min(distance,
                                task_.open->to_flip({index(0, p % 3), index(1, p / 3 % 3), index(2, p / 9)}));
        }
        return group.inside >> p & 1 ? 0.0 - distance : distance;  // +0 stays +0
    }

    /// Sets the values of points that have become free, but for those that another group is to find.
    void find_distances(const std::vector<std::uint32_t>& groups) {
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

    /// Values that groups around had before. \param wanted  points; those that are found are taken out
    /// \returns  of the others, those that a group around with a lower number finds
    std::uint32_t copy_known(std::uint32_t number, std::uint32_t& wanted) {
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

    /// \param deferred  receives the points whose values another group finds
    std::uint64_t find_in_group(std::uint32_t number, std::uint32_t newly, distance::PointDistances& search,
                                std::uint32_t& deferred) {
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

    static int corner_number(int point) {
        return (point % 3) / 2 + (point / 3 % 3) / 2 * 2 + (point / 9) / 2 * 4;
    }

    /// Of the distance at a point, from that at the middle, where it is known.
    double bound_at(const Group& group, const Cube& parent, int p) const {
        constexpr int middle = octree::itself;
        if (task_.open != nullptr || !(group.free >> middle & 1)) return infinity;  // values may be less
        return std::abs(group.value[middle]) + norm(point_in(parent, p) - point_in(parent, middle));
    }

    /// Triangles of a surface leaf in the group; none if it has none.
    std::span<const std::uint32_t> some_list(std::uint32_t number) const {
        const Group& group = tree_[number];
        if (group.surface == 0) return {};
        std::span<const std::uint32_t> most;
        for (unsigned left = group.surface; left != 0; left &= left - 1) {
            const auto list = triangles_of(leaves_[number_of({number, std::countr_zero(left)})]);
            if (list.size() > most.size()) most = list;
        }
        return most;
    }

    /// The first of the groups that share a point has found its value.
    void copy_from_owners(std::uint32_t number, std::uint32_t deferred) {
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

    void corner_values(const Group& group, int child, double (&value)[8]) const {
        for (int c = 0; c < 8; ++c) value[c] = group.value[std::size_t(group_point(child, c))];
    }

    /// Interpolates the hanging points; then passes on which values have changed: leaves are open again, groups
    /// below wait.
    void set_values(const std::vector<std::uint32_t>& groups) {
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

    // Judgement ----------------------------------------------------------------------------------------------

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

    /// Leaves whose values are new. Those that miss the window are halved if they would even with the distances
    /// at their hanging corners; else the coarser leaves are beside the corner that is most wrong.
    void judge() {
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
                if (verdict[i] == Verdict::misses)
                    verdict[i] = second_verdict(leaves_[open_[i]], fit, worst[i]);
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

    Verdict first_verdict(const Leaf& leaf, Fit& fit) const {
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

    Verdict second_verdict(const Leaf& leaf, Fit& fit, std::int8_t& worst) const {
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

    /// Distances at the hanging corners of leaves that miss the window, each once.
    void evaluate_hanging(const std::vector<Verdict>& verdict) {
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

    /// Halves the leaves because of which a point hangs.
    void split_around(std::uint32_t group, int point) {
        const Sharings& shared = sharings[std::size_t(point)];
        for (int i = 0; i < shared.count; ++i) {
            const int n = shared.with[std::size_t(i)].direction;
            if (tree_.links(group).around[std::size_t(n)] != none) continue;
            const Place leaf = tree_.leaf_around(group, n);
            if (tree_.is_surface(leaf)) splits_.push_back(number_of(leaf));
        }
    }

    // The result ---------------------------------------------------------------------------------------------

    Refined finish();
    std::vector<std::uint64_t> coarse_leaves(const std::vector<std::uint32_t>& leaves) const;
    void put_level(int level, const std::vector<std::uint32_t>& order, double scale, Refined& result);

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

}  // namespace

Refined refine(const Task& task, const Progress& progress) {
    return Refiner(task, progress).run();
}

}  // namespace its::adaptive
