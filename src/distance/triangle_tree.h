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

    /// Spheres of one level, padded to a multiple of `arity` with spheres that nothing is near to.
    struct Spheres {
        std::vector<double> x, y, z, radius;
        std::uint64_t size() const { return x.size(); }
    };

    /// What the distance to a triangle a, a + ab, a + ac needs; reciprocals are 0 where the divisor is.
    struct Record {
        double a[3], ab[3], ac[3];
        double ab_ab, ab_ac, ac_ac;
        double inverse_determinant, inverse_ab, inverse_ac, inverse_bc;
    };

    std::vector<Record> record;         ///< in Morton order
    std::vector<std::uint32_t> source;  ///< index of the record's triangle in the mesh
    std::vector<Spheres> levels;        ///< level 0: one sphere a triangle; the last level: at most `arity`
};

/// \param size  bound on all coordinates; radii are widened by 32u·size so that a comparison of rounded
///              distances never cuts off a triangle whose computed distance is the smallest.
TriangleTree make_triangle_tree(std::span<const Vec3> positions, std::span<const Triangle> triangles, double size);

/// Squared distance from a point to a triangle.
///
/// The smallest of the distances to the three edges and, if the foot of the perpendicular lies in the triangle,
/// to that foot. Each is the distance to a point of the triangle (up to rounding), so slivers and degenerate
/// triangles need no special case: a foot that is badly placed is farther away, and an edge takes its place.
/// Written as straight selections: the compiler turns a loop over points into vector code.
ITS_INLINE double squared_distance(const TriangleTree::Record& t, double px, double py, double pz) {
    const double x = px - t.a[0], y = py - t.a[1], z = pz - t.a[2];
    const double d1 = x * t.ab[0] + y * t.ab[1] + z * t.ab[2];
    const double d2 = x * t.ac[0] + y * t.ac[1] + z * t.ac[2];
    const auto unit = [](double v) { return v < 0.0 ? 0.0 : (v > 1.0 ? 1.0 : v); };
    const auto to_foot = [&](double s, double r) {  // from the point to a + s·ab + r·ac
        const double dx = x - s * t.ab[0] - r * t.ac[0];
        const double dy = y - s * t.ab[1] - r * t.ac[1];
        const double dz = z - s * t.ab[2] - r * t.ac[2];
        return dx * dx + dy * dy + dz * dz;
    };
    const double on_ab = to_foot(unit(d1 * t.inverse_ab), 0.0);
    const double on_ac = to_foot(0.0, unit(d2 * t.inverse_ac));
    // p − b against c − b: (ap − ab)·(ac − ab) = d2 − d1 − ab·ac + ab·ab
    const double bc = unit((d2 - d1 - t.ab_ac + t.ab_ab) * t.inverse_bc);
    const double on_bc = to_foot(1.0 - bc, bc);
    const double s = (t.ac_ac * d1 - t.ab_ac * d2) * t.inverse_determinant;
    const double r = (t.ab_ab * d2 - t.ab_ac * d1) * t.inverse_determinant;
    const double inside = to_foot(s, r);
    const double edges = on_ab < on_ac ? (on_ab < on_bc ? on_ab : on_bc) : (on_ac < on_bc ? on_ac : on_bc);
    const bool foot_in_triangle = (s >= 0.0) & (r >= 0.0) & (s + r <= 1.0);
    return foot_in_triangle & (inside < edges) ? inside : edges;
}

}  // namespace its
