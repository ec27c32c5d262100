#pragma once

#include <algorithm>

#include "field/field.h"
#include "octree/neighbours.h"

/// Values of f at lattice points within a cell that is not subdivided.
namespace its::surface {

/// The 27 points of a cell's children from its 8 corners: means along x, then y, then z, so that a point on a
/// face or edge depends on that face's or edge's corners alone, in the same way for all cells that share it.
inline void halve(const double* corner, double* point) {
    for (int c = 0; c < 8; ++c) point[2 * (c & 1) + 6 * (c >> 1 & 1) + 18 * (c >> 2)] = corner[c];
    for (int z = 0; z <= 18; z += 18)
        for (int y = 0; y <= 6; y += 6) point[1 + y + z] = 0.5 * (point[y + z] + point[2 + y + z]);
    for (int z = 0; z <= 18; z += 18)
        for (int x = 0; x < 3; ++x) point[x + 3 + z] = 0.5 * (point[x + z] + point[x + 6 + z]);
    for (int i = 9; i < 18; ++i) point[i] = 0.5 * (point[i - 9] + point[i + 9]);
}

/// Whether finer hats reach into a cell that is not subdivided: only from subdivided cells around it. Without
/// them f is trilinear in it.
inline bool is_reached(const octree::Around& around) {
    return std::any_of(around.begin(), around.end(), [](std::uint64_t g) { return g != octree::no_group; });
}

/// Puts grid values of the subdivided cells around a cell of `level` where they are among its 27 points.
inline void insert_grid_values(const field::Field& field, int level, const octree::Around& around,
                               double* halved) {
    for (std::size_t n = 0; n < octree::neighbours; ++n) {
        if (around[n] == octree::no_group) continue;
        const double* const points = field.values[level - 1].data() + octree::group_points * around[n];
        const octree::SharedPoints& shared = octree::shared_points[n];
        for (std::size_t i = 0; i < std::size_t(shared.count); ++i)
            halved[shared.ours[i]] = points[shared.theirs[i]];
    }
}

}  // namespace its::surface
