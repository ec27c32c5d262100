#pragma once

#include <memory>
#include <vector>

#include "shell/shell_data.h"
#include "surface/cell_surface.h"
#include "surface/hull.h"

/// Lattices to extract level sets of a shell's f on.
namespace its::surface {

class LevelSource {
public:
    virtual ~LevelSource() = default;

    const Grid& grid() const { return grid_; }

    /// All cells of the lattice that a level in [low, high] may run through, each once, in a fixed order.
    /// Levels in finest cell widths.
    virtual std::vector<LevelCell> cells(double low, double high, const Progress& progress) const = 0;

    /// Bounds f on the surface that the frame's level has in the cells; {level, level} if there is none. Holds
    /// for the exact triangles over the rounded vertices in mesh units, and for the exact f.
    virtual SurfaceRange bound(const SurfaceFrame& frame, std::span<const LevelCell> cells, RangeEnds ends,
                               const Progress& progress) const = 0;

protected:
    /// \param step  cell width in mesh units, cells per side of the root
    /// \throws OptionError if doubles cannot tell the lattice's positions apart
    LevelSource(const octree::Lattice& lattice, double step, std::uint32_t cells);

private:
    Grid grid_;
};

/// The shell's own lattice: f is trilinear on its cells. \throws OptionError
std::unique_ptr<LevelSource> finest_source(const shell::ShellData& shell);

/// A lattice with `resolution` cells along the scale s: f is sampled at its points. \throws OptionError
std::unique_ptr<LevelSource> resampled_source(const shell::ShellData& shell, int resolution);

}  // namespace its::surface
