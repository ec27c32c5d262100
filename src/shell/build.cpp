#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "adaptive/refine.h"
#include "base/names.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "distance/grid_distance.h"
#include "field/lscg.h"
#include "geometry/box.h"
#include "inspect/inspect.h"
#include "its/inspect.h"
#include "its/memory.h"
#include "its/stopwatch.h"
#include "its/weld.h"
#include "mesh/arrays.h"
#include "mesh/require.h"
#include "octree/voxelise.h"
#include "shell/access.h"
#include "shell/budget.h"
#include "shell/extremes.h"
#include "shell/shell_data.h"
#include "shell/target.h"
#include "signs/signs.h"

namespace its {

using namespace shell;

namespace {

constexpr std::uint64_t vertex_grain = 16384;
constexpr double lscg_tolerance =
    1e-12;  // max |f(g) − D(g)| relative to max |D|: reached in some 40 iterations

void check_depth(int depth) {
    if (depth < 0 || depth > max_depth)
        throw OptionError(fmt::format("depth {}: must be 0 to {}", depth, max_depth));
}

void check_thickness(const BuildOptions& options) {
    if (!(options.thickness >= 0) || !std::isfinite(options.thickness))
        throw OptionError(fmt::format("thickness {}: must be finite and at least 0", options.thickness));
    if (options.deepest && (*options.deepest < least_adaptive_depth || *options.deepest > max_adaptive_depth))
        throw OptionError(fmt::format("deepest cells of depth {}: must be {} to {}", *options.deepest,
                                      least_adaptive_depth, max_adaptive_depth));
    if (!options.depth) {
        if (options.solver != Solver::direct || options.extrema != Extrema::certified)
            throw OptionError(
                "cells of several sizes need the direct solver and certified bounds; give a depth "
                "with lscg and candidates");
        return;
    }
    if (options.thickness > 0)
        throw OptionError("thickness and depth: a shell is built to one of them; leave the other out");
    if (options.max_cells > 0 || options.deepest)
        throw OptionError("limits of cells and of their depth are of shells that are built to a thickness");
}

void check_options(const BuildOptions& options) {
    if (options.solver == Solver::lscg && !field::has_lscg())
        throw OptionError(
            "the solver LSCG is not part of this library, which was built without Eigen; choose the direct "
            "one");
    if (options.depth) check_depth(*options.depth);
    check_thickness(options);
    if (!(options.weld >= 0) || !std::isfinite(options.weld))
        throw OptionError(fmt::format("welding length {}: must be finite and at least 0", options.weld));
    require_threads(options.run.threads);
}

/// The rule to use, and one sentence that says why. A rule that is asked for takes the triangles' directions as
/// they are.
/// \throws OptionError if the mesh cannot have it
std::pair<SignRule, std::string> choose_sign(const MeshReport& report, const BuildOptions& options) {
    if (!options.sign) return {report.sign, report.sign_reason};
    if (*options.sign == SignRule::winding && report.open_edges > 0)
        throw OptionError(fmt::format(
            "sign rule winding: {} edges of the mesh are not matched by opposite ones, so that its "
            "inside is not defined; take generalized, unsigned, or the rule that suits the mesh, or close "
            "and orient it",
            report.open_edges));
    if (*options.sign == SignRule::even_odd && report.open_odd_edges > 0)
        throw OptionError(fmt::format(
            "sign rule even-odd: {} edges of the mesh have an odd number of triangles, so that its "
            "inside is not defined; take generalized, unsigned, or the rule that suits the mesh, or "
            "close it",
            report.open_odd_edges));
    return {*options.sign, "asked for"};
}

std::vector<Vec3> lattice_positions(const mesh::Arrays& mesh, const octree::Lattice& lattice) {
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
                          bytes_of(surface.lists.bytes) + bytes_of(shell.sides.winding) +
                          bytes_of(surface.corners_inside);
    for (const auto& inside : shell.sides.inside) bytes += bytes_of(inside);
    for (const octree::Level& level : shell.octree.levels)
        bytes += bytes_of(level.parent) + bytes_of(level.mask) + level.first.bytes() +
                 (level.leaf.empty() ? 0 : bytes_of(level.leaf) + level.first_leaf.bytes());
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
    info.depth = lattice.resolution_depth();
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
    info.adaptive = shell.octree.adaptive();
    info.cells = 8 * groups_of(shell.octree) + 1;  // the root is in no group
    info.memory_bytes = memory_of(shell);
    return info;
}

/// How far a build's progress is after each phase; typical of models of 30,000 to 200,000 triangles at depth 7
/// to 9.
struct Shares {
    double octree = 0.2, signs = 0.25, distance = 0.75, sides = 0.77, field = 0.77;
};

Shares shares_of(SignRule rule, Solver solver) {
    if (solver == Solver::lscg) return {0.02, 0.04, 0.1, 0.12, 0.95};
    if (rule == SignRule::generalized) return {0.15, 0.35, 0.7, 0.82, 0.82};
    return {};
}

/// One build, phase by phase. Each phase takes what it needs from those before and frees what none after needs.
class Builder {
public:
    /// One that is built to a thickness has no depth of its own, nor a budget before it begins.
    bool adaptive() const { return target_.adaptive(); }

