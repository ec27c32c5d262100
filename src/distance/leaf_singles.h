#pragma once

#include <cstdint>

#include "base/platform/lanes.h"
#include "distance/closest_point.h"
#include "distance/triangle_block.h"

/// A leaf's triangles in single precision: what tells for 16 points at a time which of them can be nearest.
/// Lengths are those of the tree's boxes: relative to its centre, in units of its scale. Errors:
/// docs/design/distance.md.
namespace its::distance {

/// The frame of a TriangleBlock's triangle, rounded.
struct SingleTriangle {
    float a[3], along[3], across[3], normal[3];
    float ab, ac, bc, unit_ac[2], unit_bc[2];
};

/// A box around a leaf's triangles, flat along their mean normal.
struct alignas(64) LeafBox {
    float centre[3], axis[3][3], half[3];
    std::uint32_t triangles;  ///< of the leaf's eight lanes, those that have one of their own come first
};

SingleTriangle single_triangle(const TriangleBlock& block, int lane, const ClosestPointTree::Frame& frame);
LeafBox leaf_box(const TriangleBlock& block, int triangles, const ClosestPointTree::Frame& frame);

/// 16 points, or what leads from one place to them.
struct SinglePoints {
    platform::Singles x, y, z;
};

ITS_INLINE platform::Singles part(const SinglePoints& p, const float (&axis)[3]) {
    return p.x * axis[0] + p.y * axis[1] + p.z * axis[2];
}
ITS_INLINE platform::Singles beyond_squared(const platform::Singles& beyond) {
    const platform::Singles outside = platform::larger(beyond, platform::Singles{});
    return outside * outside;
}

/// Squared distances of 16 points to a triangle, as squared_distance() of its block.
ITS_INLINE platform::Singles squared_distances(const SingleTriangle& t, const SinglePoints& p) {
    using platform::larger, platform::smaller, platform::Singles;
    const SinglePoints q{p.x - t.a[0], p.y - t.a[1], p.z - t.a[2]};
    const Singles u = part(q, t.along), v = part(q, t.across), height = part(q, t.normal);
    const Singles w = u - t.ab;
    const Singles beyond_ab = larger(-u, w);
    const Singles on_ac = t.unit_ac[0] * u + t.unit_ac[1] * v;
    const Singles in_ac = t.unit_ac[1] * u - t.unit_ac[0] * v;
    const Singles beyond_ac = larger(-on_ac, on_ac - t.ac);
    const Singles on_bc = t.unit_bc[0] * w + t.unit_bc[1] * v;
    const Singles in_bc = t.unit_bc[0] * v - t.unit_bc[1] * w;
    const Singles beyond_bc = larger(-on_bc, on_bc - t.bc);
    const Singles edges =
        smaller(smaller(v * v + beyond_squared(beyond_ab), in_ac * in_ac + beyond_squared(beyond_ac)),
                in_bc * in_bc + beyond_squared(beyond_bc));
    const Singles inside = smaller(smaller(v, in_ac), smaller(in_bc, -beyond_ab));
    return height * height + platform::zero_if_positive(inside, edges);
}

/// Lower bounds on the squared distances of 16 points to what is in the box.
ITS_INLINE platform::Singles squared_gaps(const LeafBox& box, const SinglePoints& p) {
    using platform::larger, platform::Singles;
    const SinglePoints q{p.x - box.centre[0], p.y - box.centre[1], p.z - box.centre[2]};
    Singles sum = {};
    for (int i = 0; i < 3; ++i) {
        const Singles along = part(q, box.axis[i]);
        sum = sum + beyond_squared(larger(along, -along) - box.half[i]);
    }
    return sum;
}

/// The same for one point.
ITS_INLINE float squared_gap(const LeafBox& box, const float (&p)[3]) {
    const float x = p[0] - box.centre[0], y = p[1] - box.centre[1], z = p[2] - box.centre[2];
    float sum = 0;
    for (int i = 0; i < 3; ++i) {
        const float along = x * box.axis[i][0] + y * box.axis[i][1] + z * box.axis[i][2];
        const float beyond = (along < 0 ? -along : along) - box.half[i];
        sum += beyond > 0 ? beyond * beyond : 0;
    }
    return sum;
}

}  // namespace its::distance
