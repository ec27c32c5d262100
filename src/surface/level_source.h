#pragma once

#include <memory>
#include <vector>

#include "shell/shell_data.h"
#include "surface/cell_surface.h"
#include "surface/hull.h"
#include "surface/memory_guard.h"

/// Lattices to extract level sets of a shell's f on.
namespace its::surface {

/// The level of an outer or inner surface that keeps it off M.
struct CertifiedLevel {
    double level;                  ///< in finest cell widths
    std::vector<LevelCell> cells;  ///< all that levels in `covered` run through
    SurfaceRange covered;          ///< has the level and the bound
    SurfaceRange range;            ///< of f on the surface, at the end that faces M
};

class LevelSource {
public:
    virtual ~LevelSource() = default;

    const Grid& grid() const { return grid_; }

    /// All cells of the lattice that a level in [low, high] may run through, each once, in a fixed order.
    /// Levels in finest cell widths.
    virtual std::vector<LevelCell> cells(double low, double high, const Progress& progress) const = 0;

    /// Bounds f on the surface that the frame's level has in the cells; {level, level} if there is none. Holds
    /// for the exact triangles over the rounded vertices in mesh units, and for the exact f. Where vertices are
    /// 32-bit numbers on the shell's own lattice, an end holds if the cells are all that a level between it and
    /// the frame's may run through.
    virtual SurfaceRange bound(const SurfaceFrame& frame, std::span<const LevelCell> cells, RangeEnds ends,
                               const Progress& progress) const = 0;

    /// A level whose surface has f beyond `bound` (of f on M; outer: ε₂, inner: ε₁) everywhere: as near to it
    /// as is found, and at least `least_move` away from it.
    /// \throws OptionError if there is none, as the surface leaves the root cube before; InputError if f is not
    ///         what distances in the root cube can be
    virtual CertifiedLevel certified_level(SurfaceSide side, double bound, double least_move,
                                           const Progress& progress) const = 0;

    /// By how much more than `bound` a level must be moved, at least, for the surface to have all of the cell
    /// with p on M's side. On the shell's own lattice every certified surface encloses M (is enclosed): 0.
    virtual double enclosing_move(SurfaceSide, double /*bound*/, const Vec3& /*p*/) const { return 0; }

protected:
    /// \param step  cell width in mesh units, cells per side of the root
    /// \throws OptionError if doubles, or the 32-bit numbers that are asked for, cannot tell the lattice's
    /// positions apart
    LevelSource(const octree::Lattice& lattice, double step, std::uint32_t cells, const Rounding& rounding);

private:
    Grid grid_;
};

/// The shell's own lattice: f is trilinear on its cells.
/// \throws OptionError
std::unique_ptr<LevelSource> finest_source(const shell::ShellData& shell, const Rounding& rounding);

/// A lattice with `resolution` cells along the scale s: f is sampled at its points.
/// \throws OptionError
std::unique_ptr<LevelSource> resampled_source(const shell::ShellData& shell, int resolution,
                                              const Rounding& rounding, MemoryGuard& guard);

}  // namespace its::surface
