#include "distance/group_search.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/platform/compiler.h"
#include "base/rounding.h"
#include "geometry/vec3.h"

namespace its::distance {

namespace {

using platform::Singles;

constexpr int packet = platform::single_lanes, quarter = packet / 4;
constexpr int arity = ClosestPointTree::arity;
constexpr int group_size = GroupSearch::group;
constexpr int capacity = 4096;         // leaves that a group may need
constexpr int leaves_per_point = 256;  // more cost as much as searches one by one
constexpr int most_kept = 512;         // leaves that may hold what is nearest to a point of a packet
constexpr int stack_size = 8 * 36 + 8;
constexpr std::uint64_t grain = 512;
constexpr float u = 0x1p-24F;
constexpr std::uint32_t leaf_bit = ClosestPointTree::leaf_bit;

using View = GroupSearch::View;
using Node = ClosestPointTree::Node;

ITS_INLINE float larger(float a, float b) {
    return a < b ? b : a;
}
ITS_INLINE float smaller(float a, float b) {
    return b < a ? b : a;
}

/// Points in units of the boxes; the last one fills up whole packets.
struct Points {
    alignas(64) float at[3][group_size];
    std::uint8_t number[group_size];  ///< place among the caller's
    int count;
    float error;  ///< what rounding of a point and of a triangle's place may change of their distance
};

/// A box around points, and a point of M that bounds the distance of each of them.
struct Target {
    float centre[3], half[3];
    float radius;   ///< half the box's diagonal
    float foot[3];  ///< near to what is nearest to the centre
    float squared;  ///< from centre to foot
    float limit;    ///< what has a greater least_excess() is not needed
    float error;

