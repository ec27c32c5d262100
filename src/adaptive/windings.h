#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "mesh/arrays.h"
#include "octree/lattice.h"
#include "octree/octree.h"

/// Winding numbers of grid points, from one known in the same cell.
namespace its::adaptive {

/// Of the 27 points that halve a cell, displaced as in geometry/predicates.h: that of the lowest corner and the
/// signed crossings of lattice lines between them. All that can cross these meets the cell. Exact.
/// \param lowest  lattice point
/// \param step    half the cell, in lattice points
/// \param list    the triangles that meet the cell
std::array<std::int32_t, octree::group_points> windings_in_cell(
    const mesh::Arrays& mesh, const octree::Lattice& lattice, const std::array<std::int64_t, 3>& lowest,
    std::int64_t step, std::span<const std::uint32_t> list, std::int32_t of_lowest);

}  // namespace its::adaptive
