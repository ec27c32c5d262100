#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "its/shell.h"

/// Level sets of f as triangle meshes, and proven to wrap M where asked.
namespace ITS_API its {

enum class SurfaceSide : std::uint8_t {
    outer,  ///< around M: the level set at ε₂, moved outward until proven to enclose M
    inner,  ///< inside M: the level set at ε₁, moved inward until proven to be enclosed
    zero,   ///< f = 0, near M; crosses M, hence never certified
};

/// "outer", "inner", "zero".
std::string_view name(SurfaceSide side);
/// The side of that name; empty: there is none.
std::optional<SurfaceSide> parse_surface_side(std::string_view name);

struct SurfaceOptions {
    SurfaceSide side = SurfaceSide::outer;
    /// Extract at this value of f, in mesh units, and do not move it. Empty: the side's own level.
    std::optional<double> level = {};
    /// Cells along the scale s, 1 to 65536. 0: the shell's own finest lattice, 2^depth, on which f is
    /// trilinear and level sets are exact on lattice edges.
    int resolution = 0;
    /// Bound f over every triangle and, unless `level` is given, move the level by the smallest change that
    /// keeps the surface off M. Without it the level is the side's own and the surface may touch M.
    bool certify = true;
    Coordinates coordinates = Coordinates::doubles;
    /// Bytes beyond the shell itself, or 0 for three quarters of what is free; estimated before they are taken.
    std::uint64_t max_memory = 0;
    bool measure = false;  ///< measure SurfaceReport::to_mesh and from_mesh: costs about as much again
    Run run = {};
};

/// What is known of a surface. Lengths and values of f in mesh units.
struct SurfaceReport {
    SurfaceSide side = SurfaceSide::outer;
    double level = 0;        ///< the value of f that was extracted
    bool empty = false;      ///< f does not take this level: no triangles
    bool certified = false;  ///< proven: disjoint from M and, by side, enclosing all of M or enclosed by it
    /// Proven distance between the values of f on the surface and on M: min f − ε₂ outside, ε₁ − max f inside;
    /// > 0 iff certified. 0 for an empty surface or without `certify`.
    double margin = 0;
    /// Proven: lowest ≤ f ≤ highest on every point of the mesh, rounding included. With `certify` only.
    double lowest = 0, highest = 0;
    std::string reason;  ///< one sentence where empty or not certified, else empty
    /// Parts of M that share no vertices, and how many of them have the surface around a vertex of theirs
    /// (inner: not around it), exactly, by winding numbers: with a margin above 0 around the whole part. Other
    /// lattices than the shell's own may miss parts smaller than a cell: the level is moved until none is
    /// missed or, if it is given, the surface is not certified. With `certify` only.
    std::uint64_t components = 0, components_enclosed = 0;
    Vec3 origin;  ///< of Coordinates::single_offset: (0, 0, 0) unless M is far from it for its size
    /// For an empty inner surface: what is expected to give one, a thickness in mesh units, or a depth where
    /// the shell was built at a depth; 0 if none up to max_depth is.
    double thickness_wanted = 0;
    int depth_wanted = 0;
    double cell_width = 0;    ///< of the lattice it was extracted on
    std::uint64_t cells = 0;  ///< lattice cells that the surface runs through
    /// MeshDistance::max of mesh_distance(), from the surface to M and from M to the surface: measured lower
    /// bounds of the one-sided Hausdorff distances. With `measure` only.
    std::optional<double> to_mesh = {}, from_mesh = {};
    /// Wall clock: extraction with its certificate, measuring, the call.
    struct Seconds {
        double extract = 0, measure = 0, total = 0;
    } seconds;
};

struct Surface {
    /// Closed, 2-manifold, oriented towards growing f (outward), without self-intersections or degenerate
    /// triangles. Vertices are on lattice edges (rare ones inside cells), and of the kind of SurfaceOptions.
    Mesh mesh;
    SurfaceReport report;
};

/// The level set of f, by marching cubes with the asymptotic decider (Nielson and Hamann 1991) and embedded
/// fans (docs/design/surface.md). Without inside (sign rule unsigned) the outer surface runs around both sides
/// of M, and the others are empty.
/// \throws OptionError (resolution or threads out of range, level not finite, a level set that leaves the root
///         cube, or numbers that are too coarse for the lattice), InputError (values of f that no build makes),
///         MemoryError, Cancelled.
Surface extract_surface(const ThinShell& shell, const SurfaceOptions& options = {});

}  // namespace its
