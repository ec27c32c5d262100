#pragma once

#include <cstdint>
#include <vector>

#include "distance/cell_sides.h"
#include "field/field.h"
#include "its/shell.h"
#include "octree/lattice.h"
#include "octree/octree.h"

namespace its {

/// What is known of each surface cell, in the order of the octree's level 0.
struct SurfaceCells {
    /// f(M ∩ c) ⊆ [lower, upper], in cell widths, rounding error included.
    std::vector<float> lower, upper;
    /// Triangles that meet the cell dilated by the lattice's rounding: triangle[offset[c] … offset[c+1]).
    std::vector<std::uint64_t> offset;
    std::vector<std::uint32_t> triangle;
};

/// The arrays behind a ThinShell. Lengths in lattice units (finest cell widths) unless said otherwise.
struct ShellData {
    Mesh mesh;
    Lattice lattice;
    Octree octree;
    Field field;
    SurfaceCells surface;
    CellSides sides;
    double epsilon_inner = 0, epsilon_outer = 0;
    ShellInfo info;
};

}  // namespace its
