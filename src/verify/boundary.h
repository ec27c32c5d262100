#pragma once

#include <cstdint>
#include <vector>

#include "its/mesh.h"
#include "verify/lattice.h"

/// The boundary of M: its edges whose uses do not cancel.
namespace its::verifier {

/// A piece of an edge, and how often more it is used from a to b than from b to a; never 0.
struct BoundaryEdge {
    Vec3 a, b;
    std::int64_t excess = 0;
};

struct Boundary {
    std::uint64_t vertices = 0;  ///< distinct positions that triangles use
    bool single_edges = false;   ///< some edge has exactly one triangle; triangles that repeat a corner aside
    /// Edges cancel as sets of points: one that is divided on one side only cancels with its parts. None: M is
    /// a cycle.
    std::vector<BoundaryEdge> edges;
    /// The same if only the parity of uses counts. None: every ray that is in general position crosses M an
    /// even number of times.
    std::vector<BoundaryEdge> odd_edges;
};

/// Positions that triangles use, in ascending order, each once; of each vertex that is used, its number among
/// them.
struct Positions {
    std::vector<Vec3> at;
    std::vector<std::uint32_t> number;
};

Positions number_positions(const Mesh& mesh);

Boundary find_boundary(const Mesh& mesh);

/// What is to be added to the crossings of the ray from p along +z, so that the sum is the winding number of M
/// about p (Martens, Trettner, Bessmeltsev 2026, "The Antipodal Method"): the solid angle of the triangles that
/// the boundary's edges span with the direction −z, over 4π. p is displaced as in verify/exact.h.
struct Estimate {
    double value = 0, error = 0;  ///< the true number is within the error
};
Estimate boundary_term(const std::vector<BoundaryEdge>& edges, const Vec3& p);

}  // namespace its::verifier
