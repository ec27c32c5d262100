#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "its/mesh.h"

/// Generated meshes that every test can use; deterministic.
namespace its::zoo {

Mesh tetrahedron();
/// Axis-aligned box, 12 triangles, outward.
Mesh box(const Vec3& min, const Vec3& max);
/// Icosahedron subdivided `level` times (20·4^level triangles), vertices on the sphere, outward.
Mesh sphere(const Vec3& centre, double radius, int level);
/// Torus around the z axis, `major_steps` × `minor_steps` quads, two triangles each.
Mesh torus(double major, double minor, int major_steps, int minor_steps);
/// A bumpy, twisted, closed genus-1 surface: the handsome one.
Mesh twisted_knot(int along, int around);
/// A sphere with a smaller, inward sphere inside: a cavity.
Mesh hollow_sphere(int level);
/// Two overlapping spheres in one mesh: self-intersecting, closed.
Mesh overlapping_spheres(int level);
/// A flat square of n × n quads, open.
Mesh sheet(int n);
Mesh moebius_strip(int n);
/// Random separate triangles in the unit cube.
Mesh soup(int triangles, std::uint64_t seed);
/// A closed plate 1 × 1 × thickness.
Mesh plate(double thickness);
Mesh single_triangle();
/// Zero-area triangles only: a point and a segment.
Mesh degenerate();

Mesh transformed(const Mesh& mesh, const double rotation[9], const Vec3& shift, double scale);
Mesh reversed(const Mesh& mesh);  ///< orientation flipped
Mesh joined(const Mesh& a, const Mesh& b);
Mesh shuffled(const Mesh& mesh, std::uint64_t seed);  ///< triangles in another order, corners rotated
/// `count` edges of random triangles are split in these only, by points exactly on them where doubles allow:
/// T-junctions. Edges that have been split may be split again.
Mesh split_on_one_side(const Mesh& mesh, int count, std::uint64_t seed);
/// Coordinates rounded to multiples of 2⁻²⁰ of the largest one or less, so that doubles hold points on edges.
Mesh snapped(const Mesh& mesh);
/// A slab 10 × 4 × 1 of 13 triangles, one of its edges split on one side only.
Mesh slab_t_junction();
/// The unit cube, an edge of whose triangles split on one side only.
Mesh cube_t_junction();

struct Entry {
    std::string name;
    Mesh mesh;
    bool closed_oriented;  ///< the winding rule applies
};

/// All of the above in moderate sizes.
std::vector<Entry> all();

/// Paths in the folder named by ITS_TEST_MESHES whose manifest status is "ok"; empty if it is not set.
std::vector<std::string> real_mesh_files();

}  // namespace its::zoo
