#include <limits>

#include "formats/writers.h"
#include "geometry/vec3.h"
#include "mesh/arrays.h"

namespace its::formats {

void write_stl(const mesh::Arrays& mesh, Sink& file) {
    if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max()) {
        throw InputError("an STL file holds at most 4294967295 triangles; write .ply instead");
    }
    std::string header = "binary STL";  // must not begin with "solid"
    header.resize(80, ' ');
    file << header;
    file.raw(std::uint32_t(mesh.triangles.size()));
    const auto put = [&](Vec3 v) { file.raw(float(v.x)).raw(float(v.y)).raw(float(v.z)); };
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
        const Vec3 n = cross(b - a, c - a);
        const double length = norm(n);
        put(length > 0 && std::isfinite(length) ? (1 / length) * n : Vec3{});
        put(a), put(b), put(c);
        file.raw(std::uint16_t{0});
    }
}

}  // namespace its::formats
