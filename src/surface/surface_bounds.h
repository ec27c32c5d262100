#pragma once

#include <span>

#include "surface/cell_surface.h"

/// Proven bounds of f on an extracted surface.
namespace its {

/// f on the surface, in cell widths: all values lie in [lower, upper].
struct SurfaceRange {
    double lower, upper;
};

/// The gap that subdivision leaves between a bound and what is attained, in cell widths.
inline constexpr double surface_gap = 0x1p-13;

/// Bounds f on the triangles that the frame's level has in the cells; {level, level} if there are none. Holds
/// for the exact triangles over the rounded vertices in mesh units, and the exact f. \param ignore_above  do
/// not look at what raises `upper` (or lowers `lower`, for ignore_below): the result then
///                      has any valid or invalid number there
SurfaceRange bound_surface(const SurfaceFrame& frame, std::span<const LevelCell> cells, int depth,
                           bool ignore_below, bool ignore_above, const Progress& progress);

}  // namespace its
