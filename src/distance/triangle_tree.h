#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/simd.h"
#include "its/mesh.h"

/// Triangles in Morton order under an implicit tree of bounding spheres: eight nodes of a level, in order, are
/// the children of one node of the next.
namespace its {

struct TriangleTree {
    static constexpr std::uint64_t arity = 8;

    /// Radii are widened by this many u × the size of the coordinates. A squared_distance() is the square of a
    /// distance with an error of at most 8u·size (differences of coordinates, then sums of products of relative
    /// error 4u), and so are two distances and one sphere's test together: no comparison of rounded distances
    /// cuts off the triangle whose computed distance is smallest.
    static constexpr double widening = 32;

    /// Spheres of one level, padded to a multiple of `arity` with spheres that nothing is near to.
    struct Spheres {
        std::vector<double> x, y, z, radius;
        std::uint64_t size() const { return x.size(); }
    };

    /// What the distance to a triangle a, a + ab, a + ac needs, for the eight triangles of a node of level 1;
    /// reciprocals are 0 where the divisor is. Lanes past the last triangle repeat it.
    struct alignas(64) Block {
        double a[3][arity], ab[3][arity], ac[3][arity];
        double ab_ab[arity], ab_ac[arity], ac_ac[arity];
        double inverse_determinant[arity], inverse_ab[arity], inverse_ac[arity], inverse_bc[arity];
    };

    std::vector<Block> block;           ///< triangles in Morton order
    std::vector<std::uint32_t> source;  ///< index in the mesh of each triangle in Morton order
    std::vector<Spheres> levels;        ///< level 0: one sphere a triangle; the last level: at most `arity`
};

/// \param size  bound on all coordinates
TriangleTree make_triangle_tree(std::span<const Vec3> positions, std::span<const Triangle> triangles, double size);

/// Squared distance from a point to triangle `lane` of a block.
///
/// The smallest of the distances to the three edges and, if the foot of the perpendicular lies in the triangle,
/// to that foot. Each is the distance to a point of the triangle (up to rounding), so slivers and degenerate
/// triangles need no special case: a foot that is badly placed is farther away, and an edge takes its place.
/// Straight selections: a loop over points or over lanes becomes vector code, with the same bits.
ITS_INLINE double squared_distance(const TriangleTree::Block& t, std::uint64_t lane, double px, double py,
                                   double pz) {
    const double abx = t.ab[0][lane], aby = t.ab[1][lane], abz = t.ab[2][lane];
    const double acx = t.ac[0][lane], acy = t.ac[1][lane], acz = t.ac[2][lane];
    const double x = px - t.a[0][lane], y = py - t.a[1][lane], z = pz - t.a[2][lane];
    const double d1 = x * abx + y * aby + z * abz;
    const double d2 = x * acx + y * acy + z * acz;
    const auto unit = [](double v) { return v < 0.0 ? 0.0 : (v > 1.0 ? 1.0 : v); };
    const auto to_foot = [&](double s, double r) {  // from the point to a + s·ab + r·ac
        const double dx = x - s * abx - r * acx;
        const double dy = y - s * aby - r * acy;
        const double dz = z - s * abz - r * acz;
        return dx * dx + dy * dy + dz * dz;
    };
    const double on_ab = to_foot(unit(d1 * t.inverse_ab[lane]), 0.0);
    const double on_ac = to_foot(0.0, unit(d2 * t.inverse_ac[lane]));
    // p − b against c − b: (ap − ab)·(ac − ab) = d2 − d1 − ab·ac + ab·ab
    const double bc = unit((d2 - d1 - t.ab_ac[lane] + t.ab_ab[lane]) * t.inverse_bc[lane]);
    const double on_bc = to_foot(1.0 - bc, bc);
    const double s = (t.ac_ac[lane] * d1 - t.ab_ac[lane] * d2) * t.inverse_determinant[lane];
    const double r = (t.ab_ab[lane] * d2 - t.ab_ac[lane] * d1) * t.inverse_determinant[lane];
    const double inside = to_foot(s, r);
    const double edges = on_ab < on_ac ? (on_ab < on_bc ? on_ab : on_bc) : (on_ac < on_bc ? on_ac : on_bc);
    const bool foot_in_triangle = (s >= 0.0) & (r >= 0.0) & (s + r <= 1.0);
    return foot_in_triangle & (inside < edges) ? inside : edges;
}

}  // namespace its
