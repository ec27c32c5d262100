#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "distance/closest_point.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "its/query.h"
#include "mesh/merged.h"
#include "shell/shell_data.h"

namespace its {

namespace {

Vec3 unit_normal(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 n = cross(b - a, c - a);
    const double length = norm(n);
    return length > 0 ? (1 / length) * n : Vec3{};
}

/// The angle at a of triangle abc.
double angle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 u = b - a, v = c - a;
    return std::atan2(norm(cross(u, v)), dot(u, v));
}

}  // namespace

struct ClosestSides::Data {
    explicit Data(const Mesh& source) : mesh(merge(source)), tree(mesh.points, mesh.triangles) {
        normals.reserve(mesh.triangles.size());
        at_vertex.resize(mesh.points.size());
        at_edge.resize(mesh.triangles.size());
        for (const Triangle& t : mesh.triangles) {
            const Vec3 corners[3] = {mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]};
            const Vec3 n = unit_normal(corners[0], corners[1], corners[2]);
            normals.push_back(n);
            for (int k = 0; k < 3; ++k)
                at_vertex[t[k]] =
                    at_vertex[t[k]] + angle(corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]) * n;
        }
        for_edges(
            mesh, [&](std::size_t t) { return !repeats_corner(mesh.triangles[t]); },
            [&](std::uint32_t low, std::span<const EdgeUse> uses) {
                Vec3 sum;
                for (const EdgeUse& use : uses) sum = sum + normals[use.triangle];
                for (const EdgeUse& use : uses) at_edge[use.triangle][opposite(use, low)] = sum;
            });
    }

    /// Which corner of the triangle is not on the edge.
    int opposite(const EdgeUse& use, std::uint32_t low) const {
        const Triangle& t = mesh.triangles[use.triangle];
        return t[0] != low && t[0] != use.high ? 0 : t[1] != low && t[1] != use.high ? 1 : 2;
    }

    Side side(const Vec3& p) const {
        const Nearest nearest = tree.find(p);
        if (nearest.squared == 0) return Side::on_surface;
        const Triangle& t = mesh.triangles[nearest.triangle];
        const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
        const std::array<double, 3> weight = tree.barycentric(nearest, p);
        const auto zeros = std::count(weight.begin(), weight.end(), 0.0);
        if (zeros == 0) return Side(orient3d(a, b, c, p));
        const auto least = std::min_element(weight.begin(), weight.end()) - weight.begin();
        const auto most = std::max_element(weight.begin(), weight.end()) - weight.begin();
        const Vec3& n =
            zeros == 1 ? at_edge[nearest.triangle][std::size_t(least)] : at_vertex[t[std::size_t(most)]];
        const Vec3 foot = a + weight[1] * (b - a) + weight[2] * (c - a);
        return dot(p - foot, n) > 0 ? Side::outside : Side::inside;
    }

    Merged mesh;
    ClosestPointTree tree;
    std::vector<Vec3> normals;  ///< of the triangles
    std::vector<std::array<Vec3, 3>>
        at_edge;                  ///< of each triangle, at the edge opposite of corner k; any length
    std::vector<Vec3> at_vertex;  ///< any length
};

ClosestSides::ClosestSides(const ThinShell& shell, int threads) {
    if (shell.info().sign != SignRule::winding)
        throw OptionError(
            "sides by closest points: the mesh must be closed, and its shell's sign rule winding; use "
            "Query::classify()");
    data_ = with_threads(threads, [&] { return std::make_shared<const Data>(shell.mesh()); });
}

Side ClosestSides::side(const Vec3& point) const {
    if (!finite(point))
        throw InputError(
            fmt::format("point ({}, {}, {}): coordinates must be finite", point.x, point.y, point.z));
    return data_->side(point);
}

}  // namespace its
