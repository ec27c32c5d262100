#include <initializer_list>
#include <limits>

#include "formats/writers.h"
#include "mesh/arrays.h"

namespace its::formats {

void write_ply(const mesh::Arrays& mesh, const VertexAttributes& attributes, bool single, Sink& file) {
    const auto& [colours, texture, normals, bytes] = attributes;
    // Signed indices are what most programs expect; they do for all but the largest meshes.
    const bool small = mesh.vertices.size() <= std::size_t{std::numeric_limits<std::int32_t>::max()};
    const auto put = [&](double x) { single ? file.raw(float(x)) : file.raw(x); };
    const auto put_vector = [&](const Vec3& v) { put(v.x), put(v.y), put(v.z); };
    const auto properties = [&](std::initializer_list<const char*> names) {
        for (const char* name : names) file << "property " << (single ? "float " : "double ") << name << "\n";
    };
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << std::uint64_t{mesh.vertices.size()}
         << "\n";
    properties({"x", "y", "z"});
    if (!normals.empty()) properties({"nx", "ny", "nz"});
    if (!colours.empty())
        for (const char* name : {"red", "green", "blue", "alpha"})
            file << "property " << (bytes ? "uchar " : "float ") << name << "\n";
    if (!texture.empty()) properties({"s", "t"});
    file << "element face " << std::uint64_t{mesh.triangles.size()} << "\nproperty list uchar "
         << (small ? "int" : "uint") << " vertex_indices\nend_header\n";
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        put_vector(mesh.vertices[i]);
        if (!normals.empty()) put_vector(normals[i]);
        if (!colours.empty())
            for (const float x : colours[i]) bytes ? file.raw(byte_of(x)) : file.raw(x);
        if (!texture.empty()) put(texture[i][0]), put(texture[i][1]);
    }
    for (const auto& [a, b, c] : mesh.triangles) file.raw(std::uint8_t{3}).raw(a).raw(b).raw(c);
}

}  // namespace its::formats
