#include "shell/triangle_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/rounding.h"
#include "geometry/bernstein.h"
#include "geometry/clip.h"
#include "geometry/vec3.h"
#include "octree/voxelise.h"

namespace its::shell {

namespace {

/// Undecided pieces are cut in four this many times at most: the gap falls by four each time.
constexpr int max_halvings = 6;

/// f at the corners of a lattice cell on which it is trilinear, in finest cell widths.
struct CellValues {
    std::array<double, 8> value;
    double slope = 0, largest = 0;  ///< steepest change along an edge, largest absolute value

    /// \param width  of the cell, at most that of the one that locate() found
    CellValues(const field::TrilinearCell& cell, const Vec3& corner, double width) {
        for (int c = 0; c < 8; ++c) {
            const Vec3 at = corner + width * Vec3{double(c & 1), double(c >> 1 & 1), double(c >> 2)};
            value[std::size_t(c)] =
                cell.width == width ? cell.value[c]
                                    : geometry::trilinear(cell.value, (1 / cell.width) * (at - cell.corner));
        }
        for (std::size_t c = 0; c < 8; ++c) {
            largest = std::max(largest, std::abs(value[c]));
            for (const std::size_t step : {1u, 2u, 4u})
                if ((c & step) == 0) slope = std::max(slope, std::abs(value[c | step] - value[c]));
        }
        if (cell.width == width) return;
        for (const double v : cell.value) largest = std::max(largest, std::abs(v));
    }
};

/// Whether f is proven to be in [lower, upper] on a piece of the triangle.
bool piece_in(const double* values, const geometry::Sample& p, const geometry::Sample& q,
              const geometry::Sample& r, double lower, double upper, int halvings) {
    const geometry::Bounds b = geometry::bernstein_bounds(values, p, q, r);
    if (b.lower >= lower && b.upper <= upper) return true;
    if (b.least < lower || b.most > upper || halvings == max_halvings) return false;
    const geometry::Sample pq = geometry::sample(values, 0.5 * (p.at + q.at)),
                           qr = geometry::sample(values, 0.5 * (q.at + r.at)),
                           rp = geometry::sample(values, 0.5 * (r.at + p.at));
    return piece_in(values, p, pq, rp, lower, upper, halvings + 1) &&
           piece_in(values, pq, q, qr, lower, upper, halvings + 1) &&
           piece_in(values, rp, qr, r, lower, upper, halvings + 1) &&
           piece_in(values, pq, qr, rp, lower, upper, halvings + 1);
}

}  // namespace

TriangleBounds::TriangleBounds(const ShellData& shell) : shell_(shell) {
    // As in extremes.cpp, whose proof holds for any triangle of the root cube.
    const double size = shell.lattice.cells();
    const double clipping =
        (geometry::cuts * geometry::roundings_per_cut + geometry::roundings_of_vertices) * unit_roundoff * size;
    margin_ = shell.lattice.point_error() + clipping;
    displacement_ = margin_ + clipping;
    dilation_ = shell.lattice.point_error() + 8 * unit_roundoff * size;
}

bool TriangleBounds::cell_in_shell(const Corners& t, const Vec3& corner, double width,
                                   const field::TrilinearCell& cell) const {
    geometry::Polygon polygon;
    const double scale = 1 / width;  // a power of two
    geometry::clip_to_cell(scale * (t.a - corner), scale * (t.b - corner), scale * (t.c - corner),
                           scale * margin_, polygon);
    if (polygon.size == 0) return true;
    const CellValues values(cell, corner, width);
    // γ of docs/design/extremes.md for this cell; in a coarser leaf the corner values err as an evaluation
    // does, and so does the shipped evaluation, in the leaf's own coordinates.
    const double gamma =
        4 * values.slope * (scale * displacement_ + 2 * max_halvings * unit_roundoff) +
        (3 * geometry::trilinear_roundings + geometry::control_roundings) * unit_roundoff * values.largest;
    const double lower = shell_.epsilon_inner + gamma, upper = shell_.epsilon_outer - gamma;
    const double* const v = values.value.data();
    const auto [least, most] = std::minmax_element(values.value.begin(), values.value.end());
    if (*least >= lower && *most <= upper)
        return true;  // all of the cell is inside; γ contains the margin by which the polygon reaches beyond it
    const geometry::Sample apex = geometry::sample(v, polygon.vertex(0));
    geometry::Sample last = geometry::sample(v, polygon.vertex(std::min(1, polygon.size - 1)));
    if (polygon.size < 3) return piece_in(v, apex, last, last, lower, upper, 0);
    for (int i = 2; i < polygon.size; ++i) {
        const geometry::Sample next = geometry::sample(v, polygon.vertex(i));
        if (!piece_in(v, apex, last, next, lower, upper, 0)) return false;
        last = next;
    }
    return true;
}

bool TriangleBounds::in_shell(const Vec3& a, const Vec3& b, const Vec3& c) const {
    const Corners t{shell_.lattice.to_lattice(a), shell_.lattice.to_lattice(b), shell_.lattice.to_lattice(c)};
    const double size = shell_.lattice.cells();
    std::array<std::int64_t, 3> low, high;
    double extent = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const auto [first, last] = std::minmax({t.a[axis], t.b[axis], t.c[axis]});
        if (!(first >= 1 && last <= size - 1)) return false;  // the shell is well inside the root cube
        low[std::size_t(axis)] = std::int64_t(std::floor(first - dilation_));
        high[std::size_t(axis)] = std::int64_t(std::floor(last + dilation_));
        extent = std::max(extent, double(high[std::size_t(axis)] - low[std::size_t(axis)] + 1));
    }
    int top = 0;
    while (double(std::int64_t{1} << top) < extent) ++top;

    // Cubes of 2^level cells a side, from at most two along each axis down to single cells.
    struct Cube {
        std::array<std::int64_t, 3> at;
        int level;
    };
    std::array<Cube, 8 + 8 * 32> stack;
    std::size_t count = 0;
    for (std::int64_t z = low[2] >> top; z <= high[2] >> top; ++z)
        for (std::int64_t y = low[1] >> top; y <= high[1] >> top; ++y)
            for (std::int64_t x = low[0] >> top; x <= high[0] >> top; ++x) stack[count++] = {{x, y, z}, top};
    while (count > 0) {
        const Cube cube = stack[--count];
        const double width = double(std::int64_t{1} << cube.level);
        const Vec3 corner{width * double(cube.at[0]), width * double(cube.at[1]), width * double(cube.at[2])};
        const Vec3 centre = corner + 0.5 * Vec3{width, width, width};
        const bool in_root = std::min({corner.x, corner.y, corner.z}) >= 0 &&
                             std::max({corner.x, corner.y, corner.z}) + width <= size;
        if (in_root && (cube.level == 0 || shell_.octree.adaptive())) {
            // One that is no smaller holds all of the cube, as both are lattice cells.
            const field::TrilinearCell cell = field::locate(shell_.octree, shell_.field, centre);
            if (cell.width >= width) {
                if (!cell_in_shell(t, corner, width, cell)) return false;
                continue;
            }
        }
        const unsigned met = octree::children_met(t.a, t.b, t.c, centre, 0.25 * width, dilation_, size);
        for (int child = 0; child < 8; ++child)
            if ((met >> child & 1) != 0)
                stack[count++] = {{2 * cube.at[0] + (child & 1), 2 * cube.at[1] + (child >> 1 & 1),
                                   2 * cube.at[2] + (child >> 2)},
                                  cube.level - 1};
    }
    return true;
}

}  // namespace its::shell
