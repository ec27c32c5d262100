#include "surface/cell_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/rounding.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "octree/neighbours.h"
#include "surface/lattice_values.h"
#include "surface/level_search.h"

namespace its::surface {

/// A cell as a box of lattice coordinates, and what of the root cube it may have a point in.
struct CellPieces::Place {
    const LevelCell& cell;
    Vec3 low, size;    ///< of the cell
    Vec3 least, most;  ///< in the root cube
    double g_error;    ///< of g at a corner of a piece
};

/// The planes of the cell, as computed, err by a mapping error: each point of it is so near, along each axis,
/// to one of the box that is looked at. Values of f are distances in the root cube (extract_surface() sees to
/// it), hence no slope is larger than twice their most, a finest cell being the narrowest.
CellPieces::CellPieces(const shell::ShellData& shell, const Grid& grid)
    : shell_(shell),
      grid_(grid),
      plane_error_(3 * shell.lattice.mapping_error() * 2 * largest_possible_value(shell.lattice)) {}

/// Goes down the octree in the cell alone, with the cells around in hand as in level_cells.cpp.
template <class F>
class CellPieces::Walk {
public:
    Walk(const CellPieces& of, const Place& place, F& fn)
        : octree_(of.shell_.octree),
          field_(of.shell_.field),
          place_(place),
          value_error_(of.plane_error_ +
                       value_roundings(octree_.depth) * unit_roundoff * std::ldexp(4.0, octree_.depth)),
          fn_(fn) {}

    void run() {
        octree::Around around;
        around.fill(octree::no_group);
        around[octree::itself] = 0;
        visit_subdivided(octree_.depth + 1, {0, 0, 0}, around);
    }

private:
    static octree::Cell child_of(const octree::Cell& at, int child) {
        return {2 * at[0] + (child & 1), 2 * at[1] + (child >> 1 & 1), 2 * at[2] + std::uint32_t(child >> 2)};
    }

    /// What is only touched has the values of its neighbour there.
    bool meets(int level, const octree::Cell& at, Vec3& low, Vec3& high) const {
        const double width = std::ldexp(1.0, level);
        for (int axis = 0; axis < 3; ++axis) {
            const double from = at[std::size_t(axis)] * width;
            low[axis] = std::max(place_.least[axis], from);
            high[axis] = std::min(place_.most[axis], from + width);
            if (low[axis] >= high[axis]) return false;
        }
        return true;
    }

    void visit_subdivided(int level, const octree::Cell& at, const octree::Around& around) {
        const std::uint64_t group = around[octree::itself];
        const double* const points = field_.values[level - 1].data() + octree::group_points * group;
        const octree::Level& children = octree_.levels[level - 1];
        Vec3 low, high;
        for (int c = 0; c < 8; ++c) {
            const octree::Cell child = child_of(at, c);
            if (!meets(level - 1, child, low, high)) continue;
            if (level == 1) {
                add(0, child, points, c, low, high);
                continue;
            }
            const octree::Around around_c = octree::around_child(children, around, c);
            if (children.mask[group] >> c & 1)
                visit_subdivided(level - 1, child, around_c);
            else
                visit_leaf(level - 1, child, around_c, points, c, low, high);
        }
    }

    void visit_leaf(int level, const octree::Cell& at, const octree::Around& around, const double* points,
                    int place, const Vec3& from, const Vec3& to) {
        if (level == 0 || !is_reached(around)) return add(level, at, points, place, from, to);
        double corner[8], halved[octree::group_points];
        for (int c = 0; c < 8; ++c) corner[c] = points[octree::group_point(place, c)];
        halve(corner, halved);
        insert_grid_values(field_, level, around, halved);
        Vec3 low, high;
        for (int c = 0; c < 8; ++c) {
            const octree::Cell child = child_of(at, c);
            if (!meets(level - 1, child, low, high)) continue;
            if (level == 1)
                add(0, child, halved, c, low, high);
            else
                visit_leaf(level - 1, child, octree::around_child(octree_.levels[level - 1], around, c), halved,
                           c, low, high);
        }
    }

