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

    /// Radii are widened by this many u × the size of the coordinates: far more than a distance's own error of
    /// 8u·size (docs/design/distance.md), so that no comparison of rounded distances cuts off a triangle whose
    /// computed distance is the smallest; and far less than any sphere that matters.
    static constexpr double widening = 4096;

    /// Spheres of one level, padded to a multiple of `arity` with spheres that nothing is near to.
    struct Spheres {
        std::vector<double> x, y, z, radius;
        std::uint64_t size() const { return x.size(); }
    };

    /// What the distance to a triangle abc needs, for the eight triangles of a node of level 1; reciprocals are
    /// 0 where the divisor is. Lanes past the last triangle repeat it.
    struct alignas(64) Block {
        double a[3][arity], ab[3][arity], ac[3][arity];
        double ab_ab[arity], ab_ac[arity];
        double inverse_ab[arity], inverse_ac[arity], inverse_bc[arity];
        /// Unit normal, and the unit vectors in the plane that point from each edge into the triangle; rounded
        /// from extended precision. A degenerate triangle has zeros, and `bc_level` 1: nothing is inside it.
        double normal[3][arity], in_from_ab[3][arity], in_from_ac[3][arity], in_from_bc[3][arity];
        double bc_level[arity];  ///< of edge bc along in_from_bc, from a
    };

    std::vector<Block> block;           ///< triangles in Morton order
    std::vector<std::uint32_t> source;  ///< index in the mesh of each triangle in Morton order
    std::vector<Spheres> levels;        ///< level 0: one sphere a triangle; the last level: at most `arity`
};

/// \param size  bound on all coordinates
TriangleTree make_triangle_tree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                double size);

/// Squared distance from a point to triangle `lane` of a block: to its plane if the point is over the triangle,
/// else to the nearest edge. Each decision and each distance is stable for any shape of triangle, since the
/// vectors that it takes a product with are unit vectors known to the last bit. Straight selections: a loop
/// over points or over lanes becomes vector code, with the same bits.
ITS_INLINE double squared_distance(const TriangleTree::Block& t, std::uint64_t lane, double px, double py,
                                   double pz) {
    const double abx = t.ab[0][lane], aby = t.ab[1][lane], abz = t.ab[2][lane];
    const double acx = t.ac[0][lane], acy = t.ac[1][lane], acz = t.ac[2][lane];
    const double x = px - t.a[0][lane], y = py - t.a[1][lane], z = pz - t.a[2][lane];
    const auto unit = [](double v) { return v < 0.0 ? 0.0 : (v > 1.0 ? 1.0 : v); };
    const auto squared_norm = [](double dx, double dy, double dz) { return dx * dx + dy * dy + dz * dz; };
    const auto along = [&](const double(&v)[3][TriangleTree::arity]) {
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

}  // namespace its
