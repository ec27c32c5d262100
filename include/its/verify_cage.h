#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "its/base.h"
#include "its/mesh.h"
#include "its/verify.h"

/// An independent check of a surface around or inside a mesh, whoever made it.
namespace ITS_API its {

struct VerifyCageOptions {
    bool inner = false;  ///< the cage is to lie within M, which must be closed, its triangles facing outward
    /// Mesh units: no point of the cage is to be nearer to M than the clearance, none farther than the
    /// distance. Empty: any.
    std::optional<double> clearance = {}, distance = {};
    Run run = {};
};

/// What was found. Lengths in mesh units.
struct VerifyCageReport {
    std::vector<VerifyCheck> checks;
    /// Proven, rounding included: nearest ≤ d(x, M) ≤ farthest for every point x of the cage.
    double nearest = 0, farthest = 0;
    std::uint64_t cage_components = 0, mesh_components = 0;  ///< triangles that share positions of vertices
    bool passed() const;                                     ///< all checks
    /// Wall clock: the call.
    struct Seconds {
        double total = 0;
    } seconds;
};

/// Checks that a cage is closed, a 2-manifold, free of self-intersections, disjoint from M and around every
/// connected part of it (its winding number about a vertex of each is 1), or within it (M's winding number
/// about a vertex of each part of the cage is 1 or more): by exact predicates, vertices being told apart by
/// their positions. Then it proves how far the cage is from M. No code is shared with what makes such surfaces.
/// \throws InputError (no triangles, non-finite coordinates, indices out of range, of either mesh), OptionError
///         (lengths below 0, run), Cancelled
VerifyCageReport verify_cage(const MeshView& cage, const MeshView& mesh, const VerifyCageOptions& options = {});

}  // namespace its
