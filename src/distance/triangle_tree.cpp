#include "distance/triangle_tree.h"

#include <oneapi/tbb/parallel_sort.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/vec3.h"
#include "octree/morton.h"

namespace its {

namespace {

constexpr std::uint64_t grain = 4096;

/// Triangle indices sorted by the Morton code of their centroids on a grid of 2²¹ cells a side.
std::vector<std::uint32_t> morton_order(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                        double size) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(triangles.size());
    const double cells = double(1 << 21);
    parallel_for(triangles.size(), grain, [&](std::uint64_t i) {
        const Triangle& t = triangles[i];
        const Vec3 sum = positions[t[0]] + positions[t[1]] + positions[t[2]];
        Cell cell;
        for (int axis = 0; axis < 3; ++axis)
            cell[axis] = std::uint32_t(std::clamp(sum[axis] / (3 * size) * cells, 0.0, cells - 1));
        keys[i] = {morton_encode(cell), std::uint32_t(i)};
    });
    oneapi::tbb::parallel_sort(keys.begin(), keys.end());
    std::vector<std::uint32_t> order(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) order[i] = keys[i].second;
    return order;
}

void resize_padded(TriangleTree::Spheres& s, std::uint64_t count) {
    const std::uint64_t padded = (count + TriangleTree::arity - 1) / TriangleTree::arity * TriangleTree::arity;
    const double nowhere = std::numeric_limits<double>::max();  // squares to infinity: never near
    for (auto* v : {&s.x, &s.y, &s.z}) v->assign(padded, nowhere);
    s.radius.assign(padded, 0.0);
}

}  // namespace

TriangleTree make_triangle_tree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                double size) {
    TriangleTree tree;
    tree.source = morton_order(positions, triangles, size);
    const std::uint64_t count = triangles.size();
    tree.block.resize((count + TriangleTree::arity - 1) / TriangleTree::arity);
    parallel_for(tree.block.size() * TriangleTree::arity, grain, [&](std::uint64_t i) {
        const Triangle& t = triangles[tree.source[std::min(i, count - 1)]];
        set_lane(tree.block[i / TriangleTree::arity], i % TriangleTree::arity, positions[t[0]], positions[t[1]],
                 positions[t[2]]);
    });

    const double widening = TriangleTree::widening * unit_roundoff * size;
    for (std::uint64_t span = 1;; span *= TriangleTree::arity) {
        const std::uint64_t nodes = (count + span - 1) / span;
        TriangleTree::Spheres& s = tree.levels.emplace_back();
        resize_padded(s, nodes);
        parallel_for(nodes, std::max<std::uint64_t>(grain / span, 1), [&](std::uint64_t node) {
            const std::uint64_t begin = node * span, end = std::min(count, begin + span);
            Vec3 low = positions[triangles[tree.source[begin]][0]], high = low;
            for (std::uint64_t i = begin; i < end; ++i)
                for (const std::uint32_t v : triangles[tree.source[i]])
                    for (int axis = 0; axis < 3; ++axis) {
                        low[axis] = std::min(low[axis], positions[v][axis]);
                        high[axis] = std::max(high[axis], positions[v][axis]);
                    }
            const Vec3 centre = 0.5 * (low + high);
            double radius = 0;
            for (std::uint64_t i = begin; i < end; ++i)
                for (const std::uint32_t v : triangles[tree.source[i]])
                    radius = std::max(radius, norm(positions[v] - centre));
            s.x[node] = centre.x;
            s.y[node] = centre.y;
            s.z[node] = centre.z;
            s.radius[node] = radius + widening;
        });
        if (nodes <= TriangleTree::arity) return tree;
    }
}

}  // namespace its
