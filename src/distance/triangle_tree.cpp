#include "distance/triangle_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/vec3.h"

namespace its::distance {

namespace {

constexpr std::uint64_t grain = 4096;

/// A triangle and its centroid.
struct Item {
    float at[3];
    std::uint32_t triangle;
};

/// Brings the items before `middle` to one side of a plane, across the longest side of the centroids' bounds.
void split(Item* begin, Item* middle, Item* end) {
    float low[3], high[3];
    for (int axis = 0; axis < 3; ++axis) low[axis] = high[axis] = begin->at[axis];
    for (const Item* item = begin; item != end; ++item)
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], item->at[axis]);
            high[axis] = std::max(high[axis], item->at[axis]);
        }
    int longest = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
    std::nth_element(begin, middle, end, [longest](const Item& a, const Item& b) {
        return a.at[longest] != b.at[longest] ? a.at[longest] < b.at[longest] : a.triangle < b.triangle;
    });
}

/// Triangles in the order of a k-d tree whose parts have 8ⁱ triangles, but for the last of each size.
std::vector<std::uint32_t> spatial_order(std::span<const Vec3> positions, std::span<const Triangle> triangles) {
    std::vector<Item> items(triangles.size());
    parallel_for(triangles.size(), grain, [&](std::uint64_t i) {
        const Triangle& t = triangles[i];
        const Vec3 centroid = (1.0 / 3) * (positions[t[0]] + positions[t[1]] + positions[t[2]]);
        for (int axis = 0; axis < 3; ++axis) items[i].at[axis] = float(centroid[axis]);
        items[i].triangle = std::uint32_t(i);
    });
    struct Range {
        std::uint64_t begin, end;
    };
    std::vector<Range> ranges{{0, items.size()}};
    while (!ranges.empty()) {
        std::vector<Range> halves(2 * ranges.size());
        parallel_for(ranges.size(), std::max<std::uint64_t>(ranges.size() / 64, 1), [&](std::uint64_t i) {
            const Range r = ranges[i];
            // The largest 8ⁱ below the size, times 4, 2 or 1: then every part of a node of the tree is aligned.
            const std::uint64_t half = std::bit_ceil(r.end - r.begin) / 2, middle = r.begin + half;
            if (r.end - r.begin <= TriangleTree::arity) return;
            split(&items[r.begin], &items[middle], items.data() + r.end);
            halves[2 * i] = {r.begin, middle};
            halves[2 * i + 1] = {middle, r.end};
        });
        std::erase_if(halves, [](const Range& r) { return r.end - r.begin <= TriangleTree::arity; });
        ranges = std::move(halves);
    }
    std::vector<std::uint32_t> order(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) order[i] = items[i].triangle;
    return order;
}

/// The corners of a block's triangles.
struct alignas(64) Corners {
    double x[3][TriangleTree::arity], y[3][TriangleTree::arity], z[3][TriangleTree::arity];

    void set(std::uint64_t lane, int corner, const Vec3& p) {
        x[corner][lane] = p.x;
        y[corner][lane] = p.y;
        z[corner][lane] = p.z;
    }
};

struct Disc {
    Vec3 centre, axis;
    double radius, thickness;
};

ITS_INLINE double larger(double a, double b) {
    return a < b ? b : a;
}
ITS_INLINE double smaller(double a, double b) {
    return b < a ? b : a;
}

/// Bounds and sum of the normals, weighted by area, of some blocks: the disc's centre and axis.
ITS_CLONES void place_disc(const Corners* blocks, std::uint64_t count, Disc& disc) {
    constexpr std::uint64_t lanes = TriangleTree::arity;
    double low[3][lanes], high[3][lanes], normal[3][lanes] = {};
    for (std::uint64_t i = 0; i < lanes; ++i) {
        low[0][i] = high[0][i] = blocks->x[0][i];
        low[1][i] = high[1][i] = blocks->y[0][i];
        low[2][i] = high[2][i] = blocks->z[0][i];
    }
    for (const Corners* b = blocks; b != blocks + count; ++b)
        for (std::uint64_t i = 0; i < lanes; ++i) {
            for (int corner = 0; corner < 3; ++corner) {
                low[0][i] = smaller(low[0][i], b->x[corner][i]);
                low[1][i] = smaller(low[1][i], b->y[corner][i]);
                low[2][i] = smaller(low[2][i], b->z[corner][i]);
                high[0][i] = larger(high[0][i], b->x[corner][i]);
                high[1][i] = larger(high[1][i], b->y[corner][i]);
                high[2][i] = larger(high[2][i], b->z[corner][i]);
            }
            const double ux = b->x[1][i] - b->x[0][i], uy = b->y[1][i] - b->y[0][i],
                         uz = b->z[1][i] - b->z[0][i];
            const double vx = b->x[2][i] - b->x[0][i], vy = b->y[2][i] - b->y[0][i],
                         vz = b->z[2][i] - b->z[0][i];
            normal[0][i] += uy * vz - uz * vy;
            normal[1][i] += uz * vx - ux * vz;
            normal[2][i] += ux * vy - uy * vx;
        }
    for (std::uint64_t i = 1; i < lanes; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            low[axis][0] = smaller(low[axis][0], low[axis][i]);
            high[axis][0] = larger(high[axis][0], high[axis][i]);
            normal[axis][0] += normal[axis][i];
        }
    for (int axis = 0; axis < 3; ++axis) {
        disc.centre[axis] = 0.5 * (low[axis][0] + high[axis][0]);
        disc.axis[axis] = normal[axis][0];
    }
    const double length = norm(disc.axis);
    disc.axis = length > 0 ? (1 / length) * disc.axis : Vec3{};
}

