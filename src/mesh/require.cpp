#include "mesh/require.h"
#include "mesh/arrays.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace its::mesh {

namespace {

bool within(const Vec3& p, double largest) {
    return std::abs(p.x) <= largest && std::abs(p.y) <= largest && std::abs(p.z) <= largest;
}

[[noreturn]] void refuse_vertex(std::uint32_t v, double largest) {
    const std::string limit =
        largest < std::numeric_limits<double>::max() ? fmt::format(" of magnitude at most {:g}", largest) : "";
    throw InputError(fmt::format("vertex {} is not a finite point{}", v, limit));
}

}  // namespace

ITS_API void require_usable(const mesh::Arrays& mesh, double largest) {
    if (mesh.triangles.empty()) throw InputError("the mesh has no triangles");
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t v : mesh.triangles[i]) {
            if (v >= mesh.vertices.size())
                throw InputError(fmt::format("triangle {} uses vertex {} of {}", i, v, mesh.vertices.size()));
            if (!within(mesh.vertices[v], largest)) refuse_vertex(v, largest);
        }
}

}  // namespace its::mesh
