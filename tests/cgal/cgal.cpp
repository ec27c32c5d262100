#include "cgal/cgal.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace its::cgal {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Primitive = CGAL::AABB_face_graph_triangle_primitive<SurfaceMesh>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
namespace pmp = CGAL::Polygon_mesh_processing;

Kernel::Point_3 point(const Vec3& v) {
    return {v.x, v.y, v.z};
}

std::vector<std::vector<std::size_t>> polygons(const Mesh& mesh) {
    std::vector<std::vector<std::size_t>> result;
    for (const Triangle& t : mesh.triangles) result.push_back({t[0], t[1], t[2]});
    return result;
}

SurfaceMesh surface_mesh(const Mesh& mesh) {
    std::vector<Kernel::Point_3> points;
    for (const Vec3& v : mesh.vertices) points.push_back(point(v));
    SurfaceMesh result;
    pmp::polygon_soup_to_polygon_mesh(points, polygons(mesh), result);
    return result;
}

/// From a vertex of the mesh: it may be far from the origin for its size.
double volume(const Mesh& mesh) {
    const Kernel::Point_3 origin = point(mesh.vertices[0]);
    double sum = 0;
    for (const Triangle& t : mesh.triangles)
        sum += CGAL::volume(origin, point(mesh.vertices[t[0]]), point(mesh.vertices[t[1]]),
                            point(mesh.vertices[t[2]]));
    return sum;
}

Kernel::Triangle_3 triangle(const Corners& corners) {
    return {point(corners[0]), point(corners[1]), point(corners[2])};
}

}  // namespace

struct Sides::Data {
    SurfaceMesh mesh;
    std::unique_ptr<CGAL::Side_of_triangle_mesh<SurfaceMesh, Kernel>> side = {};
};

Sides::Sides(const Mesh& mesh) : data_(std::make_unique<Data>()) {
    if (mesh.triangles.empty() || !pmp::is_polygon_soup_a_polygon_mesh(polygons(mesh))) return;
    data_->mesh = surface_mesh(mesh);
    if (!CGAL::is_closed(data_->mesh)) return;
    data_->side = std::make_unique<CGAL::Side_of_triangle_mesh<SurfaceMesh, Kernel>>(data_->mesh);
    side(mesh.vertices[0]);  // builds its tree before threads share it
}

Sides::~Sides() = default;

bool Sides::usable() const {
    return data_->side != nullptr;
}

bool Sides::self_intersects() const {
    return pmp::does_self_intersect(data_->mesh);
}

int Sides::side(const Vec3& p) const {
    const CGAL::Bounded_side side = (*data_->side)(point(p));
    return side == CGAL::ON_BOUNDED_SIDE ? -1 : side == CGAL::ON_BOUNDARY ? 0 : 1;
}

struct Distances::Data {
    using Cartesian = CGAL::Simple_cartesian<double>;
    using Triangles = std::vector<Cartesian::Triangle_3>;
    using Traits =
        CGAL::AABB_traits<Cartesian, CGAL::AABB_triangle_primitive<Cartesian, Triangles::const_iterator>>;

    static Cartesian::Point_3 point(const Vec3& v) { return {v.x, v.y, v.z}; }

    Triangles triangles;
    CGAL::AABB_tree<Traits> tree = {};
    bool usable = true;
};

Distances::Distances(const Mesh& mesh) : data_(std::make_unique<Data>()) {
    for (const Triangle& t : mesh.triangles) {
        data_->triangles.emplace_back(Data::point(mesh.vertices[t[0]]), Data::point(mesh.vertices[t[1]]),
                                      Data::point(mesh.vertices[t[2]]));
        data_->usable &= !data_->triangles.back().is_degenerate();
    }
    if (data_->usable) data_->tree.rebuild(data_->triangles.begin(), data_->triangles.end());
}

Distances::~Distances() = default;

bool Distances::usable() const {
    return data_->usable;
}

double Distances::distance(const Vec3& p) const {
    return std::sqrt(data_->tree.squared_distance(Data::point(p)));
}

bool is_degenerate(const Corners& corners) {
    return triangle(corners).is_degenerate();
}

bool do_intersect(const Corners& s, const Corners& t) {
    return CGAL::do_intersect(triangle(s), triangle(t));
}

std::string surface_defects(const Mesh& mesh) {
    if (mesh.triangles.empty()) return "empty";
    // False too for non-manifold edges and vertices, and inconsistent orientation.
    if (!pmp::is_polygon_soup_a_polygon_mesh(polygons(mesh))) return "not manifold";
    const SurfaceMesh surface = surface_mesh(mesh);
    if (num_vertices(surface) != mesh.vertices.size()) return "unused vertices";
    if (!CGAL::is_closed(surface)) return "not closed";
    for (const auto face : faces(surface))
        if (pmp::is_degenerate_triangle_face(face, surface)) return "degenerate triangle";
    if (pmp::does_self_intersect(surface)) return "self-intersecting";
    if (!(volume(mesh) > 0)) return "negative volume";
    return "";
}

std::size_t triangles_meeting(const Mesh& m, const Mesh& surface) {
    const SurfaceMesh s = surface_mesh(surface);
    Tree tree(faces(s).first, faces(s).second, s);
    std::size_t meeting = 0;
    for (const Triangle& t : m.triangles) {
        const Kernel::Triangle_3 whole = triangle({m.vertices[t[0]], m.vertices[t[1]], m.vertices[t[2]]});
        if (!whole.is_degenerate()) {
            meeting += tree.do_intersect(whole);
            continue;
        }
        for (int i = 0; i < 3; ++i) {
            const Kernel::Segment_3 side(whole[i], whole[i + 1]);
            if (!side.is_degenerate() && tree.do_intersect(side)) {
                ++meeting;
                break;
            }
        }
    }
    return meeting;
}

std::size_t vertices_not_inside(const Mesh& m, const Mesh& surface) {
    const SurfaceMesh s = surface_mesh(surface);
    const CGAL::Side_of_triangle_mesh<SurfaceMesh, Kernel> side(s);
    std::vector<bool> used(m.vertices.size(), false);
    for (const Triangle& t : m.triangles)
        for (const std::uint32_t v : t) used[v] = true;
    std::size_t outside = 0;
    for (std::size_t i = 0; i < used.size(); ++i)
        if (used[i]) outside += side(point(m.vertices[i])) != CGAL::ON_BOUNDED_SIDE;
    return outside;
}

double distance(const Vec3& p, const Mesh& mesh) {
    double least = 1e300;
    for (const Triangle& t : mesh.triangles)
        least = std::min(
            least, CGAL::to_double(CGAL::squared_distance(
                       point(p), Kernel::Triangle_3(point(mesh.vertices[t[0]]), point(mesh.vertices[t[1]]),
                                                    point(mesh.vertices[t[2]])))));
    return std::sqrt(least);
}

}  // namespace its::cgal
