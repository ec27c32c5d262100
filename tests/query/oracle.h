#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/query.h"
#include "octree/lattice.h"

/// What query tests share: the side of a point from all triangles, and points where it is hard to tell.
namespace its::test {

/// By exact predicates over all triangles and a segment to a random far point, another one if it meets an
/// edge or vertex.
Side brute_force_side(const Mesh& mesh, const Vec3& point, SignRule rule);

/// The winding number of a point that is not on the surface of a closed mesh, in the same way.
std::int64_t brute_force_winding(const Mesh& mesh, const Vec3& point);

/// Points of every kind: uniform in and around the root; vertices, midpoints, points of triangles; lattice
/// points, and points on lattice lines and planes, near M; points 1e-3 cells off M; each also moved by one unit
/// in the last place. `count` of each kind, deterministic.
std::vector<Vec3> hard_points(const ThinShell& shell, const Mesh& mesh, int count, std::uint64_t seed);

/// Fixed: of points, and of the mesh in general.
struct NamedMesh {
    std::string name;
    Mesh mesh;
};

/// Closed meshes that try the sign rule: on the lattice, nested, overlapping, duplicated, inverted, degenerate.
std::vector<NamedMesh> closed_meshes();

}  // namespace its::test