    /// \param given  what the mesh was before welding
    Builder(const mesh::Arrays& mesh, const BuildOptions& options, const mesh::Arrays& given,
            const Progress& progress)
        : mesh_(mesh),
          given_(given),
          options_(options),
          parts_(progress),
          inspection_(inspector::examine(mesh, parts_.until(0))),  // throws on what is no mesh
          target_(target_of(given, options)),
          depth_(options.depth ? *options.depth
                               : depth_for(target_.thickness, inspection_.report.bounds, options)),
          budget_(mesh, depth_, options.max_memory) {
        report_ = inspection_.report;
        if (options.turn_parts) turn_parts();
        std::tie(sign_, sign_reason_) = choose_sign(inspection_.report, options);
        const bool directed = sign_ == SignRule::winding || sign_ == SignRule::generalized;
        if (options.turn_parts && directed && report_.parts.to_turn > 0)
            sign_reason_ +=
                fmt::format("; {} closed parts are turned around by nesting", report_.parts.to_turn);
        shares_ = shares_of(sign_, options.solver);
        if (adaptive())
            require_memory(build_bytes({.triangles = mesh.triangles.size()}), options.max_memory,
                           fmt::format("the shell of {} triangles, without any cell,", mesh.triangles.size()),
                           "simplify the mesh, or raise the limit");
        shell_.lattice =
            adaptive() ? octree::make_nested_lattice(inspection_.report.bounds, depth_, least_adaptive_depth)
                       : octree::make_lattice(inspection_.report.bounds, depth_);
        positions_ = lattice_positions(mesh, shell_.lattice);
        if (!options.turn_parts || !directed) oriented_ = mesh::copy_of(mesh);
        if (!options.sign) oriented_ = inspector::turned(std::move(oriented_), inspection_.turn);
        const bool as_inspected = !options.sign || inspection_.turn.empty();
        if (sign_ != SignRule::generalized || !as_inspected) inspection_.filling.reset();
    }

    /// Cells, distances, signs and the field at once; then the bounds.
    void refine() {
        const Stopwatch time;
        const double width = shell_.lattice.width, asked = target_.thickness / width;
        // Bounds may be above what is attained by a gap, too.
        const double rounding = expected_rounding(shell_.lattice), room = asked - 2 * (rounding + extreme_gap);
        if (!(room > 0))
            throw OptionError(
                fmt::format("thickness {}: rounding alone is {} here; ask for more, or move the mesh nearer to "
                            "the origin",
                            target_.thickness, 2 * width * rounding));
        adaptive::Refined refined =
            sign_ == SignRule::generalized ? refine_open(asked, room) : refine_to(room, parts_.until(0.7));
        const int levels = shell_.lattice.depth - refined.depth;
        shell_.lattice = octree::coarser(shell_.lattice, levels);
        positions_ = lattice_positions(mesh_, shell_.lattice);
        shell_.octree = std::move(refined.octree);
        shell_.sides = std::move(refined.sides);
        shell_.surface.corners_inside = std::move(refined.corners_inside);
        shell_.field = field::solve_direct(std::move(refined.values));
        voxels_.offset = std::move(refined.offset);
        voxels_.triangle = std::move(refined.triangle);
        coarse_ = std::move(refined.coarse);
        seconds_.octree = time.seconds();
    }

