#include "distance/closest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/platform/compiler.h"
#include "base/rounding.h"
#include "geometry/box.h"
#include "geometry/vec3.h"

namespace its::distance {

namespace {

constexpr int arity = ClosestPointTree::arity;
constexpr float far_away = std::numeric_limits<float>::max();
constexpr int bins = 16;
constexpr int median_from_depth = 24;  // below, ranges are halved: no tree is deeper than 24 + 11 levels
constexpr int max_depth_of_tree = median_from_depth + 12;
constexpr std::uint64_t grain = 4096;

/// Slack on distances, in units of u·size: twice the error of a triangle's computed distance, 32u·√3·size
/// (docs/design/distance.md), and the roundings of the comparison (fewer than 16).
constexpr double distance_slack = 128;

/// Of the surface of a box; 0 if it is empty.
double half_area(const Box& box) {
    const Vec3 d = box.max - box.min;
    return d.x < 0 ? 0 : d.x * d.y + d.y * d.z + d.z * d.x;
}

/// A range of the triangles' order, with its box.
struct Range {
    std::uint32_t begin = 0, end = 0;
    Box box = geometry::empty_box;
    std::uint32_t size() const { return end - begin; }
};

/// Splits ranges of triangles by the surface area heuristic over bins of their boxes' centres.
class Splitter {
public:
    Splitter(std::span<const Vec3> vertices, std::span<const Triangle> triangles)
        : box_(triangles.size(), geometry::empty_box), order_(triangles.size()) {
        parallel_for(triangles.size(), grain, [&](std::uint64_t i) {
            for (const std::uint32_t v : triangles[i]) geometry::extend(box_[i], vertices[v]);
            order_[i] = std::uint32_t(i);
        });
    }

    Range all() const { return range(0, std::uint32_t(order_.size())); }
    std::uint32_t triangle(std::uint32_t place) const { return order_[place]; }

    /// Two parts of a range of more than `arity` triangles, neither empty.
    std::pair<Range, Range> split(const Range& r, int depth) {
        const Box centres = centre_bounds(r);
        int axis = 0;
        const Vec3 extent = centres.max - centres.min;
        for (int a = 1; a < 3; ++a)
            if (extent[a] > extent[axis]) axis = a;
        std::uint32_t middle = r.begin;
        if (extent[axis] > 0 && depth < median_from_depth) middle = partition(r, centres, axis);
        if (middle == r.begin || middle == r.end) middle = halve(r, axis);
        return {range(r.begin, middle), range(middle, r.end)};
    }

private:
    Range range(std::uint32_t begin, std::uint32_t end) const {
        Range r{begin, end, geometry::empty_box};
        for (std::uint32_t i = begin; i < end; ++i) geometry::extend(r.box, box_[order_[i]]);
        return r;
    }

    double centre(std::uint32_t triangle, int axis) const {
        return 0.5 * (box_[triangle].min[axis] + box_[triangle].max[axis]);
    }

    Box centre_bounds(const Range& r) const {
        Box b = geometry::empty_box;
        for (std::uint32_t i = r.begin; i < r.end; ++i)
            geometry::extend(b, Vec3{centre(order_[i], 0), centre(order_[i], 1), centre(order_[i], 2)});
        return b;
    }

    /// Cheapest of the planes between bins. Costs count blocks of triangles, since a leaf costs the same full
    /// or not.
    std::uint32_t partition(const Range& r, const Box& centres, int axis) {
        const double from = centres.min[axis], per_unit = bins / (centres.max[axis] - from);
        const auto bin_of = [&](std::uint32_t t) {
            return std::clamp(int((centre(t, axis) - from) * per_unit), 0, bins - 1);
        };
        std::array<Box, bins> box;
        box.fill(geometry::empty_box);
        std::array<std::uint32_t, bins> count{};
        for (std::uint32_t i = r.begin; i < r.end; ++i) {
            const int b = bin_of(order_[i]);
            geometry::extend(box[b], box_[order_[i]]);
            ++count[b];
        }
        const auto cost = [](const Box& b, std::uint32_t n) {
            const std::uint32_t blocks = (n + arity - 1) / arity;
            return half_area(b) * blocks;
        };
        std::array<double, bins> right{};
        Box sweep = geometry::empty_box;
        std::uint32_t n = 0;
        for (int b = bins - 1; b > 0; --b) {
            geometry::extend(sweep, box[b]);
            right[b] = cost(sweep, n += count[b]);
        }
        sweep = geometry::empty_box;
        n = 0;
        int best = 1;
        double least = std::numeric_limits<double>::infinity();
        for (int b = 1; b < bins; ++b) {
            geometry::extend(sweep, box[b - 1]);
            n += count[b - 1];
            const double total = cost(sweep, n) + right[b];
            if (n > 0 && n < r.size() && total < least) {
                least = total;
                best = b;
            }
        }
        const auto middle = std::stable_partition(order_.begin() + r.begin, order_.begin() + r.end,
                                                  [&](std::uint32_t t) { return bin_of(t) < best; });
        return std::uint32_t(middle - order_.begin());
    }

