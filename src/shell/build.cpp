#include <fmt/format.h>
#include <algorithm>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "distance/grid_distance.h"
#include "field/lscg.h"
#include "inspect/inspect.h"
#include "its/inspect.h"
#include "octree/voxelise.h"
#include "shell/budget.h"
#include "shell/extremes.h"
#include "shell/shell_data.h"
#include "signs/signs.h"

namespace its {

using namespace shell;

namespace {

constexpr std::uint64_t vertex_grain = 16384;
constexpr double lscg_tolerance =
    1e-12;  // max |f(g) − D(g)| relative to max |D|: reached in some 40 iterations

void check_options(const BuildOptions& options) {
    if (options.depth && (*options.depth < 0 || *options.depth > max_depth))
        throw OptionError(fmt::format("depth {}: must be 0 to {}", *options.depth, max_depth));
    require_threads(options.run.threads);
}

/// The rule to use, and one sentence that says why. A rule that is asked for takes the triangles' directions as
/// they are. \throws OptionError if the mesh cannot have it
std::pair<SignRule, std::string> choose_sign(const MeshReport& report, const BuildOptions& options) {
    if (!options.sign) return {report.sign, report.sign_reason};
    if (*options.sign == SignRule::winding && report.unbalanced_edges > 0)
        throw OptionError(fmt::format(
            "sign rule winding: {} edges of the mesh are not matched by opposite ones, so that its "
            "inside is not defined; use auto, generalized or unsigned, or close and orient the mesh",
            report.unbalanced_edges));
    if (*options.sign == SignRule::even_odd && report.odd_edges > 0)
        throw OptionError(
            fmt::format("sign rule even-odd: {} edges of the mesh have an odd number of triangles, so that its "
                        "inside is not defined; use auto, generalized or unsigned, or close the mesh",
                        report.odd_edges));
    return {*options.sign, "asked for"};
}

std::vector<Vec3> lattice_positions(const Mesh& mesh, const octree::Lattice& lattice) {
    std::vector<Vec3> positions(mesh.vertices.size());
    parallel_for(positions.size(), vertex_grain,
                 [&](std::uint64_t i) { positions[i] = lattice.to_lattice(mesh.vertices[i]); });
    return positions;
}

template <class T>
std::uint64_t bytes_of(const Array<T>& array) {
    return array.size() * sizeof(T);  // not the capacity: the same for any history
}

std::uint64_t memory_of(const ShellData& shell) {
    const SurfaceCells& surface = shell.surface;
    std::uint64_t bytes = bytes_of(surface.lower) + bytes_of(surface.upper) + bytes_of(surface.lists.offset) +
                          bytes_of(surface.lists.bytes) + bytes_of(shell.sides.winding);
    for (const auto& inside : shell.sides.inside) bytes += bytes_of(inside);
    for (const octree::Level& level : shell.octree.levels)
        bytes += bytes_of(level.parent) + bytes_of(level.mask) + level.first.bytes();
    for (const auto& values : shell.field.values) bytes += bytes_of(values);
    return bytes;
}

std::uint64_t groups_of(const octree::Octree& octree) {
    std::uint64_t groups = 0;
    for (const octree::Level& level : octree.levels) groups += level.groups();
    return groups;
}

ShellInfo describe(const ShellData& shell, const MeshReport& report) {
    ShellInfo info;
    const octree::Lattice& lattice = shell.lattice;
    info.depth = lattice.depth;
    info.mesh_closed = report.closed;
    info.mesh_vertices = report.vertices;
    info.mesh_triangles = report.triangles;
    info.scale = lattice.scale();
    info.cell_width = lattice.width;
    const std::int64_t cells = lattice.cells();
    info.root = {lattice.position({0, 0, 0}), lattice.position({cells, cells, cells})};
    // Multiplication by w is monotone in floating point too: f̂ ≤ ε₂ in cell widths stays true in mesh units.
    info.epsilon_inner = lattice.width * shell.epsilon_inner;
    info.epsilon_outer = lattice.width * shell.epsilon_outer;
    info.surface_cells = shell.octree.surface_cells();
    info.cells = 8 * groups_of(shell.octree) + 1;  // the root is in no group
    info.memory_bytes = memory_of(shell);
    return info;
}

/// One build, phase by phase. Each phase takes what it needs from those before and frees what none after needs.
class Builder {
public:
    Builder(const Mesh& mesh, const BuildOptions& options)
        : mesh_(mesh),
          options_(options),
          inspection_(inspector::examine(mesh)),  // throws on what is no mesh
          depth_(options.depth ? *options.depth : automatic_depth(mesh, options.max_memory)),
          budget_(mesh, depth_, options.max_memory) {
        std::tie(sign_, sign_reason_) = choose_sign(inspection_.report, options);
        budget_.check_expected();
        shell_->lattice = octree::make_lattice(inspection_.report.bounds, depth_);
        positions_ = lattice_positions(mesh, shell_->lattice);
        oriented_ = options.sign ? mesh : inspector::turned(mesh, inspection_.turn);
    }

