#pragma once

#include <array>
#include <cstdint>

#include "base/platform/compiler.h"
#include "its/base.h"

/// Distances to eight triangles at a time.
namespace its::distance {

/// What the distance to a triangle needs, for eight triangles, one a lane: a frame in which the triangle's
/// longest edge ab lies on the first axis and c in the upper half plane of the first two. Lanes that have no
/// triangle of their own repeat one.
struct alignas(64) TriangleBlock {
    static constexpr int lanes = 8;
    double a[3][lanes];  ///< the frame's origin
    /// Unit vectors along ab, in the plane towards c, and normal to it; rounded from twice the digits. A
    /// triangle without area has some such frame.
    double along[3][lanes], across[3][lanes], normal[3][lanes];
    double ab[lanes], ac[lanes], bc[lanes];       ///< lengths
    double unit_ac[2][lanes], unit_bc[2][lanes];  ///< directions in the plane
    /// The corner of the mesh's triangle that is a: 0, 1 or 2; b and c follow in cyclic order.
    std::uint8_t first[lanes];
};

/// The block of these triangles, whose coordinates and their differences must not overflow.
TriangleBlock make_block(const std::array<std::array<Vec3, 3>, TriangleBlock::lanes>& triangles);

/// Squared distance from a point to triangle `lane` of a block: to its plane if the point is over the triangle,
/// else to the nearest edge. Each decision and each distance is stable for any shape of triangle, since the
/// vectors that it takes a product with are unit vectors known to the last bit. Straight selections: a loop
/// over points or over lanes becomes vector code, with the same bits. Error: docs/design/distance.md.
ITS_INLINE double squared_distance(const TriangleBlock& t, std::uint64_t lane, double px, double py,
                                   double pz) {
    const auto smaller = [](double u, double v) { return u < v ? u : v; };
    const auto larger = [](double u, double v) { return u < v ? v : u; };
    const double x = px - t.a[0][lane], y = py - t.a[1][lane], z = pz - t.a[2][lane];
    const auto part = [&](const double(&axis)[3][TriangleBlock::lanes]) {
        return x * axis[0][lane] + y * axis[1][lane] + z * axis[2][lane];
    };
    const double u = part(t.along), v = part(t.across), height = part(t.normal);
    // Of each edge: how far the point lies on its inner side, and how far beyond the nearer of its ends.
    const double beyond_ab = larger(-u, u - t.ab[lane]);
    const double on_ac = t.unit_ac[0][lane] * u + t.unit_ac[1][lane] * v;
    const double in_ac = t.unit_ac[1][lane] * u - t.unit_ac[0][lane] * v;
    const double beyond_ac = larger(-on_ac, on_ac - t.ac[lane]);
    const double w = u - t.ab[lane];
    const double on_bc = t.unit_bc[0][lane] * w + t.unit_bc[1][lane] * v;
    const double in_bc = t.unit_bc[0][lane] * v - t.unit_bc[1][lane] * w;
    const double beyond_bc = larger(-on_bc, on_bc - t.bc[lane]);
    const auto squared = [&](double inner, double beyond) {
        const double outside = larger(beyond, 0.0);
        return inner * inner + outside * outside;
    };
    const double edges =
        smaller(smaller(squared(v, beyond_ab), squared(in_ac, beyond_ac)), squared(in_bc, beyond_bc));
    // The corners at a and b may be as sharp as they like: beyond them, roundings could place a point on the
    // inner side of both edges.
    const double inside = smaller(smaller(v, in_ac), smaller(in_bc, -beyond_ab));
    return height * height + (inside > 0.0 ? 0.0 : edges);
}

/// Barycentric coordinates, each in [0, 1] and of sum 1 up to rounding, of the point of triangle `lane` that is
/// nearest to p; by the same decisions as squared_distance().
std::array<double, 3> barycentric_of_nearest(const TriangleBlock& t, std::uint64_t lane, const Vec3& p);

}  // namespace its::distance