    void find_cells() {
        const Stopwatch octree_time;
        voxels_ = octree::voxelise(positions_, mesh_.triangles, shell_.lattice.depth, shell_.lattice.dilation(),
                                   parts_.until(shares_.octree),
                                   [&](int level, std::uint64_t cells, std::uint64_t pairs) {
                                       budget_.check_level(level, cells, pairs);
                                   });
        seconds_.octree = octree_time.seconds();

        const std::size_t met = voxels_.cell.size();
        const Stopwatch sign_time;
        signs_.emplace(sign_, oriented_, shell_.lattice, voxels_, parts_.until(shares_.signs),
                       std::exchange(inspection_.filling, {}));
        seconds_.signs = sign_time.seconds();

        const std::size_t flips = voxels_.cell.size() - met;
        const Stopwatch tree_time;
        shell_.octree = octree::make_octree(shell_.lattice.depth, voxels_.cell);
        std::vector<std::uint64_t>().swap(voxels_.cell);
        budget_.check({mesh_.triangles.size(), groups_of(shell_.octree), shell_.octree.surface_cells(),
                       voxels_.triangle.size(), flips});
        seconds_.octree += tree_time.seconds();
    }

    void find_distances() {
        const Stopwatch distance_time;
        distance_ = distance::grid_distances(shell_.octree, positions_, mesh_.triangles,
                                             parts_.until(shares_.distance));
        seconds_.distance = distance_time.seconds();

        const Stopwatch sign_time;
        shell_.sides = signs_->apply(shell_.octree, distance_, parts_.until(shares_.sides));
        signs_.reset();
        seconds_.signs += sign_time.seconds();
        seconds_.distance += seconds_.signs;
    }

    void find_field() {
        const Stopwatch time;
        shell_.field = field::solve_direct(std::move(distance_));
        if (options_.solver == Solver::lscg)
            shell_.field = field::solve_lscg(shell_.octree, shell_.field, lscg_tolerance,
                                             parts_.until(shares_.field), nullptr);
        seconds_.field = time.seconds();
    }

    void find_bounds() {
        const Stopwatch time;
        Extremes extremes =
            find_extremes(shell_.lattice, shell_.octree, shell_.field, positions_, mesh_.triangles,
                          voxels_.offset, voxels_.triangle, options_.extrema, parts_.until(1));
        shell_.surface.lower = std::move(extremes.cell_lower);
        shell_.surface.upper = std::move(extremes.cell_upper);
        shell_.surface.lists = pack_lists(shell_.octree, voxels_.offset, voxels_.triangle);
        // A convex M may have f > 0 on all of it: the shell is the hull with 0.
        shell_.epsilon_inner = sign_ == SignRule::unsigned_rule ? 0.0 : std::min(extremes.lower, 0.0);
        shell_.epsilon_outer = std::max(extremes.upper, 0.0);
        rounding_ = shell_.lattice.width * extremes.rounding;
        seconds_.extrema = time.seconds();
    }

    ThinShell finish() {
        shell_.mesh = {std::move(oriented_.vertices), std::move(oriented_.triangles)};
        shell_.info = describe(shell_, inspection_.report);
        shell_.info.sign = sign_;
        shell_.info.sign_reason = sign_reason_;
        shell_.info.extrema = options_.extrema;
        shell_.info.solver = options_.solver;
        shell_.info.up = options_.up;
        shell_.info.rounding = rounding_;
        shell_.info.weld = options_.weld;
        shell_.info.thickness_asked = target_.thickness;
        shell_.info.max_cells = target_.max_cells;
        shell_.info.deepest = options_.deepest.value_or(-1);
        if (adaptive()) compare_with_what_was_asked();
        shell_.info.coarse_cells = coarse_.size();
        shell_.info.coarse = bounds_of(coarse_);
        shell_.info.input_hash = hash_of(given_, options_, target_);
        seconds_.total = total_.seconds();
        return Access::make(std::move(shell_), seconds_);
    }

    const MeshReport& report() const { return report_; }

private:
    adaptive::Refined refine_to(double room, const Progress& progress) {
        return adaptive::refine(refinement_task(room), progress);
    }

