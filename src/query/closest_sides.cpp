#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "base/parallel.h"
#include "distance/closest_point.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/query.h"
#include "mesh/merged.h"
#include "mesh/normals.h"
#include "shell/shell_data.h"

namespace its {

struct ClosestSides::Data {
    explicit Data(const Mesh& source)
        : mesh(mesh::merge(source)),
          tree(mesh.points, mesh.triangles),
          at_vertex(mesh::vertex_normals(mesh.points, mesh.triangles)),
          at_edge(mesh.triangles.size()) {
        mesh::for_edges(
            mesh, [&](std::size_t t) { return !mesh::repeats_corner(mesh.triangles[t]); },
            [&](std::uint32_t low, std::span<const mesh::EdgeUse> uses) {
                Vec3 sum;
                for (const mesh::EdgeUse& use : uses) {
                    const Vec3 n = mesh::area_vector(mesh.points, mesh.triangles[use.triangle]);
                    const double length = norm(n);
                    if (length > 0) sum = sum + (1 / length) * n;
                }
                for (const mesh::EdgeUse& use : uses) at_edge[use.triangle][opposite(use, low)] = sum;
            });
    }

    /// Which corner of the triangle is not on the edge.
    int opposite(const mesh::EdgeUse& use, std::uint32_t low) const {
        const Triangle& t = mesh.triangles[use.triangle];
        return t[0] != low && t[0] != use.high ? 0 : t[1] != low && t[1] != use.high ? 1 : 2;
    }

    Side side(const Vec3& p) const {
        const distance::Nearest nearest = tree.find(p);
        if (nearest.squared == 0) return Side::on_surface;
        const Triangle& t = mesh.triangles[nearest.triangle];
        const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
        const std::array<double, 3> weight = tree.barycentric(nearest, p);
        const auto zeros = std::count(weight.begin(), weight.end(), 0.0);
        if (zeros == 0) return Side(geometry::orient3d(a, b, c, p));
        const auto least = std::min_element(weight.begin(), weight.end()) - weight.begin();
        const auto most = std::max_element(weight.begin(), weight.end()) - weight.begin();
        const Vec3& n = zeros == 1 ? at_edge[nearest.triangle][std::size_t(least)]
                                   : at_vertex.at(nearest.triangle, std::size_t(most));
        const Vec3 foot = a + weight[1] * (b - a) + weight[2] * (c - a);
        return dot(p - foot, n) > 0 ? Side::outside : Side::inside;
    }

    mesh::Merged mesh;
    distance::ClosestPointTree tree;
    CornerValues<Vec3> at_vertex;
    std::vector<std::array<Vec3, 3>> at_edge;  ///< of a triangle, opposite of each corner; of any length
};

ClosestSides::ClosestSides(const ThinShell& shell, const Run& run) {
    if (shell.info().sign != SignRule::winding)
        throw OptionError(
            "sides by closest points: the mesh must be closed, and its shell's sign rule winding; use "
            "Query::classify()");
    data_ = with_threads(run.threads, [&] { return std::make_shared<const Data>(shell.mesh()); });
}

Side ClosestSides::side(const Vec3& point) const {
    if (!finite(point))
        throw InputError(
            fmt::format("point ({}, {}, {}): coordinates must be finite", point.x, point.y, point.z));
    return data_->side(point);
}

}  // namespace its
