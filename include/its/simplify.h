#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "its/base.h"
#include "its/inspect.h"
#include "its/mesh.h"
#include "its/shell.h"

/// Mesh simplification by edge collapses in the order of quadric errors, with a proven bound on the error.
namespace ITS_API its {

enum class SimplifyMethod : std::uint8_t {
    certified,  ///< proven: what SimplifyOptions says
    vertex,     ///< the paper's: a new vertex v needs ε₁ < f(v) < ε₂
    priority,   ///< the paper's: cheapest first by quadric error + γ f²
    qem,        ///< quadric errors alone (Garland and Heckbert 1997)
};

/// "certified", "vertex", "priority", "qem".
std::string_view name(SimplifyMethod method);
/// The method of that name; empty: there is none.
std::optional<SimplifyMethod> parse_simplify_method(std::string_view name);

/// What `certified` proves depends on what is asked for. Lengths are in mesh units, and hold for every point of
/// the mesh's surface M and of the result R.
///
/// `tolerance`: d(x, M) ≤ tolerance for x in R, and d(y, R) ≤ tolerance for y in M. Collapses until none is
/// left that keeps this.
///
/// `faces`: the same, with a tolerance that is raised until the count is reached; the report has it.
///
/// Both: the tolerance is not exceeded, and the count ends it.
///
/// `thickness` or `depth`: besides, every point of R evaluates to f in [ε₁, ε₂] of that shell.
///
/// Neither `tolerance` nor `faces`: the shell alone, the one that build() makes if neither is given.
struct SimplifyOptions {
    SimplifyMethod method = SimplifyMethod::certified;
    /// Stop at this many triangles or fewer; at least what the mesh's topology needs. priority and qem need it.
    std::optional<std::uint64_t> faces = {};
    /// Mesh units, > 0; certified only.
    std::optional<double> tolerance = {};
    /// Of the shell, as in BuildOptions: one of them, or none; not for qem. None: as build() makes it by
    /// itself; by `vertex` with `faces`, of shells that are thicker and thicker from there on the first in
    /// which the number is reached.
    std::optional<int> depth = {};
    double thickness = 0;
    std::optional<SignRule> sign = {};  ///< of the shell; empty: by the state of the mesh
    bool turn_parts = false;            ///< simplify what turn_parts() makes of the mesh
    double gamma = 1;  ///< γ ≥ 0 of priority. Errors and f are in units of the longest side of the bounds, and
                       ///< quadric errors weigh a triangle by its share of the mean one: no unit matters
    bool no_self_intersections = false;  ///< the result has none, by exact predicates; M must have none
    Coordinates coordinates = Coordinates::doubles;  ///< of the result; what is proven holds for those
    std::uint64_t max_memory = 0;  ///< bytes for building the shell; 0: three quarters of what is free
    Run run = {};
};

enum class SimplifyStop : std::uint8_t {
    faces_reached,
    tolerance_reached,  ///< no collapse is left that is proven to keep tolerance, shell and topology
    shell_reached,      ///< no collapse is left that keeps the shell and the topology
    topology_reached,   ///< no collapse is left that keeps the topology and flips no triangle
};

/// The enumerator, with hyphens: "faces-reached".
std::string_view name(SimplifyStop stop);
/// The stop of that name; empty: there is none.
std::optional<SimplifyStop> parse_simplify_stop(std::string_view name);
/// One sentence.
std::string_view reason(SimplifyStop stop);

struct SimplifyReport {
    std::uint64_t faces_before = 0, faces_after = 0;
    std::uint64_t vertices_before = 0, vertices_after = 0;  ///< distinct positions used by triangles
    std::uint64_t collapses = 0, refused = 0;               ///< refused: tests that came out negative
    SimplifyStop stop = SimplifyStop::topology_reached;
    /// Proven for every point: d(x, M) ≤ bound on the result, d(y, result) ≤ bound on M. Empty: nothing proven.
    std::optional<double> proven_bound;
    std::uint64_t seam_edges_before = 0, seam_edges_after = 0;  ///< where colours or texture coordinates jump
    Vec3 origin;  ///< of Coordinates::single_offset: (0, 0, 0) unless M is far from it for its size
    std::optional<ShellInfo> shell;  ///< of the shell that was used
    bool in_shell = false;           ///< proven: every point of the result is in the shell
    /// Of the mesh as it came; empty unless there was a shell or parts were to be turned.
    std::optional<PartsReport> parts;
    /// Wall clock: building the shell, collapsing, the call.
    struct Seconds {
        double shell = 0, simplify = 0, total = 0;
    } seconds;
};

struct Simplified {
    Mesh mesh;  ///< triangles keep their orientation; vertices with identical coordinates are one
    MeshAttributes attributes;  ///< of that mesh, if it came with any
    SimplifyReport report;
};

/// Simplifies a mesh. Topology is kept: components, holes, boundary loops, handles. Boundaries may move only by
/// merging their own vertices. Vertices where the mesh is no manifold with boundary stay where they are.
/// \throws InputError (no triangles, non-finite coordinates, indices out of range; self-intersections that must
///         not be), OptionError (out of range, contradicting, a tolerance below what coordinates can resolve or
///         above which the shell of the given depth is thicker, fewer faces than the topology needs),
///         MemoryError, Cancelled.
Simplified simplify(const MeshView& mesh, const SimplifyOptions& options = {});

/// The same with attributes. Seams (edges where colours or texture coordinates jump) are held: their vertices
/// go only by merging along the seam, none moves, and both sides keep their values there. Hence no triangle of
/// the result has values of two sides of a seam. Elsewhere a vertex has the values of a nearest point of M on
/// its own side, interpolated. Normals are computed anew.
/// \throws besides, as check_attributes()
Simplified simplify(const MeshView& mesh, const MeshAttributes& attributes,
                    const SimplifyOptions& options = {});

}  // namespace its
