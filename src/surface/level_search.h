#pragma once

#include "surface/level_source.h"

/// The level of an outer or inner surface that keeps it off M, by trial.
namespace its::surface {

/// LevelSource::certified_level() by bounds of f: moved away from M until they are beyond `bound`, and then
/// back by halving to level_precision.
CertifiedLevel find_certified_level(const LevelSource& source, const shell::ShellData& shell, SurfaceSide side,
                                    double bound, double least_move, const Progress& progress);

/// No level of an outer surface beyond this one is closed in the root cube, whose corners are the farthest from
/// M; of an inner one, with the opposite sign, there is nothing beyond.
double most_level(const shell::ShellData& shell, SurfaceSide side);

inline constexpr double level_precision = 0x1p-7;  // finest cell widths

}  // namespace its::surface
