#include "mesh/merged.h"

#include <fmt/format.h>

#include <limits>

#include "geometry/vec3.h"
#include "mesh/points.h"

namespace its {

Merged merge(const Mesh& mesh) {
    constexpr std::uint32_t unknown = std::numeric_limits<std::uint32_t>::max();
    if (mesh.triangles.empty()) throw InputError("the mesh has no triangles");
    if (mesh.vertices.size() >= unknown) throw InputError("the mesh has more than 4294967294 vertices");
    PointIndex index(std::min(mesh.vertices.size(), 3 * mesh.triangles.size()));
    std::vector<std::uint32_t> number(mesh.vertices.size(), unknown);
    Merged merged;
    merged.triangles.reserve(mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        Triangle t = mesh.triangles[i];
        for (std::uint32_t& v : t) {
            if (v >= mesh.vertices.size()) {
                throw InputError(fmt::format("triangle {} uses vertex {} of {}", i, v, mesh.vertices.size()));
            }
            if (number[v] == unknown) {
                if (!finite(mesh.vertices[v]))
                    throw InputError(fmt::format("vertex {} is not a finite point", v));
                number[v] = index.insert(mesh.vertices[v]);
            }
            v = number[v];
        }
        merged.triangles.push_back(t);
    }
    merged.points = index.points();
    return merged;
}

}  // namespace its