    ITS_INLINE void set_foot(const float (&to)[3]) {
        squared = 0;
        for (int i = 0; i < 3; ++i) {
            foot[i] = to[i];
            squared += (centre[i] - to[i]) * (centre[i] - to[i]);
        }
        const float distance = std::sqrt(squared), all = distance + 2 * radius + error;
        limit = (squared + 2 * error * (distance + radius) + error * error + 64 * u * all * all) * (1 + 8 * u);
    }
};

/// Of a box's side [low, high] and one of the target, the part of this axis in
/// min |q − t|² − |q − foot|² + |centre − foot|² over points q of the target and t of the box. It is the
/// minimum over t of (t − centre)² − 2·half·|t − foot|, and each sign of the last term has its own.
ITS_INLINE float least_excess(float low, float high, float centre, float half, float foot) {
    const float right = smaller(larger(centre + half, low), high);
    const float left = smaller(larger(centre - half, low), high);
    return smaller((right - centre) * (right - centre) - 2 * half * (right - foot),
                   (left - centre) * (left - centre) + 2 * half * (left - foot));
}

ITS_INLINE float gap(float low, float high, float q) {
    return larger(larger(low - q, q - high), 0.0F);
}

/// Of box i of several: least_excess() and the squared distance from the target's centre.
template <class Boxes>
ITS_INLINE float excess_of(const Boxes& b, int i, const Target& t) {
    return least_excess(b.min[0][i], b.max[0][i], t.centre[0], t.half[0], t.foot[0]) +
           least_excess(b.min[1][i], b.max[1][i], t.centre[1], t.half[1], t.foot[1]) +
           least_excess(b.min[2][i], b.max[2][i], t.centre[2], t.half[2], t.foot[2]);
}
template <class Boxes>
ITS_INLINE float squared_gap_of(const Boxes& b, int i, const Target& t) {
    const float x = gap(b.min[0][i], b.max[0][i], t.centre[0]), y = gap(b.min[1][i], b.max[1][i], t.centre[1]),
                z = gap(b.min[2][i], b.max[2][i], t.centre[2]);
    return x * x + y * y + z * z;
}

ITS_INLINE Points rounded(const View& view, const Vec3* points, int count) {
    const ClosestPointTree::Frame& frame = view.tree.frame;
    Points p;
    p.count = count;
    float reach = 0;
    for (int i = 0; i < group_size; ++i) {
        const Vec3& v = points[i < count ? i : count - 1];
        p.at[0][i] = float((v.x - frame.centre.x) * frame.inverse_scale);
        p.at[1][i] = float((v.y - frame.centre.y) * frame.inverse_scale);
        p.at[2][i] = float((v.z - frame.centre.z) * frame.inverse_scale);
        p.number[i] = std::uint8_t(i < count ? i : count - 1);
    }
    for (const auto& axis : p.at)
        for (int i = 0; i < group_size; ++i) reach = larger(reach, larger(axis[i], -axis[i]));
    const double exact = 256 * unit_roundoff * (frame.size * frame.inverse_scale + double(reach));
    p.error = 4 * u * (reach + 4) + float(std::min(exact, 1e30));
    return p;
}

/// Some of the points, at most a packet of them.
ITS_INLINE Points part_of(const Points& p, int begin, int count) {
    Points part;
    part.count = count;
    part.error = p.error;
    for (int i = 0; i < packet; ++i) {
        const int from = begin + std::min(i, count - 1);
        for (int axis = 0; axis < 3; ++axis) part.at[axis][i] = p.at[axis][from];
        part.number[i] = p.number[from];
    }
    return part;
}

ITS_INLINE Target around(const Points& p, int begin, int end, const float (&foot)[3]) {
    Target t;
    float squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
        float low = p.at[axis][begin], high = low;
        for (int i = begin; i < end; ++i) {
            low = smaller(low, p.at[axis][i]);
            high = larger(high, p.at[axis][i]);
        }
        t.centre[axis] = 0.5F * (low + high);
        t.half[axis] = larger(high - t.centre[axis], t.centre[axis] - low) * (1 + 2 * u);
        squared += t.half[axis] * t.half[axis];
    }
    t.radius = std::sqrt(squared) * (1 + 4 * u);
    t.error = p.error;
    t.set_foot(foot);
    return t;
}

/// Takes the nearest point of a leaf's triangles to the target's centre, if it is nearer than the foot.
ITS_INLINE void improve_foot(const View& view, std::uint32_t leaf, Target& t) {
    const TriangleBlock& b = view.tree.blocks[leaf];
    const ClosestPointTree::Frame& frame = view.tree.frame;
    const Vec3 centre = frame.centre + (1 / frame.inverse_scale) * Vec3{t.centre[0], t.centre[1], t.centre[2]};
    double squared[arity];
    for (int i = 0; i < arity; ++i)
        squared[i] = squared_distance(b, std::uint64_t(i), centre.x, centre.y, centre.z);
    int i = 0;
    for (int k = 1; k < arity; ++k) i = squared[k] < squared[i] ? k : i;
    if (!(squared[i] * frame.inverse_scale * frame.inverse_scale < double(t.squared))) return;
    const std::array<double, 3> weight = barycentric_of_nearest(b, std::uint64_t(i), centre);
    const double to_b = weight[(b.first[i] + 1U) % 3] * b.ab[i], to_c = weight[(b.first[i] + 2U) % 3] * b.ac[i];
    const double along = to_b + to_c * b.unit_ac[0][i], across = to_c * b.unit_ac[1][i];
    float foot[3];
    for (int axis = 0; axis < 3; ++axis)
        foot[axis] =
            float((b.a[axis][i] + along * b.along[axis][i] + across * b.across[axis][i] - frame.centre[axis]) *
                  frame.inverse_scale);
    t.set_foot(foot);
}

/// Goes down to the nearest child, and takes a foot in the leaf where that ends.
ITS_INLINE void find_foot(const View& view, Target& t) {
    std::uint32_t next = 0;
    do {
        const Node& node = view.tree.nodes[next];
        float squared[arity];
        for (int i = 0; i < arity; ++i) squared[i] = squared_gap_of(node, i, t);
        int nearest = 0;
        for (int i = 1; i < arity; ++i) nearest = squared[i] < squared[nearest] ? i : nearest;
        next = node.child[nearest];
    } while (!(next & leaf_bit));
    improve_foot(view, next & ~leaf_bit, t);
}

/// Takes a better foot from the leaves of a node that are near enough to have one.
ITS_INLINE void improve_foot_by(const View& view, const Node& node, const float (&gaps)[arity], Target& t) {
    for (int i = 0; i < arity; ++i) {
        if (!(bool(node.child[i] & leaf_bit) & (gaps[i] < t.squared))) continue;
        const std::uint32_t leaf = node.child[i] & ~leaf_bit;
        if (squared_gap(view.boxes[leaf], t.centre) < t.squared) improve_foot(view, leaf, t);
    }
}

/// Leaves and their boxes.
struct Leaves {
    alignas(64) float min[3][capacity], max[3][capacity];
    std::uint32_t leaf[capacity];
    int count = 0;

