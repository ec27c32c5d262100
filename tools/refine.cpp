// Makes a large mesh of a small one: every triangle is cut into four, and the new vertices are moved along the
// surface's normal by a random part of their edge. Usage: refine MESH OUT LEVELS [SEED]
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>

#include "its/mesh.h"
#include "its/mesh_file.h"
#include "main.h"

namespace {

using its::Mesh;
using its::Triangle;
using its::Vec3;

constexpr double displacement = 0.03;  // of an edge: bumps without overlaps

Vec3 area_vector(const Mesh& mesh, const Triangle& t) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 u{b.x - a.x, b.y - a.y, b.z - a.z}, v{c.x - a.x, c.y - a.y, c.z - a.z};
    return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

Mesh refined(const Mesh& mesh, std::mt19937_64& random) {
    struct Middle {
        std::uint32_t vertex;
        Vec3 normal{};
    };
    Mesh result;
    result.vertices = mesh.vertices;
    std::map<std::pair<std::uint32_t, std::uint32_t>, Middle> middles;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 normal = area_vector(mesh, t);
        std::uint32_t middle[3];
        for (std::size_t k = 0; k < 3; ++k) {
            const auto ends = std::minmax(t[k], t[(k + 1) % 3]);
            const auto [it, is_new] = middles.try_emplace(ends, Middle{std::uint32_t(result.vertices.size())});
            if (is_new) {
                const Vec3 &p = mesh.vertices[ends.first], &q = mesh.vertices[ends.second];
                result.vertices.push_back({0.5 * (p.x + q.x), 0.5 * (p.y + q.y), 0.5 * (p.z + q.z)});
            }
            for (int axis = 0; axis < 3; ++axis) it->second.normal[axis] += normal[axis];
            middle[k] = it->second.vertex;
        }
        result.triangles.push_back({t[0], middle[0], middle[2]});
        result.triangles.push_back({t[1], middle[1], middle[0]});
        result.triangles.push_back({t[2], middle[2], middle[1]});
        result.triangles.push_back({middle[0], middle[1], middle[2]});
    }
    for (const auto& [ends, middle] : middles) {
        const Vec3 &p = mesh.vertices[ends.first], &q = mesh.vertices[ends.second], n = middle.normal;
        const double length = std::hypot(n.x, n.y, n.z), edge = std::hypot(p.x - q.x, p.y - q.y, p.z - q.z);
        const double part = double(random() >> 11) * 0x1p-53;  // in [0, 1), the same for every library
        const double by = length > 0 ? displacement * (2 * part - 1) * edge / length : 0.0;
        for (int axis = 0; axis < 3; ++axis) result.vertices[middle.vertex][axis] += by * n[axis];
    }
    return result;
}

int run(int argc, char** argv) {
    if (argc < 4 || argc > 5) throw its::OptionError("a mesh, an output and a number of levels are needed");
    std::mt19937_64 random(argc == 5 ? std::stoull(argv[4]) : 1);
    Mesh mesh = its::read_mesh(argv[1]).mesh;
    for (int level = std::stoi(argv[3]); level > 0; --level) mesh = refined(mesh, random);
    its::write_mesh(mesh, argv[2]);
    std::printf("%zu triangles\n", mesh.triangles.size());
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv, "refine MESH OUT LEVELS [SEED]", run);
}
