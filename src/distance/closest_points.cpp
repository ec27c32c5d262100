#include "its/distance.h"

#include <fmt/format.h>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/platform/compiler.h"
#include "distance/closest_point.h"
#include "distance/curve_order.h"
#include "distance/group_search.h"
#include "distance/searchable.h"
#include "geometry/vec3.h"
#include "mesh/arrays.h"
#include "mesh/scaled.h"

namespace its {
using namespace distance;

namespace {

constexpr std::uint64_t grain = 1024;  // points: below it, a batch is serial
// Fewer points than these, or than one for so many triangles, have too little in common: measured.
constexpr std::uint64_t least_grouped = 256, sparse = 10;
constexpr std::uint64_t sorted = 1ULL << 18;  // points that are sorted at a time

/// A copy of the mesh, scaled.
/// \throws InputError unless it can be searched
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
          tree(mesh.vertices, mesh.triangles),
          groups(tree) {}

    ClosestPoint find(const Vec3& point) const {
        const SearchPoint query = search_point(point, scaling, reach);
        return complete(point, query, tree.find(query.at));
    }

    ClosestPoint complete(const Vec3& point, const SearchPoint& query, const Nearest& nearest) const {
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

    /// Points of a batch: those that are near enough in groups, the others one by one.
    void find(std::span<const Vec3> points, std::span<ClosestPoint> results, Stage& stage) const {
        std::vector<Vec3> copies;
        if (scaling.exponent != 0)
            for (const Vec3& p : points) copies.push_back(scaling.in(p));
        const std::span<const Vec3> scaled = copies.empty() ? points : copies;
        const Vec3 centre = groups.centre();
        const double within = groups.reach();
        std::vector<std::uint32_t> near;
        near.reserve(points.size());
        for (std::uint64_t i = 0; i < points.size(); ++i) {
            const Vec3 d = scaled[i] - centre;
            if (std::abs(d.x) < within && std::abs(d.y) < within && std::abs(d.z) < within)
                near.push_back(std::uint32_t(i));
            else
                results[i] = finite(points[i]) ? find(points[i]) : nowhere();
        }
        stage.advance(points.size() - near.size());
        const bool dense = near.size() >= least_grouped && near.size() * sparse >= mesh.triangles.size();
        if (dense) near = curve_order(scaled, near);
        for_chunks(near.size(), grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
            const auto some = std::span<const std::uint32_t>(near).subspan(begin, end - begin);
            if (dense) find_near(some, scaled, results);
            if (!dense)
                for (const std::uint32_t i : some) results[i] = find(points[i]);
            stage.advance(end - begin);
        });
    }

    /// Points of these numbers.
    void find_near(std::span<const std::uint32_t> numbers, std::span<const Vec3> scaled,
                   std::span<ClosestPoint> results) const {
        constexpr std::size_t group = GroupSearch::group;
        std::array<Vec3, group> at;
        std::array<Nearest, group> nearest;
        for (std::size_t first = 0; first < numbers.size(); first += group) {
            const auto some = numbers.subspan(first, std::min(group, numbers.size() - first));
            for (std::size_t i = 0; i < some.size(); ++i) {
                at[i] = scaled[some[i]];
                prefetch(results[some[i]]);
            }
            groups.find(std::span(at).first(some.size()), nearest);
            for (std::size_t i = 0; i < some.size(); ++i)
                results[some[i]] = complete(at[i], {at[i]}, nearest[i]);
        }
    }

    /// What will be written soon, out of order.
    static void prefetch(ClosestPoint& result) {
        ITS_PREFETCH_TO_WRITE(&result);
        ITS_PREFETCH_TO_WRITE(reinterpret_cast<std::byte*>(&result) + sizeof result - 1);
    }

    static ClosestPoint nowhere() {
        const double nan = std::numeric_limits<double>::quiet_NaN();
        return {.point = {nan, nan, nan}, .distance = nan, .barycentric = {nan, nan, nan}};
    }

    geometry::Scaling scaling;
    Mesh mesh;     ///< scaled
    double reach;  ///< its largest coordinate
    ClosestPointTree tree;
    GroupSearch groups;
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
    Stage stage(run.progress, "closest points", points.size());
    with_threads(run.threads, [&] {
        for (std::uint64_t begin = 0; begin < points.size(); begin += sorted) {
            const std::uint64_t count = std::min<std::uint64_t>(sorted, points.size() - begin);
            data_->find(points.subspan(begin, count), results.subspan(begin, count), stage);
        }
    });
}

std::uint64_t ClosestPoints::memory_bytes() const {
    return data_->tree.memory_bytes() + data_->groups.memory_bytes();
}

}  // namespace its
