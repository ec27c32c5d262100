#include "surface/enclosure.h"

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "winding/x_rays.h"

namespace its::surface {

namespace {

constexpr std::uint64_t grain = 64;

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

}  // namespace

std::uint64_t count_parts(const shell::MeshArrays& mesh) {
    return one_vertex_each(mesh).size();
}

Enclosure enclosure(const shell::MeshArrays& mesh, const Mesh& surface, int wanted, const Progress& progress) {
    const std::vector<Vec3> points = one_vertex_each(mesh);
    Enclosure result{points.size(), {}};
    const winding::XRays rays(surface.vertices, surface.triangles);
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