    std::uint32_t halve(const Range& r, int axis) {
        const std::uint32_t middle = r.begin + r.size() / 2;
        std::nth_element(order_.begin() + r.begin, order_.begin() + middle, order_.begin() + r.end,
                         [&](std::uint32_t a, std::uint32_t b) {
                             const double x = centre(a, axis), y = centre(b, axis);
                             return x != y ? x < y : a < b;
                         });
        return middle;
    }

    std::vector<Box> box_;
    std::vector<std::uint32_t> order_;
};

/// The children of a node: the range split until there are eight parts, the largest box first.
struct Children {
    std::array<Range, arity> range;
    int count = 1;
};

Children split_into_children(Splitter& splitter, const Range& range, int depth) {
    Children children;
    children.range[0] = range;
    while (children.count < arity) {
        int largest = -1;
        for (int i = 0; i < children.count; ++i)
            if (children.range[i].size() > arity &&
                (largest < 0 || half_area(children.range[i].box) > half_area(children.range[largest].box)))
                largest = i;
        if (largest < 0) break;
        const auto [left, right] = splitter.split(children.range[largest], depth);
        children.range[largest] = left;
        children.range[children.count++] = right;
    }
    return children;
}

float rounded_outward(double x, float towards) {
    const float f = float(x);
    return std::nextafter(f, towards);
}

/// Boxes of the children relative to the frame. Two roundings of numbers up to the frame's size come before the
/// outward one: the margin covers them.
void set_boxes(ClosestPointTree::Node& node, const Children& children, const ClosestPointTree::Frame& frame) {
    const double margin = 4 * unit_roundoff * frame.size;
    for (int i = 0; i < arity; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            node.min[axis][i] = far_away;
            node.max[axis][i] = -far_away;
            if (i >= children.count) continue;
            const Box& b = children.range[i].box;
            node.min[axis][i] =
                rounded_outward((b.min[axis] - frame.centre[axis] - margin) * frame.inverse_scale, -far_away);
            node.max[axis][i] =
                rounded_outward((b.max[axis] - frame.centre[axis] + margin) * frame.inverse_scale, far_away);
        }
}

struct View {
    const ClosestPointTree::Node* nodes;
    const TriangleBlock* blocks;
    const std::uint32_t* source;
    ClosestPointTree::Frame frame;
};

/// A subtree to visit, with a lower bound on the squared distance to it, in the boxes' units.
struct Entry {
    double squared;
    std::uint32_t child;
};

/// Depth first, nearest child first.
ITS_CLONES void find_nearest(const View& tree, const Vec3& p, double bound, Nearest& result) {
    const double s = tree.frame.inverse_scale;
    const double reach = std::max({std::abs(p.x - tree.frame.centre.x), std::abs(p.y - tree.frame.centre.y),
                                   std::abs(p.z - tree.frame.centre.z)});
    const double slack = distance_slack * unit_roundoff * (tree.frame.size + reach);
    const double qx = (p.x - tree.frame.centre.x) * s, qy = (p.y - tree.frame.centre.y) * s,
                 qz = (p.z - tree.frame.centre.z) * s;
    // A subtree is left out only if it is farther than this, squared.
    const auto limit_for = [&](double squared) {
        const double d = (std::sqrt(squared) + slack) * s;
        return d * d * (1 + 8 * unit_roundoff);
    };
    double best = bound * bound;
    double limit = limit_for(best);
    result.squared = std::numeric_limits<double>::infinity();

    Entry stack[max_depth_of_tree * arity];
    int size = 0;
    stack[size++] = {0.0, 0};
    while (size > 0) {
        const Entry entry = stack[--size];
        if (entry.squared > limit) continue;
        if (entry.child & ClosestPointTree::leaf_bit) {
            const std::uint32_t block = entry.child & ~ClosestPointTree::leaf_bit;
            double squared[arity];
            for (int i = 0; i < arity; ++i)
                squared[i] = squared_distance(tree.blocks[block], std::uint64_t(i), p.x, p.y, p.z);
            for (int i = 0; i < arity; ++i) {
                if (squared[i] > best) continue;
                const std::uint32_t slot = arity * block + std::uint32_t(i);
                const std::uint32_t triangle = tree.source[slot];
                if (squared[i] == result.squared && triangle >= result.triangle) continue;
                result = {triangle, slot, squared[i]};
                best = squared[i];
                limit = limit_for(best);
            }
            continue;
        }
        const ClosestPointTree::Node& node = tree.nodes[entry.child];
        double squared[arity];
        for (int i = 0; i < arity; ++i) {
            const auto gap = [](double low, double high, double q) {
                const double below = low - q, above = q - high;
                const double larger = below > above ? below : above;
                return larger > 0 ? larger : 0.0;
            };
            const double x = gap(node.min[0][i], node.max[0][i], qx);
            const double y = gap(node.min[1][i], node.max[1][i], qy);
            const double z = gap(node.min[2][i], node.max[2][i], qz);
            squared[i] = x * x + y * y + z * z;
        }
        const int first = size;
        for (int i = 0; i < arity; ++i) {
            if (squared[i] > limit) continue;
            int place = size++;
            for (; place > first && stack[place - 1].squared < squared[i]; --place)
                stack[place] = stack[place - 1];
            stack[place] = {squared[i], node.child[i]};
        }
    }
}

}  // namespace

ClosestPointTree::ClosestPointTree(std::span<const Vec3> vertices, std::span<const Triangle> triangles)
    : source_() {
    Splitter splitter(vertices, triangles);
    const Range root = splitter.all();
    frame_.centre = 0.5 * (root.box.min + root.box.max);
    double half = 0;
    for (int axis = 0; axis < 3; ++axis) {
        half = std::max(half, root.box.max[axis] - frame_.centre[axis]);
        frame_.size = std::max({frame_.size, std::abs(root.box.min[axis]), std::abs(root.box.max[axis])});
    }
    if (half == 0) half = frame_.size;  // all of M is one point
    frame_.inverse_scale = half > 0 ? std::ldexp(1.0, -std::ilogb(half)) : 1.0;

    // Level by level: a level's nodes are independent, and their children are numbered in order.
    std::vector<Range> level{root};
    std::vector<Range> leaves;
    for (int depth = 0; !level.empty(); ++depth) {
        std::vector<Children> children(level.size());
        parallel_for(level.size(), 1,
                     [&](std::uint64_t i) { children[i] = split_into_children(splitter, level[i], depth); });
        std::vector<Range> next;
        const std::size_t first = nodes_.size();
        nodes_.resize(first + level.size());
        for (std::size_t i = 0; i < level.size(); ++i) {
            Node& node = nodes_[first + i];
            set_boxes(node, children[i], frame_);
            for (int c = 0; c < arity; ++c) {
                node.child[c] = leaf_bit;
                if (c >= children[i].count) continue;
                const Range& r = children[i].range[c];
                if (r.size() <= arity) {
                    node.child[c] = leaf_bit | std::uint32_t(leaves.size());
                    leaves.push_back(r);
                } else {
                    node.child[c] = std::uint32_t(first + level.size() + next.size());
                    next.push_back(r);
                }
            }
        }
        level = std::move(next);
    }

    blocks_.resize(leaves.size());
    source_.resize(arity * leaves.size());
    parallel_for(leaves.size(), grain / arity, [&](std::uint64_t i) {
        std::array<std::array<Vec3, 3>, TriangleBlock::lanes> lanes;
        for (std::uint32_t lane = 0; lane < std::uint32_t(arity); ++lane) {
            const std::uint32_t place = leaves[i].begin + std::min(lane, leaves[i].size() - 1);
            const std::uint32_t t = splitter.triangle(place);
            source_[arity * i + lane] = t;
            lanes[lane] = {vertices[triangles[t][0]], vertices[triangles[t][1]], vertices[triangles[t][2]]};
        }
        blocks_[i] = make_block(lanes);
    });
}

Nearest ClosestPointTree::find(const Vec3& p, double bound) const {
    Nearest result;
    find_nearest({nodes_.data(), blocks_.data(), source_.data(), frame_}, p, bound, result);
    return result;
}

std::array<double, 3> ClosestPointTree::barycentric(const Nearest& nearest, const Vec3& p) const {
    return barycentric_of_nearest(blocks_[nearest.slot / arity], nearest.slot % arity, p);
}

std::uint64_t ClosestPointTree::memory_bytes() const {
    return sizeof(Node) * nodes_.size() + sizeof(TriangleBlock) * blocks_.size() +
           sizeof(std::uint32_t) * source_.size();
}

}  // namespace its::distance
