#include "query/oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "shell/access.h"
#include "shell/shell_data.h"
#include "support/zoo.h"

namespace its::test {

namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double from, double to) {
    return from + (to - from) * (double(random() >> 11) * 0x1p-53);
}

Vec3 uniform(Random& random, const Box& box) {
    return {uniform(random, box.min.x, box.max.x), uniform(random, box.min.y, box.max.y),
            uniform(random, box.min.z, box.max.z)};
}

/// Also the points next to it, one coordinate moved by one unit in the last place.
void add(std::vector<Vec3>& points, const Vec3& p, Random& random) {
    points.push_back(p);
    Vec3 q = p;
    const int axis = int(random() % 3);
    q[axis] = std::nextafter(q[axis], (random() & 1) != 0 ? 1e300 : -1e300);
    points.push_back(q);
}

}  // namespace

Side brute_force_side(const Mesh& mesh, const Vec3& point, SignRule rule) {
    const auto corner = [&](const Triangle& t, int i) { return mesh.vertices[t[std::size_t(i)]]; };
    bool meets = false;
    for (const Triangle& t : mesh.triangles) {
        geometry::segment_crossing(corner(t, 0), corner(t, 1), corner(t, 2), point, point, meets);
        if (meets) return Side::on_surface;
    }
    if (rule == SignRule::unsigned_rule) return Side::outside;
    const std::int64_t winding = brute_force_winding(mesh, point);
    if (rule == SignRule::even_odd) return winding % 2 != 0 ? Side::inside : Side::outside;
    return winding >= 1 ? Side::inside : Side::outside;
}

std::int64_t brute_force_winding(const Mesh& mesh, const Vec3& point) {
    const auto corner = [&](const Triangle& t, int i) { return mesh.vertices[t[std::size_t(i)]]; };
    const Box box = octree::bounds(mesh);
    const double size = norm(box.max - box.min) + norm(point - box.min) + norm(box.min);
    Random random(99);
    for (int attempt = 0; attempt < 100; ++attempt) {
        const Vec3 far = point + (100 * size) * Vec3{uniform(random, -1, 1), uniform(random, -1, 1),
                                                     (random() & 1) != 0 ? 1.0 : -1.0};
        std::int64_t gained = 0;
        bool degenerate = false;
        for (const Triangle& t : mesh.triangles) {
            bool meet = false;
            gained += geometry::segment_crossing(corner(t, 0), corner(t, 1), corner(t, 2), point, far, meet);
            degenerate |= meet;
        }
        if (!degenerate) return -gained;  // outside of all it is 0
    }
    throw Error("no segment avoids all edges");
}

std::vector<Vec3> hard_points(const ThinShell& shell, const Mesh& mesh, int count, std::uint64_t seed) {
    Random random(seed);
    const octree::Lattice& lattice = shell::Access::data(shell).lattice;
    const Box root = shell.info().root, box = octree::bounds(mesh);
    const Vec3 size = root.max - root.min;
    std::vector<Vec3> points;
    for (int i = 0; i < count; ++i) {
        points.push_back(uniform(random, box));
        points.push_back(uniform(random, root));
        points.push_back(uniform(random, {root.min - size, root.max + size}));

        const Triangle& t = mesh.triangles[random() % mesh.triangles.size()];
        const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
        add(points, a, random);
        add(points, 0.5 * (a + b), random);
        add(points, a + uniform(random, 0, 1) * (b - a), random);
        double s = uniform(random, 0, 1), r = uniform(random, 0, 1);
        if (s + r > 1) s = 1 - s, r = 1 - r;
        const Vec3 on = a + s * (b - a) + r * (c - a);
        add(points, on, random);
        add(points, 0.25 * (a + a + b + c), random);
        const double off = 1e-3 * lattice.width;
        points.push_back(
            on + Vec3{uniform(random, -off, off), uniform(random, -off, off), uniform(random, -off, off)});

        // Near a point of M: a lattice point, and points of which one or two coordinates are on the lattice.
        std::array<std::int64_t, 3> near;
        for (int axis = 0; axis < 3; ++axis)
            near[std::size_t(axis)] = std::clamp<std::int64_t>(
                std::llround(lattice.to_lattice(on)[axis]) + std::int64_t(random() % 3) - 1, 0,
                lattice.cells());
        const Vec3 g = lattice.position(near);
        add(points, g, random);
        for (const unsigned axes : {1u, 2u, 4u, 3u, 5u, 6u}) {
            Vec3 p = g;
            for (int axis = 0; axis < 3; ++axis)
                if (axes >> axis & 1) p[axis] = on[axis] + uniform(random, -lattice.width, lattice.width);
            add(points, p, random);
        }
    }
    return points;
}

std::vector<NamedMesh> closed_meshes() {
    using zoo::box, zoo::joined;
    std::vector<NamedMesh> meshes;
    for (zoo::Entry& entry : zoo::all())
        if (entry.closed_oriented) meshes.push_back({entry.name, std::move(entry.mesh)});
    const Mesh unit = box({0, 0, 0}, {1, 1, 1});
    meshes.push_back({"unit box", unit});
    meshes.push_back({"unit box twice", joined(unit, unit)});
    meshes.push_back({"unit box and its inverse", joined(unit, zoo::reversed(unit))});
    meshes.push_back({"unit box inverted", zoo::reversed(unit)});
    meshes.push_back({"boxes that share a face", joined(unit, box({1, 0, 0}, {2, 1, 1}))});
    meshes.push_back({"boxes that share an edge", joined(unit, box({1, 1, 0}, {2, 2, 1}))});
    meshes.push_back({"overlapping boxes", joined(unit, box({0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}))});
    meshes.push_back({"three boxes nested", joined(joined(unit, box({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75})),
                                                   box({0.375, 0.375, 0.375}, {0.5, 0.5, 0.5}))});
    meshes.push_back({"cavity in a doubled box",
                      joined(joined(unit, unit), zoo::reversed(box({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75})))});
    meshes.push_back({"spheres, one thrice",
                      joined(joined(zoo::sphere({0, 0, 0}, 1, 2), zoo::sphere({0, 0, 0}, 1, 2)),
                             joined(zoo::sphere({0, 0, 0}, 1, 2), zoo::sphere({0.5, 0.1, 0}, 1, 2)))});
    Mesh needles = zoo::sphere({0, 0, 0}, 1, 2);  // with degenerate triangles, closed in themselves
    needles.vertices.push_back({2, 0.5, 0.5});
    needles.vertices.push_back({2, 1.5, 0.25});
    const auto v = std::uint32_t(needles.vertices.size());
    needles.triangles.push_back({v - 2, v - 1, v - 2});
    needles.triangles.push_back({v - 1, v - 1, v - 1});
    needles.triangles.push_back({0, 0, v - 1});
    needles.triangles.push_back({0, v - 1, 0});
    meshes.push_back({"sphere with segments", needles});
    meshes.push_back({"slab with a T-junction", zoo::slab_t_junction()});
    meshes.push_back({"cube with a T-junction", zoo::cube_t_junction()});
    meshes.push_back({"box with T-junctions", zoo::split_on_one_side(unit, 40, 3)});
    meshes.push_back(
        {"torus with T-junctions", zoo::split_on_one_side(zoo::snapped(zoo::torus(1, 0.35, 24, 12)), 300, 4)});
    return meshes;
}

}  // namespace its::test
