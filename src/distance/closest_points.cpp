#include "its/distance.h"

#include <fmt/format.h>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "distance/closest_point.h"
#include "distance/searchable.h"
#include "geometry/vec3.h"
#include "mesh/arrays.h"
#include "mesh/scaled.h"

namespace its {
using namespace distance;

namespace {

constexpr std::uint64_t grain = 512;  // points: below it, a batch is serial

/// A copy of the mesh, scaled. \throws InputError unless it can be searched
Mesh checked_copy(const mesh::Arrays& mesh, geometry::Scaling& scaling) {
    require_searchable(mesh);
    const mesh::Scaled scaled(mesh);
    scaling = scaled.scaling();
    return mesh::copy_of(scaled.arrays());
}

}  // namespace

struct ClosestPoints::Data {
    explicit Data(const mesh::Arrays& m)
        : mesh(checked_copy(m, scaling)),
          reach(mesh::largest_coordinate(mesh)),
          tree(mesh.vertices, mesh.triangles) {}

    ClosestPoint find(const Vec3& point) const {
        const SearchPoint query = search_point(point, scaling, reach);
        const Nearest nearest = tree.find(query.at);
        ClosestPoint result;
        result.triangle = nearest.triangle;
        result.barycentric = tree.barycentric(nearest, query.at);
        const Triangle& t = mesh.triangles[nearest.triangle];
        const Vec3& a = mesh.vertices[t[0]];
        result.point = scaling.out(a + result.barycentric[1] * (mesh.vertices[t[1]] - a) +
                                   result.barycentric[2] * (mesh.vertices[t[2]] - a));
        result.distance = query.moved ? geometry::distance_at_any_size(point, result.point)
                                      : scaling.out(std::sqrt(nearest.squared));
        return result;
    }

    geometry::Scaling scaling;
    Mesh mesh;     ///< scaled
    double reach;  ///< its largest coordinate
    ClosestPointTree tree;
};

ClosestPoints::ClosestPoints(const MeshView& mesh, const Run& run) {
    const mesh::Native native(mesh);
    data_ = with_threads(run.threads, [&] { return std::make_shared<const Data>(native); });
}

ClosestPoint ClosestPoints::find(const Vec3& point) const {
    if (!finite(point))
        throw InputError(
            fmt::format("closest point: query ({}, {}, {}) is not finite", point.x, point.y, point.z));
    return data_->find(point);
}

void ClosestPoints::find(std::span<const Vec3> points, std::span<ClosestPoint> results, const Run& run) const {
    if (points.size() != results.size())
        throw OptionError(
            fmt::format("closest points: {} points but room for {} results", points.size(), results.size()));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const ClosestPoint none{.point = {nan, nan, nan}, .distance = nan, .barycentric = {nan, nan, nan}};
    Stage stage(run.progress, "closest points", points.size());
    with_threads(run.threads, [&] {
        for_chunks(points.size(), grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t i = begin; i < end; ++i)
                results[i] = finite(points[i]) ? data_->find(points[i]) : none;
            stage.advance(end - begin);
        });
    });
}

std::uint64_t ClosestPoints::memory_bytes() const {
    return data_->tree.memory_bytes();
}

}  // namespace its
