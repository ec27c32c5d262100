#pragma once

#include <span>

#include "its/mesh.h"
#include "surface/cell_surface.h"

/// The mesh of a level set from the cells it runs through.
namespace its::surface {

/// \param cells  all cells that the level set runs through, each once; others among them are skipped
/// \returns vertices and triangles in the order of the cells
/// \throws OptionError if there are more than 2³² − 1 vertices, or the level set reaches the root cube's
/// boundary; InputError if cells do not agree about a lattice point that they share
Mesh polygonise(const SurfaceFrame& frame, std::span<const LevelCell> cells, const Progress& progress);

/// Whether the patches around cell centres have no degenerate triangles and do not meet themselves, by exact
/// predicates: true by construction where the lattice's positions are doubles, not where they have 32 bits.
bool stars_are_embedded(const SurfaceFrame& frame, std::span<const LevelCell> cells);

/// Whether some corner below the level is on the boundary of the root cube, which has `side` cells of this size
/// a side.
/// \param below  bit c: corner c
bool reaches_boundary(const octree::Cell& at, unsigned below, std::uint32_t side);

/// \throws OptionError that says so.
[[noreturn]] void refuse_open_level();

/// \throws OptionError that says so, where 32-bit numbers are few for a cell.
[[noreturn]] void refuse_folded();

}  // namespace its::surface
