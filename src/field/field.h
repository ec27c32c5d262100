#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/array.h"
#include "its/base.h"
#include "octree/octree.h"

/// The function f in lattice coordinates and in units of the finest cell width.
namespace its::field {

/// f as cumulative values. Let F_k be the sum of the levels ≥ k of the hierarchical B-spline; then
/// values[k][27·group + point] = F_k(g), and the coefficient of grid point g is F_k(g) − F_{k+1}(g).
/// A grid point shared by several groups stands in each of them, with the same bits.
struct Field {
    std::vector<Array<double>> values;
};

/// The direct solution: cumulative values equal to D satisfy f(g) = D(g) on every level, since finer hats
/// centred elsewhere vanish at g. `distance` is laid out as Field::values.
inline Field solve_direct(std::vector<std::vector<double>> distance) {
    Field field;
    for (std::vector<double>& level : distance) field.values.emplace_back(std::move(level));
    return field;
}

/// A lattice cell on which f is trilinear: lower corner and width in lattice units, values at the corners.
struct TrilinearCell {
    Vec3 corner;
    double width;
    double value[8];
};

/// The cell with this point of the root cube (lattice coordinates, 0 ≤ u ≤ 2^(depth+1)) on which f is
/// trilinear: a surface cell, a finest cell, or in a coarser leaf the first lattice cell,
/// going down, that no finer hat reaches into.
TrilinearCell locate(const octree::Octree& octree, const Field& field, const Vec3& u);

/// The coefficient λ of the grid point at `corner` of child `child` of a group.
double coefficient(const octree::Octree& octree, const Field& field, int level, std::uint64_t group, int child,
                   int corner);

}  // namespace its::field
