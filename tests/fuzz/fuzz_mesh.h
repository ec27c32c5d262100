#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "formats/readers.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/mesh_file.h"

namespace its::fuzz {

/// Parses bytes: an InputError, or a mesh that holds what MeshFile promises.
template <class Parse>
int check_reader(Parse parse, const std::uint8_t* data, std::size_t size) {
    try {
        const MeshFile file = parse(std::string_view(reinterpret_cast<const char*>(data), size));
        if (file.mesh.triangles.empty() || file.format.empty()) std::abort();
        for (const Vec3& v : file.mesh.vertices) {
            if (!finite(v)) std::abort();
        }
        for (const Triangle& t : file.mesh.triangles) {
            for (const std::uint32_t v : t) {
                if (v >= file.mesh.vertices.size()) std::abort();
            }
        }
        try {
            check_attributes(file.mesh, file.attributes);
        } catch (const InputError&) {
            std::abort();
        }
        if (file.mesh.triangles.size() < 4096 && inspect(file.mesh).triangles != file.mesh.triangles.size())
            std::abort();
    } catch (const InputError&) {
    }
    return 0;
}

}  // namespace its::fuzz
