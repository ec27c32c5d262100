#include "page/cluster.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "geometry/vec3.h"
#include "octree/lattice.h"

namespace its::page {
namespace {

Mesh on_grid(const Mesh& mesh, const Box& box, double cell) {
    Mesh out;
    std::unordered_map<std::uint64_t, std::uint32_t> number;
    std::vector<std::uint32_t> merged(mesh.vertices.size()), count;
    const auto place = [&](double v, double low) { return std::uint64_t((v - low) / cell); };  // < 2²¹
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) {
            if (merged[v] != 0) continue;
            const Vec3& p = mesh.vertices[v];
            const std::uint64_t key =
                place(p.x, box.min.x) | place(p.y, box.min.y) << 21 | place(p.z, box.min.z) << 42;
            const auto [entry, is_new] = number.try_emplace(key, std::uint32_t(out.vertices.size()));
            if (is_new) out.vertices.emplace_back(), count.push_back(0);
            const std::uint32_t n = entry->second;
            ++count[n];
            out.vertices[n] = out.vertices[n] + (1.0 / count[n]) * (p - out.vertices[n]);  // the mean so far
            merged[v] = n + 1;
        }
    for (const Triangle& t : mesh.triangles) {
        Triangle m = {merged[t[0]] - 1, merged[t[1]] - 1, merged[t[2]] - 1};
        if (m[0] == m[1] || m[1] == m[2] || m[2] == m[0]) continue;
        std::rotate(m.begin(), std::min_element(m.begin(), m.end()), m.end());
        out.triangles.push_back(m);
    }
    std::sort(out.triangles.begin(), out.triangles.end());
    out.triangles.erase(std::unique(out.triangles.begin(), out.triangles.end()), out.triangles.end());
    return out;
}

}  // namespace

Mesh cluster(const Mesh& mesh, std::uint64_t most) {
    if (mesh.triangles.size() <= most) return mesh;
    const Box box = octree::bounds(mesh);
    const Vec3 sides = box.max - box.min;
    const double longest = std::max({sides.x, sides.y, sides.z});
    Mesh coarse;
    for (int cells = 2048; cells >= 1; cells /= 2) {
        coarse = on_grid(mesh, box, longest / cells);
        if (coarse.triangles.size() <= most) break;
    }
    return coarse;
}

}  // namespace its::page