/// Radius and thickness for the disc's centre and axis.
ITS_CLONES void measure_disc(const Corners* blocks, std::uint64_t count, Disc& disc) {
    constexpr std::uint64_t lanes = TriangleTree::arity;
    double squared[lanes] = {}, above[lanes] = {};
    for (const Corners* b = blocks; b != blocks + count; ++b)
        for (int corner = 0; corner < 3; ++corner)
            for (std::uint64_t i = 0; i < lanes; ++i) {
                const double dx = b->x[corner][i] - disc.centre.x, dy = b->y[corner][i] - disc.centre.y,
                             dz = b->z[corner][i] - disc.centre.z;
                const double along = dx * disc.axis.x + dy * disc.axis.y + dz * disc.axis.z;
                const double all = (1 + disc_safety) * (dx * dx + dy * dy + dz * dz);
                squared[i] = larger(squared[i], all - along * along);
                above[i] = larger(above[i], along < 0 ? -along : along);
            }
    for (std::uint64_t i = 1; i < lanes; ++i) {
        squared[0] = larger(squared[0], squared[i]);
        above[0] = larger(above[0], above[i]);
    }
    disc.radius = std::sqrt(squared[0]);
    disc.thickness = above[0];
}

void set_node(TriangleTree::Nodes& nodes, std::uint64_t lane, const Disc& disc) {
    nodes.x[lane] = disc.centre.x;
    nodes.y[lane] = disc.centre.y;
    nodes.z[lane] = disc.centre.z;
    nodes.axis_x[lane] = disc.axis.x;
    nodes.axis_y[lane] = disc.axis.y;
    nodes.axis_z[lane] = disc.axis.z;
    nodes.radius[lane] = disc.radius;
    nodes.thickness[lane] = disc.thickness;
}

/// A disc that nothing is near to: its distance, squared, is finite still.
constexpr Disc nowhere{{1e100, 1e100, 1e100}, {}, 0, 0};

/// The nodes of a level over `span` blocks each.
std::vector<TriangleTree::Nodes> make_nodes(const std::vector<Corners>& corners, std::uint64_t span,
                                            double widening) {
    const std::uint64_t blocks = corners.size(), count = (blocks + span - 1) / span;
    std::vector<TriangleTree::Nodes> nodes((count + TriangleTree::arity - 1) / TriangleTree::arity);
    parallel_for(nodes.size() * TriangleTree::arity, std::max<std::uint64_t>(grain / (8 * span), 1),
                 [&](std::uint64_t node) {
                     Disc disc = nowhere;
                     if (node < count) {
                         const std::uint64_t begin = node * span, size = std::min(span, blocks - begin);
                         place_disc(&corners[begin], size, disc);
                         measure_disc(&corners[begin], size, disc);
                         disc.radius += widening;
                         disc.thickness += widening;
                     }
                     set_node(nodes[node / TriangleTree::arity], node % TriangleTree::arity, disc);
                 });
    return nodes;
}

}  // namespace

TriangleTree make_triangle_tree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                double size) {
    TriangleTree tree;
    tree.source = spatial_order(positions, triangles);
    const std::uint64_t count = triangles.size();
    tree.block.resize((count + TriangleTree::arity - 1) / TriangleTree::arity);
    std::vector<Corners> corners(tree.block.size());
    parallel_for(tree.block.size(), grain / TriangleTree::arity, [&](std::uint64_t block) {
        std::array<std::array<Vec3, 3>, TriangleBlock::lanes> lanes;
        for (std::uint64_t lane = 0; lane < TriangleTree::arity; ++lane) {
            const std::uint64_t place = std::min(block * TriangleTree::arity + lane, count - 1);
            const Triangle& t = triangles[tree.source[place]];
            lanes[lane] = {positions[t[0]], positions[t[1]], positions[t[2]]};
            for (int corner = 0; corner < 3; ++corner) corners[block].set(lane, corner, lanes[lane][corner]);
        }
        tree.block[block] = make_block(lanes);
    });
    const double widening = TriangleTree::widening * unit_roundoff * size;
    for (std::uint64_t span = 1;; span *= TriangleTree::arity) {
        tree.levels.push_back(make_nodes(corners, span, widening));
        if (tree.levels.back().size() == 1) return tree;
    }
}

}  // namespace its::distance
