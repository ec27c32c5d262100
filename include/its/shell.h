#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "its/base.h"
#include "its/inspect.h"
#include "its/mesh.h"

/// The implicit thin shell of a mesh: a function f and two numbers with ε₁ ≤ f ≤ ε₂ on all of M.
/// Wen et al., "ITS: Implicit Thin Shell for Polygonal Meshes", arXiv 2411.01488.
namespace ITS_API its {

enum class Extrema : std::uint8_t {
    certified,   ///< Bernstein–Bézier bounds with branch and bound: proven for the floating-point code
    candidates,  ///< the paper's finite set of candidate points
};

/// "certified", "candidates".
std::string_view name(Extrema extrema);
/// The value of that name; empty: there is none.
std::optional<Extrema> parse_extrema(std::string_view name);

enum class Solver : std::uint8_t {
    direct,  ///< hierarchical coefficients, one pass, satisfies every equation
    lscg,    ///< the paper's least-squares conjugate gradients; slow, for comparison; needs a build with Eigen
};

/// "direct", "lscg".
std::string_view name(Solver solver);
/// The solver of that name; empty: there is none.
std::optional<Solver> parse_solver(std::string_view name);

inline constexpr int max_depth = 16;  ///< the largest depth K of a shell with cells of one size
/// Of a shell for which neither a thickness nor a depth is asked: longest sides of the mesh, and, so that no
/// mesh takes minutes, the cells of all levels.
inline constexpr double default_thickness = 0.002;
inline constexpr std::uint64_t default_max_cells = 4'000'000, default_cells_per_triangle = 4;
inline constexpr int least_adaptive_depth = 3,
                     max_adaptive_depth = 20;  ///< the same of one that was built to a thickness

struct BuildOptions {
    /// K, in [0, max_depth]: all cells that meet the mesh are s·2⁻ᴷ wide. Empty: built to a thickness.
    std::optional<int> depth = {};
    /// ε₂ − ε₁ shall be at most this, mesh units; 0: default_thickness, or, far from the origin, what roundings
    /// allow. Cells that meet the mesh are as large as this allows: many times fewer than with cells of one
    /// size (docs/design/adaptive.md). Where cells or memory do not suffice, the shell is as thin as they
    /// allow, see ShellInfo::coarse_cells. Not with `depth`, which Extrema::candidates and Solver::lscg need.
    double thickness = 0;
    /// Of all levels, of a shell that is built to a thickness; the coarsest one, whose surface cells are of
    /// depth least_adaptive_depth, may have more. 0: any number, but where the thickness is the default one,
    /// default_max_cells + default_cells_per_triangle · triangles.
    std::uint64_t max_cells = 0;
    /// Of a shell that is built to a thickness: cells are at least s·2⁻ᴷ wide, K from least_adaptive_depth to
    /// max_adaptive_depth. Empty: max_adaptive_depth.
    std::optional<int> deepest = {};
    std::optional<SignRule> sign = {};  ///< empty: by the state of the mesh, see MeshReport::sign
    /// Mesh units, 0: none. Corners of triangles that are nearer than this become one first, see weld(): the
    /// shell, and all that is proven of it, is then of the welded mesh.
    double weld = 0;
    /// Build from what turn_parts() makes of the mesh, if the rule goes by directions.
    bool turn_parts = false;
    Extrema extrema = Extrema::certified;
    Solver solver = Solver::direct;
    UpAxis up = UpAxis::unknown;   ///< MeshFile::up, for the shell to remember; changes nothing else
    std::uint64_t max_memory = 0;  ///< bytes; 0: three quarters of what is free now
    Run run = {};
};

/// How a shell was built, and what it holds. Lengths in mesh units.
struct ShellInfo {
    int depth = 0;
    SignRule sign = SignRule::unsigned_rule;
    std::string sign_reason;
    Extrema extrema = Extrema::certified;
    Solver solver = Solver::direct;
    UpAxis up = UpAxis::unknown;  ///< of the coordinates, where BuildOptions had it
    bool mesh_closed = false;
    std::uint64_t mesh_vertices = 0, mesh_triangles = 0;
    double weld = 0;                  ///< the mesh is the given one with corners nearer than this made one
    double scale = 0;                 ///< s: the longest side of the bounds, rounded up to the lattice
    double cell_width = 0;            ///< w = s·2⁻ᴷ
    Box root;                         ///< the root cube, side 2s, or 8 cells at K = 0 and 1
    double epsilon_inner = 0;         ///< ε₁ ≤ 0
    double epsilon_outer = 0;         ///< ε₂ ≥ 0
    double rounding = 0;              ///< γ, the proven rounding error contained in ε₁ and ε₂
    std::uint64_t surface_cells = 0;  ///< undivided cells that meet M
    std::uint64_t cells = 0;          ///< of all levels
    std::uint64_t memory_bytes = 0;   ///< of the shell without its copy of the mesh
    std::array<std::uint64_t, 2> input_hash = {};  ///< input_hash() of mesh and options; 0: not known
    double thickness_asked = 0;      ///< BuildOptions::thickness or the default; 0: it was built at a depth
    std::uint64_t coarse_cells = 0;  ///< surface cells in which f on M is not proven as small as was asked for
    Box coarse = {};                 ///< the bounds of these
    std::uint64_t max_cells = 0;     ///< BuildOptions::max_cells or the default; 0: any number
    int deepest = -1;                ///< BuildOptions::deepest; −1: empty
    bool adaptive = false;           ///< cells that meet M are of several sizes; `depth` is that of the finest
    double thickness() const { return epsilon_outer - epsilon_inner; }  ///< ε₂ − ε₁
};

/// Wall-clock seconds of a build and its stages.
struct BuildSeconds {
    double octree = 0, distance = 0, field = 0, extrema = 0;
    double signs = 0;  ///< contained in distance
    double total = 0;
};

namespace shell {
struct Access;  // the library's own way in
}

/// An immutable shell, made by build(), load() or decode(). Copies share the same data. All members may be
/// called from any number of threads.
class ThinShell {
public:
    const ShellInfo& info() const;

