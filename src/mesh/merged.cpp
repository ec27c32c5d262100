#include "mesh/merged.h"

#include <limits>

#include "mesh/arrays.h"
#include "mesh/point_index.h"
#include "mesh/require.h"

namespace its::mesh {

Merged merge(const mesh::Arrays& mesh) {
    constexpr std::uint32_t unknown = std::numeric_limits<std::uint32_t>::max();
    if (mesh.vertices.size() >= unknown) throw InputError("the mesh has more than 4294967294 vertices");
    require_usable(mesh);
    PointIndex index(std::min(mesh.vertices.size(), 3 * mesh.triangles.size()));
    std::vector<std::uint32_t> number(mesh.vertices.size(), unknown);
    Merged merged;
    merged.triangles.reserve(mesh.triangles.size());
    for (Triangle t : mesh.triangles) {
        for (std::uint32_t& v : t) {
            if (number[v] == unknown) number[v] = index.insert(mesh.vertices[v]);
            v = number[v];
        }
        merged.triangles.push_back(t);
    }
    merged.points = index.points();
    return merged;
}

}  // namespace its::mesh