    ITS_INLINE void add(const Node& node, std::uint32_t lane) {
        for (int axis = 0; axis < 3; ++axis) {
            min[axis][count] = node.min[axis][lane];
            max[axis][count] = node.max[axis][lane];
        }
        leaf[count++] = node.child[lane] & ~leaf_bit;
    }
};

/// All leaves that the target needs, which has so many points. \return false if there are too many
ITS_INLINE bool collect(const View& view, Target& t, int points, Leaves& leaves) {
    const int most = std::min(capacity, leaves_per_point * points);
    find_foot(view, t);
    std::uint32_t stack[stack_size], places[capacity + arity];  // places: 8·node + lane
    int size = 1, count = 0;
    stack[0] = 0;
    while (size > 0) {
        const std::uint32_t index = stack[--size];
        const Node& node = view.tree.nodes[index];
        float gaps[arity], excess[arity];
        for (int i = 0; i < arity; ++i) gaps[i] = squared_gap_of(node, i, t);
        improve_foot_by(view, node, gaps, t);
        for (int i = 0; i < arity; ++i) excess[i] = excess_of(node, i, t);
        int nearest = size;  // of the children that go on the stack: it comes last
        float least = std::numeric_limits<float>::infinity();
        for (int i = 0; i < arity; ++i) {
            const bool needed = excess[i] <= t.limit, is_leaf = (node.child[i] & leaf_bit) != 0;
            stack[size] = node.child[i];
            const bool nearer = needed & !is_leaf & (gaps[i] < least);
            nearest = nearer ? size : nearest;
            least = nearer ? gaps[i] : least;
            size += int(needed & !is_leaf);
            places[count] = arity * index + std::uint32_t(i);
            count += int(needed & is_leaf);
        }
        if (count > most) return false;
        if (size > 0 && nearest < size) std::swap(stack[nearest], stack[size - 1]);
    }
    leaves.count = 0;
    for (int i = 0; i < count; ++i) leaves.add(view.tree.nodes[places[i] / arity], places[i] % arity);
    return true;
}

constexpr std::uint32_t index_bits = capacity - 1, tried = ~std::uint32_t{0};

/// Those of the leaves that the target needs, after a few tries to find a better foot.
ITS_INLINE int select(const View& view, const Leaves& leaves, Target& t, std::uint32_t* selected) {
    // Squared distances, rounded down, and numbers: of floats that are not negative the bits have their order.
    alignas(64) std::uint32_t key[capacity];
    for (int i = 0; i < leaves.count; ++i)
        key[i] = (std::bit_cast<std::uint32_t>(squared_gap_of(leaves, i, t)) & ~index_bits) | std::uint32_t(i);
    for (int tries = 0; tries < 2; ++tries) {
        std::uint32_t nearest = tried;
        for (int i = 0; i < leaves.count; ++i) nearest = key[i] < nearest ? key[i] : nearest;
        if (!(std::bit_cast<float>(nearest & ~index_bits) < t.squared)) break;
        const std::uint32_t leaf = leaves.leaf[nearest & index_bits];
        if (squared_gap(view.boxes[leaf], t.centre) < t.squared) improve_foot(view, leaf, t);
        key[nearest & index_bits] = tried;
    }
    alignas(64) float excess[capacity];
    for (int i = 0; i < leaves.count; ++i) excess[i] = excess_of(leaves, i, t);
    // First those that may be nearer to the centre than the foot.
    const std::uint32_t near = std::bit_cast<std::uint32_t>(t.squared);
    std::uint32_t others[capacity + 1];
    int count = 0, count_others = 0;
    for (int i = 0; i < leaves.count; ++i) {
        const bool needed = excess[i] <= t.limit, is_near = (key[i] <= near) | (key[i] == tried);
        selected[count] = others[count_others] = leaves.leaf[i];
        count += int(needed & is_near);
        count_others += int(needed & !is_near);
    }
    std::copy(others, others + count_others, selected + count);
    return count + count_others;
}

/// The nearest of some triangles, in each of some lanes. Numbers are doubles, so that all of a lane has one
/// size and loops over lanes become vector code.
struct alignas(64) NearestLanes {
    double squared[arity], triangle[arity], slot[arity];

