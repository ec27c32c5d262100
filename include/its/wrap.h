#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "its/base.h"
#include "its/inspect.h"
#include "its/mesh.h"

/// Surfaces at a proven distance from a mesh.
namespace ITS_API its {

enum class WrapSide : std::uint8_t {
    outer,  ///< around M; around both sides of it where it has no inside
    inner,  ///< inside M, which must be closed
};

/// "outer", "inner".
std::string_view name(WrapSide side);
/// The side of that name; empty: there is none.
std::optional<WrapSide> parse_wrap_side(std::string_view name);

/// Lengths in mesh units.
struct WrapOptions {
    double clearance = 0;  ///< C ≥ 0: no point of the wrap is nearer to M
    /// S > 0: no point of the wrap is farther from M than C + S. 0: 2 % of C or 0.1 % of the longest side of
    /// M's bounds, whichever is larger.
    double slack = 0;
    WrapSide side = WrapSide::outer;
    Coordinates coordinates = Coordinates::doubles;
    std::uint64_t max_memory = 0;  ///< bytes beyond the mesh, or 0 for three quarters of what is free
    bool measure = false;          ///< measure WrapReport::to_mesh and from_mesh
    Run run = {};
};

/// What is known of a wrap. Lengths in mesh units.
struct WrapReport {
    WrapSide side = WrapSide::outer;
    double clearance = 0, slack = 0;  ///< that were asked for; the slack that was used, where it was not given
    SignRule sign = SignRule::unsigned_rule;  ///< what its inside is: winding, even_odd, or unsigned_rule
    bool empty = false;                       ///< an inner wrap for which M is too thin, or has no inside
    std::string reason;                       ///< one sentence where empty, else empty
    /// Proven, rounding included: clearance ≤ lowest ≤ d(x, M) ≤ highest ≤ clearance + slack for every point x.
    double lowest = 0, highest = 0;
    /// Connected parts of M, all of which an outer wrap encloses, and of the wrap, all of which lie within M
    /// where it is an inner one: by exact winding numbers about a point of each.
    std::uint64_t mesh_components = 0, components = 0;
    double volume = 0;                       ///< that the wrap encloses
    std::optional<double> mesh_volume = {};  ///< that M encloses, where it has an inside
    std::uint64_t cells = 0;                 ///< of the octree, that the wrap runs through
    int passes = 0;                          ///< in which they were halved
    Vec3 origin;  ///< of Coordinates::single_offset: (0, 0, 0) unless M is far from it for its size
    /// MeshDistance::max of mesh_distance(), from the wrap to M and from M to the wrap: measured. With
    /// `measure` only.
    std::optional<double> to_mesh = {}, from_mesh = {};
    /// Wall clock: making it with its proof, measuring, the call.
    struct Seconds {
        double wrap = 0, measure = 0, total = 0;
    } seconds;
};

struct Wrap {
    /// Closed, 2-manifold, without self-intersections or degenerate triangles, disjoint from M; oriented
    /// outward as seen from the solid that it bounds.
    Mesh mesh;
    WrapReport report;
};

/// A surface around M, or inside it, between two distances from it: docs/design/wrap.md.
///
/// A mesh with boundary that does not cancel has no inside: its wrap runs around both sides of the sheet. Where
/// only directions of triangles are wrong, they are turned as build() turns them.
/// \throws InputError (as inspect(); a mesh too small, large or far from the origin), OptionError (clearance or
///         slack out of range, or finer than coordinates can tell or be proven with, run), MemoryError,
///         Cancelled
Wrap wrap(const MeshView& mesh, const WrapOptions& options = {});

}  // namespace its
