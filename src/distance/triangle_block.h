#pragma once

#include <array>
#include <cstdint>

#include "base/simd.h"
#include "its/base.h"

/// Distances to eight triangles at a time.
namespace its {

/// What the distance to a triangle abc needs, for eight triangles, one a lane; reciprocals are
/// 0 where the divisor is. Lanes that have no triangle of their own repeat one.
struct alignas(64) TriangleBlock {
    static constexpr int lanes = 8;
    double a[3][lanes], ab[3][lanes], ac[3][lanes];
    double ab_ab[lanes], ab_ac[lanes];
    double inverse_ab[lanes], inverse_ac[lanes], inverse_bc[lanes];
    /// Unit normal, and the unit vectors in the plane that point from each edge into the triangle; rounded
    /// from extended precision. A degenerate triangle has zeros, and `bc_level` 1: nothing is inside it.
    double normal[3][lanes], in_from_ab[3][lanes], in_from_ac[3][lanes], in_from_bc[3][lanes];
    double bc_level[lanes];  ///< of edge bc along in_from_bc, from a
};

/// Puts triangle abc into a lane.
void set_lane(TriangleBlock& block, std::uint64_t lane, const Vec3& a, const Vec3& b, const Vec3& c);

/// Squared distance from a point to triangle `lane` of a block: to its plane if the point is over the triangle,
/// else to the nearest edge. Each decision and each distance is stable for any shape of triangle, since the
/// vectors that it takes a product with are unit vectors known to the last bit. Straight selections: a loop
/// over points or over lanes becomes vector code, with the same bits.
ITS_INLINE double squared_distance(const TriangleBlock& t, std::uint64_t lane, double px, double py,
                                   double pz) {
    const double abx = t.ab[0][lane], aby = t.ab[1][lane], abz = t.ab[2][lane];
    const double acx = t.ac[0][lane], acy = t.ac[1][lane], acz = t.ac[2][lane];
    const double x = px - t.a[0][lane], y = py - t.a[1][lane], z = pz - t.a[2][lane];
    const auto unit = [](double v) { return v < 0.0 ? 0.0 : (v > 1.0 ? 1.0 : v); };
    const auto squared_norm = [](double dx, double dy, double dz) { return dx * dx + dy * dy + dz * dz; };
    const auto along = [&](const double(&v)[3][TriangleBlock::lanes]) {
        return x * v[0][lane] + y * v[1][lane] + z * v[2][lane];
    };
    const double d1 = x * abx + y * aby + z * abz;
    const double d2 = x * acx + y * acy + z * acz;
    const double ab = unit(d1 * t.inverse_ab[lane]), ac = unit(d2 * t.inverse_ac[lane]);
    // p − b against c − b: (ap − ab)·(ac − ab) = d2 − d1 − ab·ac + ab·ab
    const double bc = unit((d2 - d1 - t.ab_ac[lane] + t.ab_ab[lane]) * t.inverse_bc[lane]);
    const double on_ab = squared_norm(x - ab * abx, y - ab * aby, z - ab * abz);
    const double on_ac = squared_norm(x - ac * acx, y - ac * acy, z - ac * acz);
    const double on_bc =
        squared_norm(x - abx - bc * (acx - abx), y - aby - bc * (acy - aby), z - abz - bc * (acz - abz));
    const double edges = on_ab < on_ac ? (on_ab < on_bc ? on_ab : on_bc) : (on_ac < on_bc ? on_ac : on_bc);
    const double height = along(t.normal);
    const double from_ab = along(t.in_from_ab), from_ac = along(t.in_from_ac);
    const double from_bc = along(t.in_from_bc) - t.bc_level[lane];
    const double lower = from_ab < from_ac ? from_ab : from_ac;
    const double inside = lower < from_bc ? lower : from_bc;
    return inside >= 0.0 ? height * height : edges;
}

/// Barycentric coordinates, each in [0, 1] and of sum 1 up to rounding, of the point of triangle `lane` that is
/// nearest to p; by the same decisions as squared_distance().
std::array<double, 3> barycentric_of_nearest(const TriangleBlock& t, std::uint64_t lane, const Vec3& p);

}  // namespace its
