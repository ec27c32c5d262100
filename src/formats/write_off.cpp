#include "formats/writers.h"
#include "mesh/arrays.h"

namespace its::formats {

void write_off(const mesh::Arrays& mesh, const VertexAttributes& attributes, Sink& file) {
    const auto& [colours, texture, normals, bytes] = attributes;
    file << (texture.empty() ? "" : "ST") << (colours.empty() ? "" : "C") << (normals.empty() ? "" : "N")
         << "OFF\n"
         << std::uint64_t{mesh.vertices.size()} << " " << std::uint64_t{mesh.triangles.size()} << " 0\n";
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3& v = mesh.vertices[i];
        file << v.x << " " << v.y << " " << v.z;
        if (!normals.empty()) file << " " << normals[i].x << " " << normals[i].y << " " << normals[i].z;
        if (!colours.empty())
            for (const float x : colours[i]) {
                if (bytes)
                    file << " " << std::uint64_t{byte_of(x)};
                else
                    file << " " << x;
            }
        if (!texture.empty()) file << " " << texture[i][0] << " " << texture[i][1];
        file << "\n";
    }
    for (const auto& [a, b, c] : mesh.triangles) {
        file << "3 " << std::uint64_t{a} << " " << std::uint64_t{b} << " " << std::uint64_t{c} << "\n";
    }
}

}  // namespace its::formats
