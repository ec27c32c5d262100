#include "formats/writers.h"
#include "mesh/arrays.h"

namespace its::formats {

void write_obj(const mesh::Arrays& mesh, std::span<const Colour> colours,
               const CornerValues<TexturePoint>& texture, const CornerValues<Vec3>& normals, Sink& file) {
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3& v = mesh.vertices[i];
        file << "v " << v.x << " " << v.y << " " << v.z;
        if (!colours.empty()) file << " " << colours[i][0] << " " << colours[i][1] << " " << colours[i][2];
        file << "\n";
    }
    for (const TexturePoint& uv : texture.values) file << "vt " << uv[0] << " " << uv[1] << "\n";
    for (const Vec3& n : normals.values) file << "vn " << n.x << " " << n.y << " " << n.z << "\n";
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        file << "f";
        for (std::size_t k = 0; k < 3; ++k) {
            file << " " << std::uint64_t{mesh.triangles[t][k]} + 1;
            if (texture.empty() && normals.empty()) continue;
            file << "/";
            if (!texture.empty()) file << std::uint64_t{texture.corners[t][k]} + 1;
            if (!normals.empty()) file << "/" << std::uint64_t{normals.corners[t][k]} + 1;
        }
        file << "\n";
    }
}

}  // namespace its::formats
