#include "peer_simplify.h"

#include "its/stopwatch.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_policies.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Polyhedral_envelope_filter.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#ifdef ITS_BENCH_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

#include <cmath>
#include <stdexcept>
#include <vector>

namespace its::bench {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

Surface to_cgal(const Mesh& mesh) {
    Surface surface;
    std::vector<Surface::Vertex_index> vertex;
    for (const Vec3& v : mesh.vertices) vertex.push_back(surface.add_vertex({v.x, v.y, v.z}));
    for (const Triangle& t : mesh.triangles)
        if (surface.add_face(vertex[t[0]], vertex[t[1]], vertex[t[2]]) == Surface::null_face())
            throw std::runtime_error("not a manifold");
    return surface;
}

Mesh from_cgal(const Surface& surface) {
    Mesh mesh;
    std::vector<std::uint32_t> number(surface.num_vertices() + surface.number_of_removed_vertices());
    for (const auto v : surface.vertices()) {
        number[v] = std::uint32_t(mesh.vertices.size());
        const auto& p = surface.point(v);
        mesh.vertices.push_back({p.x(), p.y(), p.z()});
    }
    for (const auto f : surface.faces()) {
        Triangle t;
        std::size_t k = 0;
        for (const auto v : surface.vertices_around_face(surface.halfedge(f))) t[k++] = number[v];
        mesh.triangles.push_back(t);
    }
    return mesh;
}

template <class F>
double seconds_of(F&& fn) {
    const Stopwatch watch;
    fn();
    return watch.seconds();
}

// CGAL stops at a number of edges; a closed mesh of F triangles has 1.5 F.
auto stop_at(std::uint64_t faces) {
    return sms::Count_stop_predicate<Surface>(faces + faces / 2);
}

}  // namespace

PeerResult cgal_garland_heckbert(const Mesh& mesh, std::uint64_t faces) {
    Surface surface = to_cgal(mesh);
    const double seconds = seconds_of([&] {
        using Policies = sms::GarlandHeckbert_policies<Surface, Kernel>;
        Policies policies(surface);
        const sms::Bounded_normal_change_placement<Policies::Get_placement> placement(policies.get_placement());
        sms::edge_collapse(surface, stop_at(faces),
                           CGAL::parameters::get_cost(policies.get_cost()).get_placement(placement));
    });
    surface.collect_garbage();
    return {from_cgal(surface), seconds};
}

PeerResult cgal_lindstrom_turk(const Mesh& mesh, std::uint64_t faces) {
    Surface surface = to_cgal(mesh);
    const double seconds = seconds_of([&] { sms::edge_collapse(surface, stop_at(faces)); });
    surface.collect_garbage();
    return {from_cgal(surface), seconds};
}

PeerResult cgal_envelope(const Mesh& mesh, std::uint64_t faces, double distance) {
    Surface surface = to_cgal(mesh);
    const double seconds = seconds_of([&] {
        using Placement = sms::LindstromTurk_placement<Surface>;
        using Filter = sms::Polyhedral_envelope_filter<Kernel, sms::Bounded_normal_change_filter<>>;
        sms::edge_collapse(surface, stop_at(faces),
                           CGAL::parameters::get_cost(sms::LindstromTurk_cost<Surface>())
                               .filter(Filter(distance))
                               .get_placement(Placement()));
    });
    surface.collect_garbage();
    return {from_cgal(surface), seconds};
}

#ifdef ITS_BENCH_MESHOPTIMIZER
PeerResult meshoptimizer(const Mesh& mesh, std::uint64_t faces) {
    std::vector<float> positions;
    for (const Vec3& v : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) positions.push_back(float(v[axis]));
    std::vector<unsigned int> indices, result(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    std::size_t count = 0;
    const double seconds = seconds_of([&] {
        count = meshopt_simplify(result.data(), indices.data(), indices.size(), positions.data(),
                                 mesh.vertices.size(), 12, 3 * faces, 1.0f, 0, nullptr);
    });
    PeerResult peer{{mesh.vertices, {}}, seconds};
    for (std::size_t i = 0; i < count; i += 3)
        peer.mesh.triangles.push_back({result[i], result[i + 1], result[i + 2]});
    return peer;
}
#endif

}  // namespace its::bench
