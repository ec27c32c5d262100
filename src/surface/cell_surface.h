#pragma once

#include <array>

#include "its/surface.h"
#include "surface/grid.h"
#include "surface/level_cells.h"
#include "surface/patch.h"

/// The part of a surface in one cell, with the positions of its vertices.
namespace its::surface {

/// What a surface is extracted from and for.
struct SurfaceFrame {
    Grid grid;
    SurfaceSide side = SurfaceSide::outer;
    double level = 0;  ///< in finest cell widths, as the cells' values
};

struct CellSurface {
    std::array<double, 8> value;  ///< at the corners, minus the level
    Crossing crossing;
    Patch patch;
    std::array<Vec3, patch_vertices> at;  ///< local coordinates in [0, 1]³ of the vertices that exist
};

/// Values minus level, and signs. Cheap.
Crossing crossing_of(const LevelCell& cell, double level, std::array<double, 8>& value);

/// Position, in mesh units, of a vertex of the cell: a lattice edge's or an inner one. It depends on the edge's
/// own values alone, so that all cells around an edge agree.
Vec3 vertex_position(const Grid& grid, const octree::Cell& at, const std::array<double, 8>& value,
                     const Crossing& crossing, SurfaceSide side, int vertex);

/// The triangles in a cell, and local coordinates of their vertices as rounded in mesh units: each coordinate
/// is wrong by at most local_roundings·u. Precondition: the cell is crossed.
void make_cell_surface(const SurfaceFrame& frame, const LevelCell& cell, CellSurface& surface);

/// Whether the triangles of a star, with vertices as they are in mesh units, meet in common corners and edges
/// only, and none is degenerate.
bool star_is_embedded(const SurfaceFrame& frame, const LevelCell& cell);

/// Of (x − p₀)/(p₁ − p₀): two differences and a quotient; p₁ − p₀ is exact on the shell's own lattice.
inline constexpr double local_roundings = 3;

}  // namespace its::surface
