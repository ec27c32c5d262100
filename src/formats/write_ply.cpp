#include <limits>

#include "formats/writers.h"
#include "mesh/arrays.h"

namespace its::formats {

void write_ply(const mesh::Arrays& mesh, const VertexAttributes& attributes, NewFile& file) {
    const auto& [colours, texture, normals, bytes] = attributes;
    // Signed indices are what most programs expect; they do for all but the largest meshes.
    const bool small = mesh.vertices.size() <= std::size_t{std::numeric_limits<std::int32_t>::max()};
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << std::uint64_t{mesh.vertices.size()}
         << "\nproperty double x\nproperty double y\nproperty double z\n";
    if (!normals.empty()) file << "property double nx\nproperty double ny\nproperty double nz\n";
    if (!colours.empty())
        for (const char* name : {"red", "green", "blue", "alpha"})
            file << "property " << (bytes ? "uchar " : "float ") << name << "\n";
    if (!texture.empty()) file << "property double s\nproperty double t\n";
    file << "element face " << std::uint64_t{mesh.triangles.size()} << "\nproperty list uchar "
         << (small ? "int" : "uint") << " vertex_indices\nend_header\n";
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3& v = mesh.vertices[i];
        file.raw(v.x).raw(v.y).raw(v.z);
        if (!normals.empty()) file.raw(normals[i].x).raw(normals[i].y).raw(normals[i].z);
        if (!colours.empty())
            for (const float x : colours[i]) bytes ? file.raw(byte_of(x)) : file.raw(x);
        if (!texture.empty()) file.raw(texture[i][0]).raw(texture[i][1]);
    }
    for (const auto& [a, b, c] : mesh.triangles) file.raw(std::uint8_t{3}).raw(a).raw(b).raw(c);
}

}  // namespace its::formats
