#pragma once

#include <array>
#include <functional>
#include <string>

#include "its/verify.h"
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

struct Job {
    const View& view;
    const Mesh& mesh;  ///< the mesh to judge by; valid, and inside the root cube
    Evaluation value;  ///< thread-safe
    const VerifyOptions& options;
    bool same_mesh = false;  ///< the shell's own copy but for turned triangles: their numbers mean the same
    const Mesh& directed;    ///< then that copy, as the directions that the signs are of; else `mesh`
    Box bounds;              ///< of the mesh's triangles

    double width() const { return view.data().lattice.width; }
};

// Error budget, derived in docs/design/verify.md. Lattice units unless said otherwise.

/// Where the proof stops to refine a piece that is still in question: the bound is this near to a value that f
/// takes. The first as a rule, the second once a polygon has had many pieces (f constant along a curve).
inline constexpr double fine_gap = 0x1p-32, coarse_gap = 0x1p-26;
/// Of the root's side: how far a grid point's value may be from the brute-force distance.
inline constexpr double distance_tolerance = 1e-12;

/// One unit in the last place of a coordinate in the upper half of the root: 2^(K − 52).
double coordinate_ulp(const octree::Lattice& lattice);
/// How far the proof's computed pieces may be from M, per axis.
double piece_error(const octree::Lattice& lattice);
/// Pieces are cut from cells dilated by this much, so that no point of M in the cell is lost to rounding.
double cell_dilation(const octree::Lattice& lattice);
/// What a proven bound may exceed its limit by: coarse_gap plus the rounding of clipping.
double proven_tolerance(const octree::Lattice& lattice);

/// G2: how far ε may be from a value that f attains on M: 10⁻⁶, and the rounding of coordinates, which grows
/// with the distance from the origin and is part of γ.
double tightness_tolerance(const octree::Lattice& lattice);

/// Numbers of a counter-based generator: the same for (seed, stream, counter) in any order.
std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter);
inline double random_unit(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
    return double(random_bits(seed, stream, counter) >> 11) * 0x1p-53;  // [0, 1)
}

/// All arrays are what the others rely on. \return false if it is not safe to read them.
bool check_structure(const shell::ShellData& data, const VerifyOptions& options, VerifyReport& report);

/// f and its shipped evaluation on points of M: G1 sampled, evaluation, local bounds.
void check_samples(const Job& job, VerifyReport& report);

/// All of M, cell by cell: coverage, G1 proven, local bounds, G2, triangle lists.
void check_all_of_mesh(const Job& job, VerifyReport& report);

/// Winding numbers and distances of grid points (G3).
void check_signs(const Job& job, VerifyReport& report);

/// Shipped evaluation against the verifier's own at points of the root cube and around it.
void check_space(const Job& job, VerifyReport& report);

/// verify() for a shell given as arrays and an evaluation.
/// \throws InputError if the mesh is unusable or does not fit into the root cube; Cancelled.
VerifyReport judge(const shell::ShellData& data, const Evaluation& value, const Mesh& mesh,
                   const VerifyOptions& options);

/// "(x, y, z)" in mesh units, short.
std::string place(const Vec3& p);
Vec3 from_lattice(const octree::Lattice& lattice, const Vec3& p);

}  // namespace its::verifier
