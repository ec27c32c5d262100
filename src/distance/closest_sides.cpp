#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "base/names.h"
#include "base/parallel.h"
#include "distance/closest_point.h"
#include "distance/searchable.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "its/distance.h"
#include "mesh/merged.h"
#include "mesh/normals.h"
#include "mesh/scaled.h"

namespace its {

namespace {

constexpr Named<Side> sides[] = {{Side::inside, "inside"},
                                 {Side::on_surface, "on_surface"},
                                 {Side::outside, "outside"},
                                 {Side::uncertain, "uncertain"}};

/// \throws InputError unless the uses of an edge one way and the other cancel
void require_balanced(std::span<const mesh::EdgeUse> uses) {
    const auto upwards = std::ranges::count_if(uses, &mesh::EdgeUse::upwards);
    if (2 * upwards != std::ssize(uses))
        throw InputError(fmt::format(
            "sides by closest points: an edge of triangle {} is not matched by its opposite, so that "
            "the mesh has no inside; close and orient it",
            uses[0].triangle));
}

/// Scaled.
/// \throws InputError unless the mesh can be searched
mesh::Merged merged(const mesh::Arrays& mesh, geometry::Scaling& scaling) {
    distance::require_searchable(mesh);
    const mesh::Scaled scaled(mesh);
    scaling = scaled.scaling();
    return mesh::merge(scaled.arrays());
}

}  // namespace

std::string_view name(Side side) {
    return name_in(sides, side);
}

std::optional<Side> parse_side(std::string_view name) {
    return value_in(sides, name);
}

struct ClosestSides::Data {
    explicit Data(const mesh::Arrays& source)
        : mesh(merged(source, scaling)),
          reach(mesh::largest_coordinate({mesh.points, mesh.triangles})),
          tree(mesh.points, mesh.triangles),
          at_vertex(mesh::vertex_normals(mesh.points, mesh.triangles)),
          at_edge(mesh.triangles.size()) {
        mesh::for_edges(
            mesh, [&](std::size_t t) { return !mesh::repeats_corner(mesh.triangles[t]); },
            [&](std::uint32_t low, std::span<const mesh::EdgeUse> uses) {
                require_balanced(uses);
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

    Side side(const Vec3& point) const {
        const Vec3 p = distance::search_point(point, scaling, reach).at;
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

    geometry::Scaling scaling;
    mesh::Merged mesh;  ///< scaled
    double reach;       ///< its largest coordinate
    distance::ClosestPointTree tree;
    CornerValues<Vec3> at_vertex;
    std::vector<std::array<Vec3, 3>> at_edge;  ///< of a triangle, opposite of each corner; of any length
};

ClosestSides::ClosestSides(const MeshView& mesh, const Run& run) {
    const mesh::Native native(mesh);
    data_ = with_threads(run.threads, [&] { return std::make_shared<const Data>(native); });
}

Side ClosestSides::side(const Vec3& point) const {
    if (!finite(point))
        throw InputError(
            fmt::format("point ({}, {}, {}): coordinates must be finite", point.x, point.y, point.z));
    return data_->side(point);
}

}  // namespace its
