#include "inspect/sides.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "mesh/arrays.h"
#include "winding/x_rays.h"

namespace its::inspector {

namespace {

constexpr std::uint64_t samples = 512;
constexpr double clearly = 0.375;  // from 0 outside or 1 inside: at least 1/8 away from ½
constexpr double tolerance = 0x1p-15, precise_enough = 0.01;

/// A point of the mesh, but for rounding, and its triangle.
struct SurfacePoint {
    std::uint32_t triangle = 0;
    Vec3 at;
};

/// The middles of equal shares of the area; in triangles with several, at points of a low-discrepancy sequence.
std::vector<SurfacePoint> spread_points(const mesh::Merged& mesh) {
    std::vector<double> running;
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.points[t[0]];
        running.push_back(sum += norm(cross(mesh.points[t[1]] - a, mesh.points[t[2]] - a)));
    }
    std::vector<SurfacePoint> points;
    if (!(sum > 0)) return points;
    for (std::uint64_t i = 0; i < samples; ++i) {
        const double share = (double(i) + 0.5) / double(samples) * sum;
        const auto found = std::lower_bound(running.begin(), running.end(), share);
        const auto index =
            std::uint32_t(std::min(std::size_t(found - running.begin()), mesh.triangles.size() - 1));
        // Roberts' R2 sequence, folded into the triangle; none of these is on an edge, where a point may be
        // beyond the next triangle.
        double u = std::fmod(0.7548776662466927 * double(i + 1), 1.0);
        double v = std::fmod(0.5698402909980532 * double(i + 1), 1.0);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const Triangle& t = mesh.triangles[index];
        const Vec3 a = mesh.points[t[0]];
        points.push_back({index, a + u * (mesh.points[t[1]] - a) + v * (mesh.points[t[2]] - a)});
    }
    return points;
}

/// The winding number of F; where a dipole estimate is not precise enough, from the boundary.
double filling_winding(const winding::Filling& filling, const winding::XRays& rays, const Vec3& p) {
    if (filling.empty()) return 0;
    const winding::WindingEstimate w = filling.winding(p, tolerance);
    if (w.error <= precise_enough) return w.value;
    return rays.crossings(p) - filling.boundary_term(p).value;
}

}  // namespace

Sides sample_sides(const mesh::Merged& mesh, const winding::Filling& filling) {
    const std::vector<SurfacePoint> points = spread_points(mesh);
    if (points.empty()) return {};
    const mesh::Arrays& surface = filling.surface();
    const winding::XRays rays(mesh.points, mesh.triangles), filling_rays(surface.vertices, surface.triangles);
    std::vector<Sides> found(points.size());
    parallel_for(points.size(), 1, [&](std::uint64_t i) {
        const auto& [triangle, p] = points[i];
        const Triangle& t = mesh.triangles[triangle];
        const int side =
            geometry::perturbed_orient3d(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], p);
        const double w =
            rays.crossings(p) + filling_rays.crossings(p) - filling_winding(filling, filling_rays, p);
        const double outside = side > 0 ? w : w - 1, inside = outside + 1;
        found[i].separates = std::abs(outside) <= clearly ? 1 : 0;
        found[i].reversed = std::abs(inside) <= clearly ? 1 : 0;
        found[i].any_inside = inside > 0.5;  // the greater of the two
    });
    Sides sum;
    for (const Sides& one : found) {
        sum.separates += one.separates / double(points.size());
        sum.reversed += one.reversed / double(points.size());
        sum.any_inside |= one.any_inside;
    }
    return sum;
}

}  // namespace its::inspector
