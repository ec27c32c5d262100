#include <fmt/format.h>
#include <algorithm>
#include <utility>

#include "base/parallel.h"
#include "distance/grid_distance.h"
#include "distance/winding.h"
#include "field/lscg.h"
#include "octree/voxelise.h"
#include "shell/budget.h"
#include "shell/extremes.h"
#include "shell/shell_data.h"

namespace its {

namespace {

constexpr std::uint64_t vertex_grain = 16384;
constexpr double lscg_tolerance =
    1e-12;  // max |f(g) − D(g)| relative to max |D|: reached in some 40 iterations

void check_options(const BuildOptions& options) {
    if (options.depth && (*options.depth < 0 || *options.depth > max_depth))
        throw OptionError(fmt::format("depth {}: must be 0 to {}", *options.depth, max_depth));
    if (options.threads < 0) throw OptionError(fmt::format("threads {}: must be 0 or more", options.threads));
}

/// The rule to use, and one sentence that says why. \throws OptionError if the mesh cannot have the one asked
/// for
std::pair<SignRule, std::string> choose_sign(const MeshReport& report, const BuildOptions& options) {
    if (!options.sign) return {report.sign, report.sign_reason};
    if (*options.sign == SignRule::generalized)
        throw OptionError(
            "sign rule generalized: not available yet; use unsigned, or winding for a closed mesh");
    if (*options.sign == SignRule::winding && report.unbalanced_edges > 0)
        throw OptionError(
            fmt::format("sign rule winding: {} edges of the mesh are not matched by opposite ones, so that its "
                        "inside is not "
                        "defined; use unsigned, or close and orient the mesh",
                        report.unbalanced_edges));
    return {*options.sign, "asked for"};
}

std::vector<Vec3> lattice_positions(const Mesh& mesh, const Lattice& lattice) {
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
    for (const Level& level : shell.octree.levels)
        bytes += bytes_of(level.parent) + bytes_of(level.mask) + level.first.bytes();
    for (const auto& values : shell.field.values) bytes += bytes_of(values);
    return bytes;
}

std::uint64_t groups_of(const Octree& octree) {
    std::uint64_t groups = 0;
    for (const Level& level : octree.levels) groups += level.groups();
    return groups;
}

ShellInfo describe(const ShellData& shell, const MeshReport& report) {
    ShellInfo info;
    const Lattice& lattice = shell.lattice;
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

}  // namespace

ThinShell build(const Mesh& mesh, const BuildOptions& options, BuildTimes* times) {
    check_options(options);
    return with_threads(options.threads, [&] {
        const Stopwatch total;
        BuildTimes spent;
        const MeshReport report = inspect(mesh);  // throws on what is no mesh
        const auto [sign, reason] = choose_sign(report, options);
        const int depth = options.depth ? *options.depth : automatic_depth(mesh, options.max_memory);
        const MemoryBudget budget(mesh, depth, options.max_memory);
        budget.check_expected();

        auto shell = std::make_shared<ShellData>();
        shell->mesh = {std::vector(mesh.vertices), std::vector(mesh.triangles)};
        shell->lattice = make_lattice(report.bounds, depth);
        const std::vector<Vec3> positions = lattice_positions(mesh, shell->lattice);

        const Stopwatch octree_time;
        Voxels voxels = voxelise(positions, mesh.triangles, depth, shell->lattice.point_error(),
                                 options.progress, [&](int level, std::uint64_t cells, std::uint64_t pairs) {
                                     budget.check_level(level, cells, pairs);
                                 });
        shell->octree = make_octree(depth, voxels.cell);
        budget.check(
            {mesh.triangles.size(), groups_of(shell->octree), voxels.cell.size(), voxels.triangle.size()});
        spent.octree = octree_time.seconds();

        const Stopwatch distance_time;
        auto distance = grid_distances(shell->octree, positions, mesh.triangles, options.progress);
        if (sign == SignRule::winding)
            shell->sides = apply_signs(shell->octree,
                                       WindingLines(mesh, shell->lattice, voxels, options.progress), distance);
        else
            shell->sides = no_inside(shell->octree);
        spent.distance = distance_time.seconds();

        const Stopwatch field_time;
        shell->field = options.solver == Solver::direct
                           ? solve_direct(std::move(distance))
                           : solve_lscg(shell->octree, solve_direct(std::move(distance)), lscg_tolerance,
                                        options.progress, nullptr);
        spent.field = field_time.seconds();

        const Stopwatch extrema_time;
        std::vector<std::uint64_t>().swap(voxels.cell);
        Extremes extremes =
            find_extremes(shell->lattice, shell->octree, shell->field, positions, mesh.triangles, voxels.offset,
                          voxels.triangle, options.extrema, options.progress);
        shell->surface.lower = std::move(extremes.cell_lower);
        shell->surface.upper = std::move(extremes.cell_upper);
        shell->surface.lists = pack_lists(shell->octree.levels[0], voxels.offset, voxels.triangle);
        // A convex M may have f > 0 on all of it: the shell is the hull with 0.
        shell->epsilon_inner = sign == SignRule::unsigned_rule ? 0.0 : std::min(extremes.lower, 0.0);
        shell->epsilon_outer = std::max(extremes.upper, 0.0);
        spent.extrema = extrema_time.seconds();

        shell->info = describe(*shell, report);
        shell->info.sign = sign;
        shell->info.sign_reason = reason;
        shell->info.extrema = options.extrema;
        shell->info.solver = options.solver;
        shell->info.rounding = shell->lattice.width * extremes.rounding;
        shell->info.input_hash = input_hash(mesh, options);
        spent.total = total.seconds();
        if (times) *times = spent;
        return ThinShell(std::move(shell));
    });
}

std::uint64_t estimate_memory(const Mesh& mesh, int depth) {
    return build_bytes(estimate_size(mesh, depth));
}

}  // namespace its
