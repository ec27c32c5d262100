#include "adaptive/windings.h"

#include <algorithm>

#include "geometry/predicates.h"

namespace its::adaptive {

namespace {

/// The three coordinates of the points along each axis.
using Planes = std::array<std::array<double, 3>, 3>;

/// What the winding number gains from point 0 to 1 and from 1 to 2 along lines: one along z, one along y from
/// each of its points, one along x from each of theirs.
struct Gains {
    std::int32_t z[2] = {}, y[3][2] = {}, x[9][2] = {};
};

void add_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Planes& planes, Gains& gains) {
    bool between[3][3];  // whether a line in this plane may meet the triangle, as line_crossing() has it
    for (int axis = 0; axis < 3; ++axis) {
        const double low = std::min({a[axis], b[axis], c[axis]}), high = std::max({a[axis], b[axis], c[axis]});
        for (int i = 0; i < 3; ++i) between[axis][i] = low <= planes[axis][i] && planes[axis][i] < high;
    }
    const auto cross = [&](int axis, int x, int y, int z, std::int32_t(&gain)[2]) {
        for (int i = 0; i < 2; ++i) {
            Vec3 from{planes[0][x], planes[1][y], planes[2][z]};
            from[axis] = planes[axis][i];
            gain[i] += geometry::line_crossing(axis, a, b, c, from, planes[axis][i + 1]);
        }
    };
    if (between[0][0] && between[1][0]) cross(2, 0, 0, 0, gains.z);
    for (int z = 0; z < 3; ++z) {
        if (!between[2][z]) continue;
        if (between[0][0]) cross(1, 0, 0, z, gains.y[z]);
        for (int y = 0; y < 3; ++y)
            if (between[1][y]) cross(0, 0, y, z, gains.x[y + 3 * z]);
    }
}

}  // namespace

std::array<std::int32_t, octree::group_points> windings_in_cell(
    const mesh::Arrays& mesh, const octree::Lattice& lattice, const std::array<std::int64_t, 3>& lowest,
    std::int64_t step, std::span<const std::uint32_t> list, std::int32_t of_lowest) {
    Planes planes;
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < 3; ++i)
            planes[std::size_t(axis)][std::size_t(i)] =
                lattice.position(axis, lowest[std::size_t(axis)] + i * step);
    Gains gains;
    for (const std::uint32_t number : list) {
        const Triangle& t = mesh.triangles[number];
        add_triangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], planes, gains);
    }
    std::array<std::int32_t, octree::group_points> winding;
    std::int32_t along_z = of_lowest;
    for (int z = 0; z < 3; ++z) {
        std::int32_t along_y = along_z;
        for (int y = 0; y < 3; ++y) {
            const std::size_t row = 3 * (std::size_t(y) + 3 * std::size_t(z));
            winding[row] = along_y;
            winding[row + 1] = winding[row] + gains.x[y + 3 * z][0];
            winding[row + 2] = winding[row + 1] + gains.x[y + 3 * z][1];
            if (y < 2) along_y += gains.y[z][y];
        }
        if (z < 2) along_z += gains.z[z];
    }
    return winding;
}

}  // namespace its::adaptive
