#pragma once

#include <array>
#include <memory>
#include <string>

#include "its/mesh.h"

/// CGAL's second opinion, compiled once for all tests: what it instantiates takes longer to compile than all
/// tests together. Predicates are exact.
namespace its::cgal {

/// On which side of a closed mesh a point is, by counting crossings of a ray modulo 2.
class Sides {
public:
    explicit Sides(const Mesh& mesh);
    ~Sides();
    Sides(const Sides&) = delete;
    Sides& operator=(const Sides&) = delete;

    /// Whether CGAL takes the mesh: 2-manifold, consistently oriented and closed. If not, side() must not be
    /// called.
    bool usable() const;
    bool self_intersects() const;
    /// −1 inside, 0 on the mesh, 1 outside. May be called by several threads.
    int side(const Vec3& p) const;

private:
    struct Data;
    std::unique_ptr<Data> data_;
};

/// Distances to a mesh, in doubles.
class Distances {
public:
    explicit Distances(const Mesh& mesh);
    ~Distances();
    Distances(const Distances&) = delete;
    Distances& operator=(const Distances&) = delete;

    /// Whether CGAL takes the mesh: no triangle is degenerate.
    bool usable() const;
    double distance(const Vec3& p) const;

private:
    struct Data;
    std::unique_ptr<Data> data_;
};

using Corners = std::array<Vec3, 3>;
bool is_degenerate(const Corners& triangle);
/// Whether two triangles, none of them degenerate, share a point.
bool do_intersect(const Corners& s, const Corners& t);

/// What is wrong with a mesh that should be closed, 2-manifold (edges and vertices), without degenerate
/// triangles and self-intersections, and oriented so that its signed volume is positive; empty if nothing is.
std::string surface_defects(const Mesh& mesh);

/// Number of triangles of m that meet the surface.
std::size_t triangles_meeting(const Mesh& m, const Mesh& surface);

/// Number of vertices used by m's triangles that are not strictly inside the closed surface.
std::size_t vertices_not_inside(const Mesh& m, const Mesh& surface);

/// From a point to the nearest triangle, by looking at all of them.
double distance(const Vec3& p, const Mesh& mesh);

}  // namespace its::cgal