    ITS_INLINE void clear() {
        for (int i = 0; i < arity; ++i) {
            squared[i] = std::numeric_limits<double>::infinity();
            triangle[i] = slot[i] = 0;
        }
    }
    /// The nearer one, of equally near ones the lower one.
    ITS_INLINE void take(int lane, double new_squared, double new_triangle, double new_slot) {
        const bool better =
            (new_squared < squared[lane]) | ((new_squared == squared[lane]) & (new_triangle < triangle[lane]));
        squared[lane] = better ? new_squared : squared[lane];
        triangle[lane] = better ? new_triangle : triangle[lane];
        slot[lane] = better ? new_slot : slot[lane];
    }
    /// The triangles of a leaf, by the distances of ClosestPointTree::find().
    ITS_INLINE void take(const View& view, std::uint32_t leaf, const Vec3& p) {
        const TriangleBlock& block = view.tree.blocks[leaf];
        const std::size_t first = std::size_t{arity} * leaf;
        const std::uint32_t* source = &view.tree.source[first];
        for (int i = 0; i < arity; ++i)
            take(i, squared_distance(block, std::uint64_t(i), p.x, p.y, p.z), double(std::int32_t(source[i])),
                 double(first) + double(i));
    }
    ITS_INLINE Nearest nearest() {
        for (int width = arity / 2; width > 0; width /= 2)
            for (int i = 0; i < width; ++i) take(i, squared[i + width], triangle[i + width], slot[i + width]);
        return {std::uint32_t(triangle[0]), std::uint32_t(slot[0]), squared[0]};
    }
};

/// Leaves that may hold what is nearest to some point of a packet.
struct Kept {
    Singles squared[most_kept];  ///< from the 16 points
    std::uint32_t leaf[most_kept];
    int count = 0;
};

/// Answers for the points of a packet by the leaves that are within their limits.
ITS_INLINE void solve_exactly(const View& view, const Kept& kept, const Singles& limit, const Points& p,
                              int begin, const Vec3* points, Nearest* results) {
    NearestLanes nearest[packet];
    for (NearestLanes& n : nearest) n.clear();
    for (int k = 0; k < kept.count; ++k) {
        for (std::uint32_t near = platform::lanes_at_most(kept.squared[k], limit); near != 0;
             near &= near - 1) {
            const int i = std::countr_zero(near);
            nearest[i].take(view, kept.leaf[k], points[p.number[begin + i]]);
        }
    }
    for (int i = 0; i < packet; ++i) results[p.number[begin + i]] = nearest[i].nearest();
}

ITS_INLINE void prefetch(const TriangleBlock& block) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&block);
    for (std::size_t line = 0; line < sizeof block; line += 64) ITS_PREFETCH_TO_READ(bytes + line);
}