    void find_cells() {
        const Stopwatch octree_time;
        voxels_ =
            octree::voxelise(positions_, mesh_.triangles, depth_, shell_->lattice.dilation(),
                             options_.run.progress, [&](int level, std::uint64_t cells, std::uint64_t pairs) {
                                 budget_.check_level(level, cells, pairs);
                             });
        times_.octree = octree_time.seconds();

        const Stopwatch sign_time;
        signs_.emplace(sign_, oriented_, shell_->lattice, voxels_, options_.run.progress);
        times_.signs = sign_time.seconds();

        const Stopwatch tree_time;
        shell_->octree = octree::make_octree(depth_, voxels_.cell);
        std::vector<std::uint64_t>().swap(voxels_.cell);
        budget_.check({mesh_.triangles.size(), groups_of(shell_->octree), shell_->octree.surface_cells(),
                       voxels_.triangle.size()});
        times_.octree += tree_time.seconds();
    }

    void find_distances() {
        const Stopwatch distance_time;
        distance_ =
            distance::grid_distances(shell_->octree, positions_, mesh_.triangles, options_.run.progress);
        times_.distance = distance_time.seconds();

        const Stopwatch sign_time;
        shell_->sides = signs_->apply(shell_->octree, distance_, options_.run.progress);
        signs_.reset();
        times_.signs += sign_time.seconds();
        times_.distance += times_.signs;
    }

    void find_field() {
        const Stopwatch time;
        shell_->field = field::solve_direct(std::move(distance_));
        if (options_.solver == Solver::lscg)
            shell_->field = field::solve_lscg(shell_->octree, shell_->field, lscg_tolerance,
                                              options_.run.progress, nullptr);
        times_.field = time.seconds();
    }

    void find_bounds() {
        const Stopwatch time;
        Extremes extremes =
            find_extremes(shell_->lattice, shell_->octree, shell_->field, positions_, mesh_.triangles,
                          voxels_.offset, voxels_.triangle, options_.extrema, options_.run.progress);
        shell_->surface.lower = std::move(extremes.cell_lower);
        shell_->surface.upper = std::move(extremes.cell_upper);
        shell_->surface.lists = pack_lists(shell_->octree.levels[0], voxels_.offset, voxels_.triangle);
        // A convex M may have f > 0 on all of it: the shell is the hull with 0.
        shell_->epsilon_inner = sign_ == SignRule::unsigned_rule ? 0.0 : std::min(extremes.lower, 0.0);
        shell_->epsilon_outer = std::max(extremes.upper, 0.0);
        rounding_ = shell_->lattice.width * extremes.rounding;
        times_.extrema = time.seconds();
    }

    ThinShell finish() {
        shell_->mesh = {std::move(oriented_.vertices), std::move(oriented_.triangles)};
        shell_->info = describe(*shell_, inspection_.report);
        shell_->info.sign = sign_;
        shell_->info.sign_reason = sign_reason_;
        shell_->info.extrema = options_.extrema;
        shell_->info.solver = options_.solver;
        shell_->info.rounding = rounding_;
        shell_->info.input_hash = input_hash(mesh_, options_);
        return ThinShell(std::move(shell_));
    }

    const BuildTimes& times() const { return times_; }

private:
    const Mesh& mesh_;
    const BuildOptions& options_;
    inspector::Inspection inspection_;
    int depth_;
    MemoryBudget budget_;
    SignRule sign_ = SignRule::unsigned_rule;
    std::string sign_reason_;
    BuildTimes times_;

    std::shared_ptr<ShellData> shell_ = std::make_shared<ShellData>();
    Mesh oriented_;  ///< the mesh, some triangles turned around where the sign rule was left to us
    std::vector<Vec3> positions_;  ///< of its vertices, in lattice coordinates
    octree::Voxels voxels_;
    std::optional<signs::Signs> signs_;
    std::vector<std::vector<double>> distance_;
    double rounding_ = 0;
};

}  // namespace

ThinShell build(const Mesh& mesh, const BuildOptions& options, BuildTimes* times) {
    check_options(options);
    return with_threads(options.run.threads, [&] {
        const Stopwatch total;
        Builder builder(mesh, options);
        builder.find_cells();
        builder.find_distances();
        builder.find_field();
        builder.find_bounds();
        ThinShell shell = builder.finish();
        if (times) {
            *times = builder.times();
            times->total = total.seconds();
        }
        return shell;
    });
}

std::uint64_t estimate_memory(const Mesh& mesh, int depth, const Run& run) {
    return with_threads(run.threads, [&] { return build_bytes(estimate_size(mesh, depth)); });
}

}  // namespace its
