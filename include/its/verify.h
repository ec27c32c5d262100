#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "its/shell.h"

/// An independent check of a shell against a mesh. It shares no evaluation, bounding, clipping or sign code
/// with the builder: only the arrays of the shell are common to both.
namespace ITS_API its {

struct VerifyOptions {
    std::uint64_t samples = 1'000'000;  ///< on M, uniform by area
    std::uint64_t seed = 20240;         ///< of the random samples
    /// Grid points whose values are compared with distances: all if there are no more, else one in each of as
    /// many equal parts. Under the generalized rule at most as many of them as bring the pairs of point and
    /// boundary edge to 2·10⁸.
    std::uint64_t grid_samples = 1'000'000;
    /// All grid points, whatever their number: then no change of one element that makes a statement of a shell
    /// false goes unseen, within the tolerances of docs/design/verify.md.
    bool complete = false;
    Run run = {};
};

/// One promise of docs/design/verify.md, checked.
struct VerifyCheck {
    std::string name;  ///< "G1 containment, sampled", …
    bool passed = false;
    bool complete = false;  ///< everything that the promise is about was tested, not a sample of it
    std::uint64_t tested = 0, violations = 0;
    double worst = 0;    ///< smallest margin seen, in mesh units; negative: by how much it failed
    std::string detail;  ///< one line
};

struct VerifyReport {
    std::vector<VerifyCheck> checks;
    double sampled_min = 0, sampled_max = 0;  ///< of f over all samples, mesh units
    double proven_min = 0, proven_max = 0;    ///< of f over M, by interval subdivision; mesh units
    bool passed() const;                      ///< all checks
    /// Wall clock: the call.
    struct Seconds {
        double total = 0;
    } seconds;
};

/// Checks every section of a shell's file: G1 (containment: samples on M and a proof by interval subdivision),
/// G2 (tightness), the sides of cells, the values of grid points (G3), the lists of triangles, the copy of the
/// mesh and the description. `mesh` should be the mesh that the shell was built from; it is copied.
/// \throws InputError (no triangles, non-finite coordinates, indices out of range, a mesh that does not fit the
///         shell's root cube), OptionError (run), Cancelled.
VerifyReport verify(const ThinShell& shell, const MeshView& mesh, const VerifyOptions& options = {});

}  // namespace its