/// A packet of a group, which needs these leaves alone. \return false if too many remain
ITS_INLINE bool solve(const View& view, const Points& p, int begin, Target& t, const Leaves& leaves,
                      const Vec3* points, Nearest* results) {
    std::uint32_t selected[capacity + 1];
    const int count = select(view, leaves, t, selected);
    const SinglePoints q{platform::load<Singles>(&p.at[0][begin]), platform::load<Singles>(&p.at[1][begin]),
                         platform::load<Singles>(&p.at[2][begin])};
    const float factor = 1 + 80 * u, slack = 80 * u * view.longest_edge + 2 * p.error;
    const Singles x = q.x - t.foot[0], y = q.y - t.foot[1], z = q.z - t.foot[2];
    Singles best = x * x + y * y + z * z;
    Singles limit = platform::square_root(best) * factor + slack;
    limit = limit * limit;
    Kept kept;
    for (int k = 0; k < count; ++k) {
        const LeafBox& box = view.boxes[selected[k]];
        if (platform::lanes_at_most(squared_gaps(box, q), limit) == 0) continue;
        const SingleTriangle* triangle = view.triangles + std::size_t{arity} * selected[k];
        Singles squared = squared_distances(triangle[0], q);
        for (std::uint32_t i = 1; i < box.triangles; ++i)
            squared = platform::smaller(squared, squared_distances(triangle[i], q));
        if (platform::lanes_at_most(squared, limit) == 0) continue;
        if (kept.count == most_kept) return false;
        prefetch(view.tree.blocks[selected[k]]);
        kept.leaf[kept.count] = selected[k];
        kept.squared[kept.count++] = squared;
        best = platform::smaller(best, squared);
        limit = platform::square_root(best) * factor + slack;
        limit = limit * limit;
    }
    solve_exactly(view, kept, limit, p, begin, points, results);
    return true;
}

/// Answers for the points of a group by the leaves that the group needs or, if those are too many, that each
/// packet or each of its quarters needs. Points whose quarter needs too many by itself are left over.
/// \return the number of those, whose places are in `left`
ITS_CLONES int find_group(const View& view, const Vec3* points, int count, Nearest* results,
                          std::uint8_t* left) {
    const Points p = rounded(view, points, count);
    Target all = around(p, 0, count, view.triangles[0].a);
    Leaves leaves;
    const bool together = collect(view, all, count, leaves);
    int count_left = 0;
    for (int begin = 0; begin < count; begin += packet) {
        Target t = around(p, begin, begin + packet, all.foot);
        if ((together || collect(view, t, packet, leaves)) && solve(view, p, begin, t, leaves, points, results))
            continue;
        for (int first = begin; first < std::min(begin + packet, count); first += quarter) {
            const Points few = part_of(p, first, std::min(quarter, count - first));
            Target t4 = around(few, 0, packet, t.foot);
            if (collect(view, t4, quarter, leaves) && solve(view, few, 0, t4, leaves, points, results))
                continue;
            for (int i = 0; i < few.count; ++i) left[count_left++] = few.number[i];
        }
    }
    return count_left;
}

}  // namespace

GroupSearch::GroupSearch(const ClosestPointTree& tree)
    : searched_(&tree), tree_(tree.view()), triangles_(tree_.source.size()), boxes_(tree_.blocks.size()) {
    parallel_for(boxes_.size(), grain, [&](std::uint64_t leaf) {
        const std::span<const std::uint32_t> source = tree_.source.subspan(arity * leaf, arity);
        int count = arity;  // the last triangle fills up the block
        while (count > 1 && source[std::size_t(count) - 1] == source[std::size_t(count) - 2]) --count;
        boxes_[leaf] = leaf_box(tree_.blocks[leaf], count, tree_.frame);
        for (int i = 0; i < arity; ++i)
            triangles_[arity * leaf + std::uint64_t(i)] = single_triangle(tree_.blocks[leaf], i, tree_.frame);
    });
    for (const SingleTriangle& t : triangles_) longest_edge_ = std::max(longest_edge_, t.ab);
}

void GroupSearch::find(std::span<const Vec3> points, std::span<Nearest> results) const {
    const View view{tree_, triangles_.data(), boxes_.data(), longest_edge_};
    for (std::size_t begin = 0; begin < points.size(); begin += group) {
        const std::size_t end = std::min<std::size_t>(begin + group, points.size());
        std::uint8_t left[group];
        const int count = find_group(view, &points[begin], int(end - begin), &results[begin], left);
        for (int i = 0; i < count; ++i) results[begin + left[i]] = searched_->find(points[begin + left[i]]);
    }
}

std::uint64_t GroupSearch::memory_bytes() const {
    return sizeof(SingleTriangle) * triangles_.size() + sizeof(LeafBox) * boxes_.size();
}

}  // namespace its::distance
