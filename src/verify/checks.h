#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "its/verify.h"
#include "verify/boundary.h"
#include "verify/lists.h"
#include "verify/polygon.h"
#include "verify/view.h"

/// The parts of verify(); each appends its VerifyChecks to the report.
namespace its::verifier {

/// The shipped evaluation: mesh units in and out.
using Evaluation = std::function<double(const Vec3&)>;

/// The finest cells to look at on one axis: `low` … `high`, both within the root.
struct CellRange {
    std::int64_t low = 0, high = 0;
};

/// The arrays of a shell, found sound, and what follows from them.
struct Arrays {
    View view;
    Lists lists;
    /// For each level and group the points that no group of lower code has, bit i for point i: so that every
    /// grid point of the level is in one group.
    std::vector<std::vector<std::uint32_t>> own_points;
    std::uint64_t grid_points = 0;
};

struct Job {
    const Arrays& arrays;
    const View& view;  ///< of the arrays
    const Mesh& given;
    const Mesh& mesh;  ///< the mesh to judge by, the given one but for welding; valid, and inside the root cube
    Evaluation value;  ///< thread-safe
    const VerifyOptions& options;
    bool same_mesh = false;  ///< the shell's own copy but for turned triangles: their numbers mean the same
    const Mesh& directed;    ///< then that copy, as the directions that the signs are of; else `mesh`
    Box bounds;              ///< of the mesh's triangles
    Boundary boundary;       ///< of `directed`
    Parts& parts;            ///< of the call's progress: each check takes the next

    double width() const { return view.lattice().width; }
};

// Error budget, derived in docs/design/verify.md. Lattice units unless said otherwise.

/// Where the proof stops to refine a piece that is still in question: the bound is this near to a value that f
/// takes. The first as a rule, the second once a polygon has had many pieces (f constant along a curve).
inline constexpr double fine_gap = 0x1p-32, coarse_gap = 0x1p-26;
/// Of the root's side, in units of 2⁻⁵³: how far a grid point's value may be from the distance. The builder's
/// proven error is 49 of these, ours 64 · √3.
inline constexpr double distance_roundings = 256;

/// How far the proof's computed pieces may be from M, per axis, in widths of a cell that is `width` finest ones
/// wide.
double piece_error(const Lattice& lattice, double width = 1);
/// Pieces are cut from cells dilated by this much, so that no point of M in the cell is lost to rounding.
double cell_dilation(const Lattice& lattice);
/// Of a cell dilated by this, what is left of a triangle shows that the cell must be marked and list it.
double certain_dilation(const Lattice& lattice);
/// What a proven bound may exceed its limit by: coarse_gap plus the rounding of clipping.
/// \param width  of the largest surface cell
double proven_tolerance(const Lattice& lattice, double width);

/// G2: how far ε may be from a value that f attains on M: 10⁻⁶, and the rounding of coordinates, which grows
/// with the distance from the origin and is part of γ.
double tightness_tolerance(const Lattice& lattice);

/// Numbers of a counter-based generator: the same for (seed, stream, counter) in any order.
std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter);
inline double random_unit(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
    return double(random_bits(seed, stream, counter) >> 11) * 0x1p-53;  // [0, 1)
}

/// All arrays are what the others rely on. \return nothing if it is not safe to read them.
std::optional<Arrays> check_structure(const shell::ShellData& data, const Progress& progress,
                                      VerifyReport& report);

/// The shell's copy of the mesh against the given one, and the numbers that describe the shell.
void check_description(const Job& job, VerifyReport& report);

/// f and its shipped evaluation on points of M: G1 sampled, evaluation, local bounds.
void check_samples(const Job& job, VerifyReport& report);

/// All of M, cell by cell: coverage, G1 proven, local bounds, G2, triangle lists.
void check_all_of_mesh(const Job& job, VerifyReport& report);

/// Sides of cells, signs and distances of grid points (G3).
void check_grid(const Job& job, VerifyReport& report);

/// Shipped evaluation against the verifier's own at points of the root cube and around it.
void check_space(const Job& job, VerifyReport& report);

/// verify() for a shell given as arrays and an evaluation.
/// \throws InputError if the mesh is unusable or does not fit into the root cube; Cancelled.
VerifyReport judge(const shell::ShellData& data, const Evaluation& value, const Mesh& mesh,
                   const VerifyOptions& options);

/// "(x, y, z)" in mesh units, short.
std::string place(const Vec3& p);

}  // namespace its::verifier