    /// Values at corners of the cells that close holes are distances to these; where in the end no surface cell
    /// is so small, there would be no such cells to see in the shell: then larger ones close them.
    adaptive::Refined refine_open(double asked, double room) {
        for (int level = level_of_holes(asked);;) {
            close_holes(level);
            adaptive::Refined refined = refine_to(room, parts_.until(0.7));
            const int finest = shell_.lattice.depth - refined.depth;
            open_.reset();
            if (finest <= level) return refined;
            level = finest;
        }
    }

    /// Holes are closed by cells of 16 times the thickness, unless memory allows only larger ones.
    int level_of_holes(double asked) const {
        const octree::Lattice& lattice = shell_.lattice;
        const int coarsest = lattice.depth - least_adaptive_depth;
        int level = std::clamp(std::ilogb(16 * asked), 0, coarsest);
        const std::uint64_t limit = memory_limit(options_.max_memory);
        while (level < coarsest && build_bytes(estimate_size(mesh_, lattice.depth - level)) > limit) ++level;
        return level;
    }

    void close_holes(int level) {
        const Stopwatch time;
        open_.emplace(mesh::Arrays(oriented_), shell_.lattice, level, parts_.until(0.2),
                      std::exchange(inspection_.filling, {}));
        seconds_.signs += time.seconds();
        positions_ = lattice_positions(mesh::Arrays(open_->closed()), shell_.lattice);
    }

    adaptive::Task refinement_task(double room) {
        const bool one_sided = sign_ == SignRule::unsigned_rule;
        const mesh::Arrays mesh(open_ ? open_->closed() : oriented_);
        const std::uint64_t limit = memory_limit(options_.max_memory),
                            of_mesh = build_bytes({.triangles = mesh.triangles.size()});
        return {.lattice = shell_.lattice,
                .positions = positions_,
                .mesh = mesh,
                .rule = sign_,
                .open = open_ ? &*open_ : nullptr,
                .lower = one_sided ? -room : -0.5 * room,
                .upper = one_sided ? room : 0.5 * room,
                .least_depth = least_adaptive_depth,
                .many_width = 4 * room,
                .max_cells = target_.max_cells > 0 ? target_.max_cells : ~std::uint64_t{0},
                .max_bytes = limit - std::min(limit, of_mesh)};
    }

    /// The window of each cell is symmetric: what misses it on one side may do no harm. And the window is as
    /// wide as the γ that is expected allows, by far: should γ be larger, the cells that are to blame are
    /// named.
    void compare_with_what_was_asked() {
        const double asked = target_.thickness;
        if (shell_.info.thickness() <= asked) coarse_.clear();
        if (shell_.info.thickness() <= asked || !coarse_.empty()) return;
        const double most = (sign_ == SignRule::unsigned_rule ? asked : 0.5 * asked) / shell_.lattice.width;
        for (std::uint64_t i = 0; i < shell_.surface.lower.size(); ++i)
            if (double(shell_.surface.lower[i]) < -most || double(shell_.surface.upper[i]) > most)
                coarse_.push_back(i);
    }

    /// Bounds of surface cells of these numbers.
    Box bounds_of(std::span<const std::uint64_t> cells) const {
        Box box = geometry::empty_box;
        for (const std::uint64_t cell : cells) {
            const octree::CellPlace place = shell_.octree.surface_place(cell);
            const octree::Level& level = shell_.octree.levels[std::size_t(place.level)];
            const octree::Cell at =
                octree::morton_decode(level.parent[place.group] << 3 | std::uint64_t(place.child));
            std::array<std::int64_t, 3> low, high;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                low[axis] = std::int64_t(at[axis]) << place.level;
                high[axis] = low[axis] + (std::int64_t{1} << place.level);
            }
            geometry::extend(box, Box{shell_.lattice.position({low[0], low[1], low[2]}),
                                      shell_.lattice.position({high[0], high[1], high[2]})});
        }
        return cells.empty() ? Box{} : box;
    }

    void turn_parts() {
        oriented_ =
            inspector::turned(inspector::turned(mesh::copy_of(mesh_), inspection_.turn), inspection_.part_turn);
        inspection_ = inspector::examine(oriented_, parts_.until(0));
    }