    /// How long the build took. Not part of the shell, and in no file: all 0 for one that was read.
    const BuildSeconds& build_seconds() const;

    /// The mesh that the shell was built from, as the shell keeps it: nothing is copied. Valid as long as a
    /// copy of the shell exists.
    MeshView mesh_view() const;
    /// The same as a Mesh of its own: a copy that is made at the first call and shared by all copies of the
    /// shell.
    const Mesh& mesh() const;

    /// f anywhere in space, in mesh units; negative inside. Continuous; outside the root cube the value at
    /// the nearest point of the cube plus the distance to it, infinite where that is beyond all doubles. NaN
    /// for a non-finite point.
    double value(const Vec3& point) const;

    /// ∇f, without unit. On lattice planes, where f has a kink, the one-sided gradient of the cell that
    /// floor() selects. NaN for a non-finite point.
    Vec3 gradient(const Vec3& point) const;

    /// Grid points of all levels; one position on two levels counts twice. Counted anew at each call, in linear
    /// time, unless the shell was loaded from a file. Reports no progress.
    /// \throws OptionError (run).
    std::uint64_t grid_points(const Run& run = {}) const;

private:
    friend struct shell::Access;
    struct Data;
    explicit ThinShell(std::shared_ptr<const Data> data);

    std::shared_ptr<const Data> data_;
};

/// Builds the shell of any mesh, of which it keeps a copy. Method and departures from the paper:
/// docs/design/README.md.
/// \param report  if not null, receives what inspect() says about the mesh.
/// \throws InputError (no triangles, non-finite coordinates, indices out of range, a size that is not in
///         [1e-75, 1e75], too far from the origin for its size, or for its coordinates to tell lengths of
///         BuildOptions::weld apart), OptionError, MemoryError (names the largest depth that fits), Cancelled.
ThinShell build(const MeshView& mesh, const BuildOptions& options = {}, MeshReport* report = nullptr);

/// A hash of all that the result of build() depends on: the mesh, the options as given (not how they
/// are to run), the depth or thickness, given or the default, and the version of this library.
/// ShellInfo::input_hash has it, so that a stored shell can be recognised. 128 bits, not meant to withstand
/// somebody who wants two inputs to agree. Meshes with the same numbers have the same hash, whatever the layout
/// of their arrays.
/// \throws InputError on indices that no Triangle can hold, and as MeshView says; where no depth is given,
///         besides, as build()
std::array<std::uint64_t, 2> input_hash(const MeshView& mesh, const BuildOptions& options = {});

/// Bytes that build() would take at its peak for this mesh and depth, with the sign rule that it would choose:
/// an estimate from cells of twice the width, which are counted, or larger ones where that would take long.
/// build() checks again, exactly, once the finest cells are counted. Reports no progress.
/// \throws as build()
std::uint64_t estimate_memory(const MeshView& mesh, int depth, const Run& run = {});

}  // namespace its
