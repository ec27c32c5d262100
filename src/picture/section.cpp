#include "picture/section.h"

#include <bit>
#include <cmath>
#include <utility>

namespace its {

Plane make_plane(const Box& bounds, int axis, double at) {
    Plane plane;
    plane.axis = axis;
    plane.right = axis == 0 ? 1 : 0;
    plane.up = axis == 2 ? 1 : 2;
    plane.position = std::lerp(bounds.min[axis], bounds.max[axis], at);
    return plane;
}

std::vector<Segment> mesh_section(const Mesh& mesh, const Box& bounds, const Plane& plane) {
    const double middle = bounds.min[plane.axis] + 0.5 * (bounds.max[plane.axis] - bounds.min[plane.axis]);
    const bool ties_above = plane.position > middle;
    const auto height = [&](std::uint32_t v) { return mesh.vertices[v][plane.axis]; };
    const auto above = [&](std::uint32_t v) {
        return height(v) > plane.position || (height(v) == plane.position && ties_above);
    };
    // From the lower index to the higher, so that both triangles at an edge get the same point.
    const auto cut = [&](std::uint32_t i, std::uint32_t j) {
        if (j < i) std::swap(i, j);
        const double t = (plane.position - height(i)) / (height(j) - height(i));
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

/// Walks down the octree along the plane.
struct CellWalk {
    const ShellData& shell;
    const Plane& plane;
    std::vector<CellSquare> squares;

    void group(int level, std::uint64_t index) {
        const Level& l = shell.octree.levels[std::size_t(level)];
        const Cell parent = morton_decode(l.parent[index]);
        std::uint64_t child_group = l.first[index];
        for (int child = 0; child < 8; ++child) {
            const bool marked = (l.mask[index] >> child & 1) != 0;
            const std::int64_t at[3] = {std::int64_t(2 * parent[0] + (child & 1)) << level,
                                        std::int64_t(2 * parent[1] + (child >> 1 & 1)) << level,
                                        std::int64_t(2 * parent[2] + (child >> 2)) << level};
            if (is_cut(at[plane.axis], level)) {
                if (marked && level > 0) {
                    group(level - 1, child_group);
                } else {
                    squares.push_back({{shell.lattice.position(plane.right, at[plane.right]),
                                        shell.lattice.position(plane.up, at[plane.up])},
                                       std::ldexp(shell.lattice.width, level)});
                }
            }
            child_group += marked;
        }
    }

    bool is_cut(std::int64_t lower, int level) const {
        return shell.lattice.position(plane.axis, lower) <= plane.position &&
               plane.position < shell.lattice.position(plane.axis, lower + (std::int64_t{1} << level));
    }
};

}  // namespace

std::vector<CellSquare> cell_section(const ShellData& shell, const Plane& plane) {
    CellWalk walk{shell, plane, {}};
    walk.group(shell.octree.depth, 0);
    return std::move(walk.squares);
}

}  // namespace its
