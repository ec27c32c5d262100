#include "picture/normals.h"

#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "geometry/vec3.h"

namespace its {
namespace {

Vec3 unit_or_up(const Vec3& v) {
    const double length = norm(v);
    return length > 0 && std::isfinite(length) ? (1 / length) * v : Vec3{0, 0, 1};
}

/// The triangles around each vertex: triangle[first[v] … first[v + 1]).
struct Fans {
    std::vector<std::uint32_t> first, triangle;

    explicit Fans(const Mesh& mesh) : first(mesh.vertices.size() + 1), triangle(3 * mesh.triangles.size()) {
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t v : t) ++first[v + 1];
        for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
        std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            for (const std::uint32_t v : mesh.triangles[t]) triangle[next[v]++] = std::uint32_t(t);
    }
};

}  // namespace

Vec3 area_vector(const Mesh& mesh, const Triangle& t) {
    const Vec3& a = mesh.vertices[t[0]];
    return cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
}

std::vector<std::array<Vec3, 3>> shading_normals(const Mesh& mesh, double crease) {
    const double least_cosine = std::cos(crease * std::numbers::pi / 180);
    const Fans fans(mesh);
    std::vector<Vec3> weighted(mesh.triangles.size()), unit(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        weighted[t] = area_vector(mesh, mesh.triangles[t]);
        unit[t] = unit_or_up(weighted[t]);
    }
    std::vector<std::array<Vec3, 3>> normals(mesh.triangles.size());
    parallel_for(normals.size(), 4096, [&](std::uint64_t t) {
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t v = mesh.triangles[t][i];
            Vec3 sum;
            for (std::uint32_t k = fans.first[v]; k < fans.first[v + 1]; ++k) {
                const std::uint32_t other = fans.triangle[k];
                if (dot(unit[t], unit[other]) >= least_cosine) sum = sum + weighted[other];
            }
            normals[t][i] = unit_or_up(sum);
        }
    });
    return normals;
}

}  // namespace its
