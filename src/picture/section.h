#pragma once

#include <vector>

#include "picture/canvas.h"
#include "shell/shell_data.h"

/// What a plane cuts out of a shell.
namespace its {

/// The plane where coordinate `axis` is `position`, with `right` and `up` as the axes of its picture.
struct Plane {
    int axis = 2, right = 0, up = 1;
    double position = 0;

    Point2 project(const Vec3& v) const { return {v[right], v[up]}; }
    Vec3 lift(const Point2& p) const {
        Vec3 v;
        v[axis] = position, v[right] = p.x, v[up] = p.y;
        return v;
    }
};

/// The plane at a fraction `at` of the mesh's bounds. z lies upwards in the picture, or y if z is the normal.
Plane make_plane(const Box& bounds, int axis, double at);

/// The mesh's section, one segment for each triangle that the plane cuts, in mesh units and in the order of the
/// triangles. The plane is taken as displaced infinitesimally towards the middle of the bounds, so that a face
/// in the plane shows as its outline.
std::vector<Segment> mesh_section(const Mesh& mesh, const Box& bounds, const Plane& plane);

/// A leaf of the octree that the plane cuts: its square, in mesh units.
struct CellSquare {
    Point2 min;
    double width;
};

/// The leaf cells cut by the plane (with the coordinate in [lower, upper) of the cell).
std::vector<CellSquare> cell_section(const ShellData& shell, const Plane& plane);

}  // namespace its
