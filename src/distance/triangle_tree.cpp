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

/// Extended precision for what is computed once a triangle.
struct WideVec3 {
    long double x, y, z;
};
WideVec3 wide_difference(const Vec3& p, const Vec3& q) {
    return {(long double)p.x - q.x, (long double)p.y - q.y, (long double)p.z - q.z};
}
WideVec3 cross(const WideVec3& a, const WideVec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
long double dot(const WideVec3& a, const WideVec3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
WideVec3 unit(const WideVec3& a) {
    const long double length = std::sqrt(dot(a, a));
    return length > 0 ? WideVec3{a.x / length, a.y / length, a.z / length} : WideVec3{0, 0, 0};
}
double reciprocal(long double x) {
    return x > 0 ? double(1 / x) : 0.0;
}

void set_lane(TriangleTree::Block& t, std::uint64_t lane, const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto store = [lane](double(&to)[3][TriangleTree::arity], const WideVec3& v) {
        to[0][lane] = double(v.x);
        to[1][lane] = double(v.y);
        to[2][lane] = double(v.z);
    };
    const WideVec3 ab = wide_difference(b, a), ac = wide_difference(c, a), bc = wide_difference(c, b);
    for (int axis = 0; axis < 3; ++axis) t.a[axis][lane] = a[axis];
    store(t.ab, ab);
    store(t.ac, ac);
    t.ab_ab[lane] = double(dot(ab, ab));
    t.ab_ac[lane] = double(dot(ab, ac));
    t.inverse_ab[lane] = reciprocal(dot(ab, ab));
    t.inverse_ac[lane] = reciprocal(dot(ac, ac));
    t.inverse_bc[lane] = reciprocal(dot(bc, bc));

    const WideVec3 normal = unit(cross(ab, ac));
    const WideVec3 in_from_bc = unit(cross(normal, bc));
    store(t.normal, normal);
    store(t.in_from_ab, unit(cross(normal, ab)));
    store(t.in_from_ac, unit(cross(ac, normal)));
    store(t.in_from_bc, in_from_bc);
    const bool degenerate = dot(normal, normal) == 0;
    t.bc_level[lane] = degenerate ? 1.0 : double(dot(in_from_bc, ab));
}

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