    const Stopwatch total_;
    mesh::Arrays mesh_, given_;
    const BuildOptions& options_;
    Parts parts_;
    Shares shares_;
    inspector::Inspection inspection_;  ///< after parts were turned around if that is asked for
    MeshReport report_;                 ///< of the mesh as it came
    Target target_;
    int depth_;
    MemoryBudget budget_;
    SignRule sign_ = SignRule::unsigned_rule;
    std::string sign_reason_;
    BuildSeconds seconds_;

    ShellData shell_;
    Mesh oriented_;  ///< the mesh, some triangles turned around where the sign rule was left to us
    std::vector<Vec3> positions_;  ///< of its vertices, in lattice coordinates
    octree::Voxels voxels_;
    std::optional<signs::Signs> signs_;
    std::vector<std::vector<double>> distance_;
    double rounding_ = 0;
    std::optional<adaptive::OpenSides> open_;
    std::vector<std::uint64_t> coarse_;  ///< surface cells in which f on M is larger than asked for
};

/// Where inside and outside meet in a hole there are cells, too: as many as at a smaller depth, for their size.
void add_flip_cells(const mesh::Native& mesh, inspector::Inspection& inspection, int depth, BuildSize& size) {
    const int looked_at = std::min(depth, 6);
    const octree::Lattice lattice = octree::make_lattice(inspection.report.bounds, looked_at);
    const Mesh oriented = inspector::turned(mesh::copy_of(mesh), inspection.turn);
    octree::Voxels voxels = octree::voxelise(lattice_positions(mesh, lattice), oriented.triangles,
                                             lattice.depth, lattice.dilation(), {});
    const std::size_t before = voxels.cell.size();
    const signs::Signs signs(SignRule::generalized, oriented, lattice, voxels, {},
                             std::exchange(inspection.filling, {}));
    const double more = std::ldexp(double(voxels.cell.size() - before), 2 * (depth - looked_at));
    size.surface_cells += std::uint64_t(more);
    size.flips += std::uint64_t(more);
    size.groups += std::uint64_t(more / 3);  // a quarter of their number, and so on up
}

constexpr Named<Extrema> extremas[] = {{Extrema::certified, "certified"}, {Extrema::candidates, "candidates"}};
constexpr Named<Solver> solvers[] = {{Solver::direct, "direct"}, {Solver::lscg, "lscg"}};

}  // namespace

std::string_view name(Extrema extrema) {
    return name_in(extremas, extrema);
}

std::optional<Extrema> parse_extrema(std::string_view name) {
    return value_in(extremas, name);
}

std::string_view name(Solver solver) {
    return name_in(solvers, solver);
}

std::optional<Solver> parse_solver(std::string_view name) {
    return value_in(solvers, name);
}

ThinShell build(const MeshView& mesh, const BuildOptions& options, MeshReport* report) {
    check_options(options);
    return run_call(options.run, "mesh", [&](const Progress& progress) {
        const mesh::Native given(mesh);
        const std::optional<Welded> welded =
            options.weld > 0 ? std::optional(weld(given.arrays().view(), options.weld)) : std::nullopt;
        mesh::require_usable(given);
        octree::require_size(octree::bounds(given));
        Builder builder(welded ? mesh::Arrays(welded->mesh) : given.arrays(), options, given, progress);
        if (builder.adaptive()) {
            builder.refine();
        } else {
            builder.find_cells();
            builder.find_distances();
            builder.find_field();
        }
        builder.find_bounds();
        if (report != nullptr) *report = builder.report();
        return builder.finish();
    });
}

std::uint64_t estimate_memory(const MeshView& mesh, int depth, const Run& run) {
    check_depth(depth);
    return with_threads(run.threads, [&] {
        const mesh::Native native(mesh);
        mesh::require_usable(native);
        inspector::Inspection inspection = inspector::examine(native);
        const octree::Lattice lattice = octree::make_lattice(inspection.report.bounds, depth);
        const std::vector<Vec3> positions = lattice_positions(native, lattice);
        BuildSize size = count_size(measure(native), lattice, positions, mesh::Arrays(native).triangles);
        if (inspection.report.sign == SignRule::generalized) add_flip_cells(native, inspection, depth, size);
        return program_pages + build_bytes(size);
    });
}

}  // namespace its
