#pragma once

#include "verify/checks.h"
#include "verify/taylor.h"

/// Bounds of f over one polygon of M in one cell, by subdivision.
namespace its::verifier {

/// What is to be shown of f on M; lattice units.
struct Goal {
    double inner = 0, outer = 0;  ///< ε₁ and ε₂
    double proven_inner = 0,
           proven_outer = 0;  ///< ε₁ + γ and ε₂ − γ, so that the shipped evaluation is bounded too
    double strict_inner = 0, strict_outer = 0;               ///< what no attained value may pass
    double tight_inner = -infinity, tight_outer = infinity;  ///< to be attained or passed; infinite: no need
};

/// What was found; margins and values in lattice units, places in mesh units.
struct ProofTally {
    std::uint64_t pairs = 0, pieces = 0;
    double low = infinity, high = -infinity;                    ///< proven
    double attained_low = infinity, attained_high = -infinity;  ///< at points of M, rounding taken off
    Vec3 low_at, high_at;                                       ///< where attained
    std::uint64_t violations = 0;  ///< pieces with a point of M beyond the strict limits
    double excess = 0;             ///< how far the worst of them is
    std::uint64_t undecided = 0;   ///< pieces accepted only within the tolerance
    std::uint64_t overflow = 0;    ///< polygons that could not be clipped: nothing is proven of them

    std::uint64_t local_violations = 0, local_pairs = 0;
    double local_margin = infinity;  ///< of the proven bounds
    Vec3 local_at;
    double local_excess = 0;  ///< by how much the worst attained value is beyond its cell's bounds
    Vec3 local_excess_at;

    std::uint64_t uncovered = 0, grazing = 0;  ///< unmarked cells that M meets; that M might touch by rounding
    double uncovered_depth = 0;                ///< how deep M is in the worst of them
    Vec3 uncovered_at;
    std::uint64_t listed = 0, unlisted = 0;  ///< triangles that certainly meet a cell, in its list or not
    Vec3 unlisted_at;

    void add(const ProofTally& o);
};

/// Bounds f over the convex `polygon`, in coordinates of the cell (0 to 1), of the cell with corner values v.
/// \param width  of the cell, in finest cells; `cell` are its coordinates on its level
/// \param local_low, local_high  the cell's own bounds, infinite where it has none.
void bound_polygon(const Lattice& lattice, const Goal& goal, const Cell& cell, double width,
                   const double (&v)[8], double local_low, double local_high, const Polygon& polygon,
                   ProofTally& tally);

}  // namespace its::verifier
