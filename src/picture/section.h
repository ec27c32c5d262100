#pragma once

#include <array>
#include <vector>

#include "geometry/vec3.h"
#include "mesh/arrays.h"
#include "picture/canvas.h"
#include "shell/shell_data.h"

/// What a plane cuts out of a shell.
namespace its::picture {

/// The plane n·x = offset, with `right` and `up` as the axes of its picture; all three are unit vectors, at
/// right angles. With the coordinate axes as vectors all of the arithmetic below is exact.
struct Plane {
    Vec3 normal{0, 0, 1}, right{1, 0, 0}, up{0, 1, 0};
    double offset = 0;

    double height(const Vec3& v) const { return dot(normal, v); }
    Point2 project(const Vec3& v) const { return {dot(right, v), dot(up, v)}; }
    Vec3 lift(const Point2& p) const { return offset * normal + (p.x * right + p.y * up); }
};

/// The plane across coordinate `axis`, offset 0. z lies upwards in the picture, or y if z is the normal.
Plane axis_plane(int axis);

/// The plane with this normal, seen from the side the normal points to, offset 0. `right` is horizontal, at
/// right angles to z. Precondition: finite, not zero.
Plane normal_plane(const Vec3& normal);

/// The extent of the mesh's triangles along the plane's axes: x right, y up, z the height.
Box extent(const mesh::Arrays& mesh, const Plane& plane);

/// The mesh's section, one segment for each triangle that the plane cuts, in mesh units and in the order of the
/// triangles. The plane is taken as displaced infinitesimally towards `middle`, a height, so that a face in the
/// plane shows as its outline.
std::vector<Segment> mesh_section(const mesh::Arrays& mesh, const Plane& plane, double middle);

/// A leaf of the octree that the plane cuts: a convex polygon of 3 to 6 corners, in mesh units.
struct CellSection {
    std::array<Point2, 6> corner;
    int corners = 0;
    double width = 0;  ///< of the cell
};

/// The leaf cells that have corners on both sides of the plane; corners on it count as below.
std::vector<CellSection> cell_section(const shell::ShellData& shell, const Plane& plane);

}  // namespace its::picture
