#include "mesh/require.h"
#include "mesh/arrays.h"

#include <fmt/format.h>

#include "geometry/vec3.h"

namespace its::mesh {

ITS_API void require_usable(const mesh::Arrays& mesh) {
    if (mesh.triangles.empty()) throw InputError("the mesh has no triangles");
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t v : mesh.triangles[i]) {
            if (v >= mesh.vertices.size())
                throw InputError(fmt::format("triangle {} uses vertex {} of {}", i, v, mesh.vertices.size()));
            if (!finite(mesh.vertices[v])) throw InputError(fmt::format("vertex {} is not a finite point", v));
        }
}

}  // namespace its::mesh
