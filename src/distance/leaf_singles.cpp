#include "distance/leaf_singles.h"

#include <algorithm>
#include <array>
#include <limits>

#include "geometry/vec3.h"

namespace its::distance {

namespace {

constexpr int arity = ClosestPointTree::arity;

Vec3 vector(const double (&v)[3][arity], int lane) {
    return {v[0][lane], v[1][lane], v[2][lane]};
}

Vec3 relative(const TriangleBlock& block, int lane, const ClosestPointTree::Frame& frame) {
    return frame.inverse_scale * (vector(block.a, lane) - frame.centre);
}

/// Three directions at right angles: the triangles' mean normal, made normal to the second one, the longest
/// edge.
std::array<Vec3, 3> axes_of(const TriangleBlock& block, int triangles) {
    Vec3 normal;
    int longest = 0;
    for (int i = 0; i < triangles; ++i) {
        normal = normal + (block.ab[i] * (block.ac[i] * block.unit_ac[1][i])) * vector(block.normal, i);
        if (block.ab[i] > block.ab[longest]) longest = i;
    }
    const Vec3 along = vector(block.along, longest);
    normal = normal - dot(normal, along) * along;
    const double length = norm(normal), edge = block.ab[longest];
    // A small rest has lost its direction, and any will do.
    if (!(length > 0x1p-20 * edge * edge))
        return {vector(block.normal, longest), along, vector(block.across, longest)};
    normal = (1 / length) * normal;
    return {normal, along, cross(normal, along)};
}

}  // namespace

SingleTriangle single_triangle(const TriangleBlock& block, int lane, const ClosestPointTree::Frame& frame) {
    SingleTriangle t;
    const double s = frame.inverse_scale;
    const Vec3 a = relative(block, lane, frame);
    for (int i = 0; i < 3; ++i) {
        t.a[i] = float(a[i]);
        t.along[i] = float(block.along[i][lane]);
        t.across[i] = float(block.across[i][lane]);
        t.normal[i] = float(block.normal[i][lane]);
    }
    t.ab = float(s * block.ab[lane]);
    t.ac = float(s * block.ac[lane]);
    t.bc = float(s * block.bc[lane]);
    for (int i = 0; i < 2; ++i) {
        t.unit_ac[i] = float(block.unit_ac[i][lane]);
        t.unit_bc[i] = float(block.unit_bc[i][lane]);
    }
    return t;
}

LeafBox leaf_box(const TriangleBlock& block, int triangles, const ClosestPointTree::Frame& frame) {
    const std::array<Vec3, 3> axes = axes_of(block, triangles);
    Vec3 low, high;
    for (int i = 0; i < 3; ++i) {
        low[i] = std::numeric_limits<double>::infinity();
        high[i] = -low[i];
    }
    for (int lane = 0; lane < triangles; ++lane) {
        const Vec3 a = relative(block, lane, frame);
        const double ab = frame.inverse_scale * block.ab[lane], ac = frame.inverse_scale * block.ac[lane];
        const Vec3 along = vector(block.along, lane), across = vector(block.across, lane);
        const Vec3 c = a + (ac * block.unit_ac[0][lane]) * along + (ac * block.unit_ac[1][lane]) * across;
        for (const Vec3& corner : {a, a + ab * along, c})
            for (int i = 0; i < 3; ++i) {
                low[i] = std::min(low[i], dot(corner, axes[i]));
                high[i] = std::max(high[i], dot(corner, axes[i]));
            }
    }
    const Vec3 half = 0.5 * (high - low);
    const double margin = 0x1p-19 * (half.x + half.y + half.z + 1);  // 32 roundings
    LeafBox box;
    box.triangles = std::uint32_t(triangles);
    for (int i = 0; i < 3; ++i) {
        double centre = 0;
        for (int k = 0; k < 3; ++k) {
            centre += 0.5 * (low[k] + high[k]) * axes[k][i];
            box.axis[i][k] = float(axes[i][k]);
        }
        box.centre[i] = float(centre);
        box.half[i] = float(half[i] + margin);
    }
    return box;
}

}  // namespace its::distance
