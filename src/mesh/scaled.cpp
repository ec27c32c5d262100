#include "mesh/scaled.h"

#include <fmt/format.h>

#include <algorithm>

#include "mesh/require.h"

namespace its::mesh {

double largest_coordinate(const Arrays& mesh) {
    require_usable(mesh);
    double largest = 0;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            largest = std::max(largest, geometry::largest_magnitude(mesh.vertices[v]));
    return largest;
}

Scaled::Scaled(const Arrays& mesh) : scaling_(geometry::scaling_for(mesh::largest_coordinate(mesh))) {
    scale(mesh);
    if (scaling_.exponent <= 0) return;  // upwards: exact
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            if (scaling_.out(vertices_[v]) != mesh.vertices[v])
                throw InputError(fmt::format(
                    "vertex {}: a coordinate of ({:.3g}, {:.3g}, {:.3g}) is too small beside the "
                    "mesh's largest, some {:.0e}, to compute with both; make it 0, or scale the "
                    "mesh down",
                    v, mesh.vertices[v].x, mesh.vertices[v].y, mesh.vertices[v].z, scaling_.out(1.0 / 2)));
}

Scaled::Scaled(const Arrays& mesh, geometry::Scaling scaling) : scaling_(scaling) {
    scale(mesh);
}

void Scaled::scale(const Arrays& mesh) {
    arrays_ = mesh;
    if (scaling_.exponent == 0) return;
    vertices_.reserve(mesh.vertices.size());
    for (const Vec3& v : mesh.vertices) vertices_.push_back(scaling_.in(v));
    arrays_.vertices = vertices_;
}

}  // namespace its::mesh