    /// Child `child` of 27 points, on which f is trilinear, from low to high.
    void add(int level, const octree::Cell& at, const double* points, int child, const Vec3& low,
             const Vec3& high) {
        const double width = std::ldexp(1.0, level);
        const Vec3 corner{at[0] * width, at[1] * width, at[2] * width};
        double value[8], largest = 0;
        for (int c = 0; c < 8; ++c) {
            value[c] = points[octree::group_point(child, c)];
            largest = std::max(largest, std::abs(value[c]));
        }
        std::array<double, 8> f, g;
        for (int c = 0; c < 8; ++c) {
            const Vec3 u{c & 1 ? high.x : low.x, c & 2 ? high.y : low.y, c & 4 ? high.z : low.z};
            f[std::size_t(c)] = geometry::trilinear(value, (1.0 / width) * (u - corner));
            const Vec3 v = u - place_.low;
            g[std::size_t(c)] = geometry::trilinear(
                place_.cell.value.data(), {v.x / place_.size.x, v.y / place_.size.y, v.z / place_.size.z});
        }
        // Of f: the evaluation, local coordinates that err by 2u each and a slope of at most 2V; and the
        // values, which are means of distances in a root cube with a diagonal below 4·2ᴷ.
        const double f_error = (geometry::trilinear_roundings + 12) * unit_roundoff * largest + value_error_;
        fn_(f, g, f_error + place_.g_error);
    }

    const octree::Octree& octree_;
    const field::Field& field_;
    const Place& place_;
    double value_error_;
    F& fn_;
};

template <class F>
void CellPieces::for_pieces(const LevelCell& cell, F fn) const {
    Vec3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = grid_.position(axis, cell.at[std::size_t(axis)]);
        high[axis] = grid_.position(axis, cell.at[std::size_t(axis)] + 1);
    }
    const Vec3 from = shell_.lattice.to_lattice(low), to = shell_.lattice.to_lattice(high);
    const double last = shell_.lattice.cells();
    Place place{cell, from, to - from, {}, {}, 0};
    double largest = 0;
    for (const double v : cell.value) largest = std::max(largest, std::abs(v));
    // Of g: as of f; the planes err by a mapping error each, and so does the size by two: four in all, in
    // cells, on each of three axes along which the slope is at most 2V.
    const double narrowest = std::min({place.size.x, place.size.y, place.size.z});
    place.g_error = (geometry::trilinear_roundings + 12) * unit_roundoff * largest +
                    3 * 2 * largest * 4 * shell_.lattice.mapping_error() / narrowest;
    for (int axis = 0; axis < 3; ++axis) {
        place.least[axis] = std::max(from[axis], 0.0);
        place.most[axis] = std::min(to[axis], last);
    }
    Walk<F>(*this, place, fn).run();
}

double CellPieces::reach(const LevelCell& cell, double bound, int direction) const {
    double reach = -std::numeric_limits<double>::infinity();
    for_pieces(cell, [&](const std::array<double, 8>& f, const std::array<double, 8>& g, double error) {
        double least = f[0] * direction, most = g[0] * direction, difference = most - least;
        for (std::size_t c = 1; c < 8; ++c) {
            least = std::min(least, f[c] * direction);
            most = std::max(most, g[c] * direction);
            difference = std::max(difference, (g[c] - f[c]) * direction);
        }
        if (least - error > bound) return;
        // Where f ≤ bound, g = f + (g − f) ≤ bound + max(g − f).
        reach = std::max(reach, std::min(most, bound + difference) + error);
    });
    return reach;
}

std::pair<double, double> CellPieces::difference(const LevelCell& cell, double low, double high) const {
    double least = 0, most = 0;
    for_pieces(cell, [&](const std::array<double, 8>& f, const std::array<double, 8>& g, double error) {
        const auto [g_least, g_most] = std::minmax_element(g.begin(), g.end());
        if (*g_least - error > high || *g_most + error < low) return;
        for (std::size_t c = 0; c < 8; ++c) {
            least = std::min(least, f[c] - g[c] - error);
            most = std::max(most, f[c] - g[c] + error);
        }
    });
    return {least, most};
}

}  // namespace its::surface
