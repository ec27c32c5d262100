#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include "peer_surfaces.h"

namespace its::bench {

PeerSurface alpha_wrap(const Mesh& mesh, double alpha, double offset) {
    using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
    std::vector<Kernel::Point_3> points;
    std::vector<std::array<std::size_t, 3>> faces;
    for (const Vec3& v : mesh.vertices) points.emplace_back(v.x, v.y, v.z);
    for (const Triangle& t : mesh.triangles) faces.push_back({t[0], t[1], t[2]});
    CGAL::Surface_mesh<Kernel::Point_3> wrap;
    const Timer timer;
    CGAL::alpha_wrap_3(points, faces, alpha, offset, wrap);
    PeerSurface result;
    result.seconds = timer.seconds();
    for (const auto v : wrap.vertices()) {
        const auto p = wrap.point(v);
        result.mesh.vertices.push_back({p.x(), p.y(), p.z()});
    }
    for (const auto f : wrap.faces()) {
        Triangle t;
        std::size_t i = 0;
        for (const auto v : wrap.vertices_around_face(wrap.halfedge(f))) t[i++] = std::uint32_t(v);
        result.mesh.triangles.push_back(t);
    }
    return result;
}

}  // namespace its::bench
