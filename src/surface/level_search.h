#pragma once

#include "surface/level_source.h"

/// The level of an outer or inner surface that keeps it off M.
namespace its::surface {

struct CertifiedLevel {
    double level;                  ///< in finest cell widths
    std::vector<LevelCell> cells;  ///< all that it runs through, and some more
    SurfaceRange range;            ///< of f on the surface, at the end that faces M
};

/// The level nearest to `bound` (of f on M; outer: ε₂, inner: ε₁) that is found whose surface has f beyond the
/// bound everywhere: moved away from M until that is so, and then back by halving to level_precision. \throws
/// OptionError if the surface leaves the root cube before
CertifiedLevel find_certified_level(const LevelSource& source, SurfaceSide side, double bound,
                                    const Progress& progress);

inline constexpr double level_precision = 0x1p-7;  // finest cell widths

}  // namespace its::surface
