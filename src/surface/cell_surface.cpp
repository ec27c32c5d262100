#include "surface/cell_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/predicates.h"
#include "geometry/triangle_pair.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"

namespace its::surface {

namespace {

/// Inner vertices stay this far, as a fraction of the way, from the cell's centre and from the corner.
constexpr double inner_clearance = 0.125;
constexpr int inner_halvings = 12;  // then the level is met to about 2⁻¹² of the difference between the ends

Vec3 corner_point(int c) {
    return {double(c & 1), double(c >> 1 & 1), double(c >> 2)};
}

constexpr Vec3 centre{0.5, 0.5, 0.5};

/// Where the function crosses the level between the centre and a corner, on the side that M is not on: by
/// bisection of a sign change between the two.
Vec3 inner_point(const std::array<double, 8>& value, const Crossing& crossing, SurfaceSide side, int c) {
    const Vec3 direction = corner_point(c) - centre;
    double near = 0, far = 1;  // the centre's side and the corner's side
    for (int i = 0; i < inner_halvings; ++i) {
        const double middle = 0.5 * (near + far);
        const bool below = geometry::trilinear(value.data(), centre + middle * direction) < 0;
        (below == crossing.centre_below ? near : far) = middle;
    }
    const bool want_below = side == SurfaceSide::inner;
    const double fraction = want_below == crossing.centre_below ? near : far;
    return centre + std::clamp(fraction, inner_clearance, 1 - inner_clearance) * direction;
}

/// How bad a value on a diagonal is, relative to the level.
double cost(double value, SurfaceSide side) {
    switch (side) {
        case SurfaceSide::outer:
            return -value;
        case SurfaceSide::inner:
            return value;
        case SurfaceSide::zero:
            break;
    }
    return std::abs(value);
}

/// The fan whose diagonals, at their middles, are worst off the least.
int best_apex(const Loop& loop, const CellSurface& surface, SurfaceSide side) {
    const int n = loop.size;
    double worst[6];
    std::fill(worst, worst + n, -std::numeric_limits<double>::infinity());
    for (int i = 0; i < n; ++i)
        for (int j = i + 2; j < n && j - i < n - 1; ++j) {
            const Vec3 middle =
                0.5 * (surface.at[loop.edge[std::size_t(i)]] + surface.at[loop.edge[std::size_t(j)]]);
            const double c = cost(geometry::trilinear(surface.value.data(), middle), side);
            worst[i] = std::max(worst[i], c);
            worst[j] = std::max(worst[j], c);
        }
    return int(std::min_element(worst, worst + n) - worst);
}

}  // namespace

Crossing crossing_of(const LevelCell& cell, double level, std::array<double, 8>& value) {
    for (std::size_t c = 0; c < 8; ++c) value[c] = cell.value[c] - level;
    return make_crossing(value);
}

Vec3 vertex_position(const Grid& grid, const octree::Cell& at, const std::array<double, 8>& value,
                     const Crossing& crossing, SurfaceSide side, int vertex) {
    Vec3 position;
    if (vertex >= first_inner) {
        const Vec3 local = inner_point(value, crossing, side, vertex - first_inner);
        for (int axis = 0; axis < 3; ++axis)
            position[axis] = grid.between(axis, at[std::size_t(axis)], local[axis]);
        return position;
    }
    const int start = edge_start(vertex), end = edge_end(vertex), along = vertex / 4;
    for (int axis = 0; axis < 3; ++axis)
        position[axis] = grid.position(axis, at[std::size_t(axis)] + (start >> axis & 1));
    const double fraction =
        crossing_fraction(value[std::size_t(start)], value[std::size_t(end)], grid.clearance);
    position[along] = grid.between(along, at[std::size_t(along)], fraction);
    return position;
}

bool star_is_embedded(const SurfaceFrame& frame, const LevelCell& cell) {
    CellSurface surface;
    make_cell_surface(frame, cell, surface);
    std::array<geometry::NumberedTriangle, Patch::capacity> triangle;
    const auto size = std::size_t(surface.patch.size);
    for (std::size_t t = 0; t < size; ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const int v = surface.patch.triangle[t][k];
            triangle[t].number[k] = std::uint32_t(v);
            triangle[t].corner[k] =
                vertex_position(frame.grid, cell.at, surface.value, surface.crossing, frame.side, v);
        }
        const auto& [a, b, c] = triangle[t].corner;
        if (geometry::is_degenerate(a, b, c)) return false;
        for (std::size_t other = 0; other < t; ++other)
            if (geometry::intersect(triangle[other], triangle[t])) return false;
    }
    return true;
}

void make_cell_surface(const SurfaceFrame& frame, const LevelCell& cell, CellSurface& surface) {
    surface.crossing = crossing_of(cell, frame.level, surface.value);
    surface.patch.size = 0;
    const Grid& grid = frame.grid;
    double low[3], width[3];
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = grid.position(axis, cell.at[std::size_t(axis)]);
        width[axis] = grid.width(axis, cell.at[std::size_t(axis)]);
    }
    for (int v = 0; v < patch_vertices; ++v) {
        if (!surface.crossing.has(v)) continue;
        const Vec3 p = vertex_position(grid, cell.at, surface.value, surface.crossing, frame.side, v);
        for (int axis = 0; axis < 3; ++axis)
            surface.at[std::size_t(v)][axis] = (p[axis] - low[axis]) / width[axis];
    }
    if (surface.crossing.star) return add_star(surface.crossing, surface.patch);
    const Loops& loops = loops_of(surface.crossing.below);
    for (int i = 0; i < loops.count; ++i) {
        const Loop& loop = loops.loop[std::size_t(i)];
        add_fan(loop, loop.size == 3 ? 0 : best_apex(loop, surface, frame.side), surface.patch);
    }
}

}  // namespace its::surface
