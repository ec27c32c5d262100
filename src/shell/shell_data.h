#pragma once

#include <bit>
#include <cstdint>

#include "base/array.h"
#include "field/field.h"
#include "its/shell.h"
#include "octree/lattice.h"
#include "octree/octree.h"
#include "shell/triangle_lists.h"
#include "signs/cell_sides.h"

namespace its::shell {

/// What is known of each surface cell, in their order in the octree.
struct SurfaceCells {
    /// f(M ∩ c) ⊆ [lower, upper], in finest cell widths, rounding error included.
    Array<float> lower, upper;
    /// Bit c: corner c of the cell, displaced, is inside. Of adaptive shells alone: where a corner hangs, the
    /// sign of f does not tell it.
    Array<std::uint8_t> corners_inside;
    /// Triangles that meet the cell dilated by the lattice's rounding; read by ShellData::triangles().
    TriangleLists lists;
};

/// The mesh of a shell, as in Mesh.
struct MeshArrays {
    Array<Vec3> vertices;
    Array<Triangle> triangles;
};

/// The arrays behind a ThinShell. Lengths in lattice units (finest cell widths) unless said otherwise.
struct ShellData {
    MeshArrays mesh;
    octree::Lattice lattice;
    octree::Octree octree;
    field::Field field;
    SurfaceCells surface;
    signs::CellSides sides;
    double epsilon_inner = 0, epsilon_outer = 0;
    std::uint64_t grid_points = 0;  ///< 0: not counted
    ShellInfo info;

    /// The triangles that meet a surface cell of level 0.
    TriangleList triangles(std::uint64_t group, int child) const {
        return triangles(octree.levels[0].mask[group], group, child);
    }

    /// The same of any level.
    /// \param mask  the group's surface cells
    /// \param number  of the group among those that may have surface cells
    TriangleList triangles(unsigned mask, std::uint64_t number, int child) const {
        const unsigned before = mask & ((1u << child) - 1);
        return surface.lists.list(number, std::popcount(before), mesh.triangles.size());
    }
};

}  // namespace its::shell
