#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polyhedron_3.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <vector>

#include "peer_inside.h"

namespace its::bench {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;

class CgalSide : public InsidePeer {
public:
    explicit CgalSide(const Mesh& mesh) {
        std::vector<CGAL::Surface_mesh<Point>::Vertex_index> vertex;
        for (const Vec3& v : mesh.vertices) vertex.push_back(mesh_.add_vertex({v.x, v.y, v.z}));
        for (const Triangle& t : mesh.triangles) mesh_.add_face(vertex[t[0]], vertex[t[1]], vertex[t[2]]);
        side_ = std::make_unique<CGAL::Side_of_triangle_mesh<CGAL::Surface_mesh<Point>, Kernel>>(mesh_);
    }

    void classify(std::span<const Vec3> points, std::span<std::int8_t> out) const override {
        for (std::size_t i = 0; i < points.size(); ++i) {
            const CGAL::Bounded_side side = (*side_)(Point(points[i].x, points[i].y, points[i].z));
            out[i] = std::int8_t(-int(side));
        }
    }

private:
    CGAL::Surface_mesh<Point> mesh_;
    std::unique_ptr<CGAL::Side_of_triangle_mesh<CGAL::Surface_mesh<Point>, Kernel>> side_;
};

}  // namespace

std::unique_ptr<InsidePeer> cgal_side(const Mesh& mesh) {
    return std::make_unique<CgalSide>(mesh);
}

}  // namespace its::bench
