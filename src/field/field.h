#pragma once

#include <vector>

#include "its/base.h"
#include "octree/octree.h"

/// The function f in lattice coordinates and in units of the finest cell width.
namespace its {

/// f as cumulative values. Let F_k be the sum of the levels ≥ k of the hierarchical B-spline; then
/// values[k][27·group + point] = F_k(g), and the coefficient of grid point g is F_k(g) − F_{k+1}(g).
/// A grid point shared by several groups stands in each of them, with the same bits.
struct Field {
    std::vector<std::vector<double>> values;
};

}  // namespace its
