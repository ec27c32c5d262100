#pragma once

#include <optional>

#include "its/mesh.h"
#include "its/surface.h"
#include "shell/shell_data.h"
#include "surface/cell_surface.h"
#include "surface/hull.h"
#include "surface/memory_guard.h"

/// Level sets of an adaptive shell, cell by cell of whatever size: docs/design/adaptive.md has the proofs.
namespace its::surface {

struct LeafSurface {
    Mesh mesh;
    double level = 0;          ///< in finest cell widths
    SurfaceRange range{0, 0};  ///< of f on it; {level, level} where it was not asked for
    std::uint64_t cells = 0;   ///< that it runs through
};

/// \param given  the level; none: one beyond `bound`, f on M, at which f on the surface is beyond it, too
/// \throws OptionError if it leaves the root cube; MemoryError; Cancelled
LeafSurface extract_leaf_surface(const shell::ShellData& shell, const Grid& grid, SurfaceSide side,
                                 std::optional<double> given, double bound, bool with_range, MemoryGuard& guard,
                                 const Progress& progress);

}  // namespace its::surface
