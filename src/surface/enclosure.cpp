#include "surface/enclosure.h"

#include <algorithm>
#include <span>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "winding/x_rays.h"

namespace its::surface {

namespace {

constexpr std::uint64_t grain = 64, triangle_grain = 16384;
constexpr std::size_t few = 16;

/// A vertex of each set of triangles that are connected by vertices, in order: the first of its set.
std::vector<Vec3> one_vertex_each(const shell::MeshArrays& mesh) {
    DisjointSets sets(mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        sets.join(t[0], t[1]);
        sets.join(t[0], t[2]);
    }
    std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) used[sets.find(mesh.triangles[i][0])] = 1;
    std::vector<Vec3> vertices;
    for (std::size_t v = 0; v < used.size(); ++v)
        if (used[v]) vertices.push_back(mesh.vertices[v]);
    return vertices;
}

/// The triangles that rays along x from one of the points may meet.
std::vector<Triangle> met_by_rays(std::span<const Vec3> points, const Mesh& surface) {
    const auto may_meet = [&](const Triangle& t) {
        const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
        const double y_low = std::min({a.y, b.y, c.y}), y_high = std::max({a.y, b.y, c.y});
        const double z_low = std::min({a.z, b.z, c.z}), z_high = std::max({a.z, b.z, c.z});
        return std::any_of(points.begin(), points.end(), [&](const Vec3& p) {
            return (p.y >= y_low) & (p.y <= y_high) & (p.z >= z_low) & (p.z <= z_high);
        });
    };
    const std::uint64_t count = surface.triangles.size();
    std::vector<std::vector<Triangle>> parts(chunk_count(count, triangle_grain));
    for_chunks(count, triangle_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i)
            if (may_meet(surface.triangles[i])) parts[chunk].push_back(surface.triangles[i]);
    });
    std::vector<Triangle> met;
    for (const auto& part : parts) met.insert(met.end(), part.begin(), part.end());
    return met;
}

}  // namespace

std::uint64_t count_parts(const shell::MeshArrays& mesh) {
    return one_vertex_each(mesh).size();
}

Enclosure enclosure(const shell::MeshArrays& mesh, const Mesh& surface, int wanted, const Progress& progress) {
    const std::vector<Vec3> points = one_vertex_each(mesh);
    Enclosure result{points.size(), {}};
    // To bin all triangles is worth while for many points only.
    const std::vector<Triangle> met =
        points.size() <= few ? met_by_rays(points, surface) : std::vector<Triangle>();
    const winding::XRays rays(surface.vertices, points.size() <= few ? std::span(met) : surface.triangles);
    std::vector<std::uint8_t> wrong(points.size());
    Stage stage(progress, "parts enclosed", points.size());
    for_chunks(points.size(), grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) wrong[i] = rays.crossings(points[i]) != wanted;
        stage.advance(end - begin);
    });
    for (std::size_t i = 0; i < points.size(); ++i)
        if (wrong[i]) result.wrong.push_back(points[i]);
    return result;
}

}  // namespace its::surface
