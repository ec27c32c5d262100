#include "field/field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "geometry/trilinear.h"

namespace its::field {

namespace {

using Index = std::array<std::int64_t, 3>;  // of a cell or corner within a level

/// A cell of a level as it is stored.
struct Place {
    std::uint64_t group;
    int child;
};

int child_of(const Index& finest, int level) {
    return int(finest[0] >> level & 1) | int(finest[1] >> level & 1) << 1 | int(finest[2] >> level & 1) << 2;
}

/// Follows the cells that hold finest cell `finest` from the root down to `level` at most; returns the level
/// reached, and the cell there.
int descend(const octree::Octree& octree, const Index& finest, int level, Place& place) {
    place = {0, child_of(finest, octree.depth)};
    int at = octree.depth;
    for (; at > level; --at) {
        const octree::Level& l = octree.levels[at];
        const unsigned mask = l.mask[place.group];
        if (!(mask >> place.child & 1)) break;
        place.group = l.first.rank(place.group, place.child);
        place.child = child_of(finest, at - 1);
    }
    return at;
}

/// F_level at a corner (in cells of the level) if it is a grid point of the level. Cells with cell >> shift ==
/// leaf are known not to exist.
std::optional<double> grid_value(const octree::Octree& octree, const Field& field, int level,
                                 const Index& corner, const Index& leaf, int shift) {
    const std::int64_t side = std::int64_t{2} << (octree.depth - level);
    for (int around = 0; around < 8; ++around) {
        Index cell, finest;
        bool usable = true, in_leaf = true;
        for (int axis = 0; axis < 3; ++axis) {
            cell[axis] = corner[axis] - (around >> axis & 1);
            finest[axis] = cell[axis] << level;
            usable &= cell[axis] >= 0 && cell[axis] < side;
            in_leaf &= cell[axis] >> shift == leaf[axis];
        }
        if (!usable || in_leaf) continue;
        Place place;
        if (descend(octree, finest, level, place) == level)
            return field
                .values[level][octree::group_points * place.group + octree::group_point(place.child, around)];
    }
    return std::nullopt;
}

/// Mean of the values at the ends of the shortest edge, face or body diagonal through half position `half`
/// (components 0, 1 or 2) of a cell: its trilinear interpolation there.
double at_half(const double* value, const std::array<int, 3>& half) {
    const Vec3 p{0.5 * half[0], 0.5 * half[1], 0.5 * half[2]};
    return geometry::trilinear(value, p);
}

/// Refines the cell, a leaf or a lattice cell in it, to the one of the next finer level that holds `finest`.
/// Returns whether a hat of the finer level reaches into that one.
bool refine(const octree::Octree& octree, const Field& field, const Index& finest, int level, const Index& leaf,
            int shift, double* value) {
    double refined[8];
    bool reached = false;
    for (int c = 0; c < 8; ++c) {
        Index corner;
        std::array<int, 3> half;
        bool inside = true;
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t cell = finest[axis] >> level;
            corner[axis] = cell + (c >> axis & 1);
            half[axis] = int(cell & 1) + (c >> axis & 1);
            const std::int64_t first = leaf[axis] << shift;
            inside &= corner[axis] > first && corner[axis] < first + (std::int64_t{1} << shift);
        }
        const auto known = inside ? std::nullopt : grid_value(octree, field, level, corner, leaf, shift);
        reached |= known.has_value();
        refined[c] = known ? *known : at_half(value, half);
    }
    std::copy(refined, refined + 8, value);
    return reached;
}

}  // namespace

ITS_API TrilinearCell locate(const octree::Octree& octree, const Field& field, const Vec3& u) {
    const std::int64_t last = (std::int64_t{2} << octree.depth) - 1;
    Index finest;
    for (int axis = 0; axis < 3; ++axis) finest[axis] = std::min(std::int64_t(std::floor(u[axis])), last);

    Place place;
    const int leaf_level = descend(octree, finest, 0, place);
    TrilinearCell cell;
    for (int c = 0; c < 8; ++c)
        cell.value[c] =
            field.values[leaf_level][octree::group_points * place.group + octree::group_point(place.child, c)];

    // Carry the corner values of F_j down: finer hats reach into a leaf only from its boundary, and two lattice
    // cells of a level that touch share a corner, so that once no corner is a grid point none will be.
    int level = leaf_level;
    const Index leaf = {finest[0] >> leaf_level, finest[1] >> leaf_level, finest[2] >> leaf_level};
    // Into a leaf that meets M none reach: grid points that they would be centred at hang.
    const bool surface = octree.surface_mask(leaf_level, place.group) >> place.child & 1;
    for (bool reached = !surface; level > 0 && reached; --level)
        reached = refine(octree, field, finest, level - 1, leaf, leaf_level - (level - 1), cell.value);
    cell.width = std::ldexp(1.0, level);
    for (int axis = 0; axis < 3; ++axis) cell.corner[axis] = double(finest[axis] >> level) * cell.width;
    return cell;
}

double coefficient(const octree::Octree& octree, const Field& field, int level, std::uint64_t group, int child,
                   int corner) {
    const double value = field.values[level][octree::group_points * group + octree::group_point(child, corner)];
    if (level == octree.depth) return value;
    // The parent is a cell of the next level: F_{level+1} is trilinear on it.
    const std::uint64_t parent = octree.levels[level].parent[group];
    const std::uint64_t above = octree.find(level + 1, parent >> 3);
    double coarse[8];
    for (int c = 0; c < 8; ++c)
        coarse[c] =
            field.values[level + 1][octree::group_points * above + octree::group_point(int(parent & 7), c)];
    std::array<int, 3> half;
    for (int axis = 0; axis < 3; ++axis) half[axis] = (child >> axis & 1) + (corner >> axis & 1);
    return value - at_half(coarse, half);
}

}  // namespace its::field
