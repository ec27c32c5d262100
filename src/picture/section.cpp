#include "picture/section.h"
#include "geometry/box.h"
#include "mesh/arrays.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace its::picture {

Plane axis_plane(int axis) {
    constexpr Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    return axis == 0 ? Plane{x, y, z} : axis == 1 ? Plane{y, x, z} : Plane{z, x, y};
}

Plane normal_plane(const Vec3& normal) {
    const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
    const Vec3 scaled{normal.x / largest, normal.y / largest,
                      normal.z / largest};  // its square cannot overflow
    Plane plane;
    plane.normal = (1 / norm(scaled)) * scaled;
    const Vec3 horizontal = cross({0, 0, 1}, plane.normal);
    if (horizontal != Vec3{}) plane.right = (1 / norm(horizontal)) * horizontal;
    plane.up = cross(plane.normal, plane.right);
    return plane;
}

Box extent(const mesh::Arrays& mesh, const Plane& plane) {
    Box box = geometry::empty_box;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) {
            const Point2 p = plane.project(mesh.vertices[v]);
            geometry::extend(box, Vec3{p.x, p.y, plane.height(mesh.vertices[v])});
        }
    return box;
}

std::vector<Segment> mesh_section(const mesh::Arrays& mesh, const Plane& plane, double middle) {
    const bool ties_above = plane.offset > middle;
    const auto height = [&](std::uint32_t v) { return plane.height(mesh.vertices[v]); };
    const auto above = [&](std::uint32_t v) {
        return height(v) > plane.offset || (height(v) == plane.offset && ties_above);
    };
    // From the lower index to the higher, so that both triangles at an edge get the same point.
    const auto cut = [&](std::uint32_t i, std::uint32_t j) {
        if (j < i) std::swap(i, j);
        const double t = (plane.offset - height(i)) / (height(j) - height(i));
        const Point2 a = plane.project(mesh.vertices[i]), b = plane.project(mesh.vertices[j]);
        return Point2{std::lerp(a.x, b.x, t), std::lerp(a.y, b.y, t)};
    };

    std::vector<Segment> segments;
    for (const Triangle& t : mesh.triangles) {
        Point2 end[2];
        int ends = 0;
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t from = t[std::size_t(i)], to = t[std::size_t((i + 1) % 3)];
            if (above(from) != above(to)) end[ends++] = cut(from, to);  // none or two of the three
        }
        if (ends == 2) segments.push_back({end[0], end[1]});
    }
    return segments;
}

namespace {

/// The polygon in which the plane cuts a box; no corners if all of the box is on one side.
CellSection cut_box(const Vec3& min, const Vec3& max, const Plane& plane) {
    Vec3 corner[8];
    double above[8];  // heights above the plane
    for (int i = 0; i < 8; ++i) {
        corner[i] = {i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z};
        above[i] = plane.height(corner[i]) - plane.offset;
    }
    CellSection section;
    Point2 centre;
    for (int i = 0; i < 8; ++i)
        for (const int j : {i | 1, i | 2, i | 4}) {
            if (j == i || (above[i] > 0) == (above[j] > 0)) continue;
            const double t = above[i] / (above[i] - above[j]);
            const Point2 p = plane.project((1 - t) * corner[i] + t * corner[j]);
            section.corner[std::size_t(section.corners++)] = p;  // a plane cuts at most six edges of a box
            centre = {centre.x + p.x, centre.y + p.y};
        }
    if (section.corners == 0) return section;
    centre = {centre.x / section.corners, centre.y / section.corners};
    const auto angle = [&](const Point2& p) { return std::atan2(p.y - centre.y, p.x - centre.x); };
    const auto begin = section.corner.begin();
    for (auto i = begin; i != begin + section.corners; ++i)  // insertion sort
        std::rotate(std::upper_bound(begin, i, *i, [&](auto& a, auto& b) { return angle(a) < angle(b); }), i,
                    i + 1);
    section.width = max.x - min.x;
    return section;
}

/// Walks down the octree along the plane.
struct CellWalk {
    const shell::ShellData& shell;
    const Plane& plane;
    std::vector<CellSection> sections;

    void group(int level, std::uint64_t index) {
        const octree::Level& l = shell.octree.levels[std::size_t(level)];
        const octree::Cell parent = octree::morton_decode(l.parent[index]);
        std::uint64_t child_group = l.first[index];
        for (int child = 0; child < 8; ++child) {
            const bool marked = (l.mask[index] >> child & 1) != 0;
            const std::array<std::int64_t, 3> low = {std::int64_t(2 * parent[0] + (child & 1)) << level,
                                                     std::int64_t(2 * parent[1] + (child >> 1 & 1)) << level,
                                                     std::int64_t(2 * parent[2] + (child >> 2)) << level};
            const std::int64_t side = std::int64_t{1} << level;
            const CellSection section =
                cut_box(shell.lattice.position(low),
                        shell.lattice.position({low[0] + side, low[1] + side, low[2] + side}), plane);
            if (section.corners > 0) {
                if (marked && level > 0) {
                    group(level - 1, child_group);
                } else {
                    sections.push_back(section);
                }
            }
            child_group += marked;
        }
    }
};

}  // namespace

std::vector<CellSection> cell_section(const shell::ShellData& shell, const Plane& plane) {
    CellWalk walk{shell, plane, {}};
    walk.group(shell.octree.depth, 0);
    return std::move(walk.sections);
}

}  // namespace its::picture
