#pragma once

#include <span>

#include "its/shell.h"
#include "shell/shell_data.h"

/// The range of f on M, over all of M and cell by cell.
namespace its::shell {

/// All in cell widths. [lower, upper] ⊇ f̂(M), rounding error included; `rounding` is the γ that each side
/// contains. Not yet joined with 0.
struct Extremes {
    double lower, upper;
    double rounding;
    std::vector<float> cell_lower, cell_upper;  ///< of each surface cell
};

/// The gap that branch and bound leaves between a bound and the attained extreme, in cell widths: the promise
/// G2 is 1e-6, and `candidates` must agree to 1e-9.
inline constexpr double extreme_gap = 0x1p-31;

/// γ where f changes by at most `slope` times its length along any edge of a surface cell, cells are at most
/// `width` wide and values at most `value`.
double rounding_error(const octree::Lattice& lattice, double slope, double width, double value);

/// Bounds f on M. γ and the proof are in docs/design/extremes.md.
/// \param positions  vertices in lattice coordinates, as rounded by Lattice::to_lattice
/// \param offset, triangle  the triangles that meet each surface cell dilated by lattice.dilation()
Extremes find_extremes(const octree::Lattice& lattice, const octree::Octree& octree, const field::Field& field,
                       std::span<const Vec3> positions, std::span<const Triangle> triangles,
                       std::span<const std::uint64_t> offset, std::span<const std::uint32_t> triangle,
                       Extrema method, const Progress& progress);

}  // namespace its::shell
