#include "its/wrap.h"

#include <fmt/format.h>
#include <cmath>

#include "base/names.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "base/rounding.h"
#include "distance/mesh_distance.h"
#include "distance/searchable.h"
#include "geometry/vec3.h"
#include "inspect/inspect.h"
#include "its/memory.h"
#include "its/stopwatch.h"
#include "mesh/arrays.h"
#include "octree/lattice.h"
#include "surface/grid.h"
#include "surface/memory_guard.h"
#include "wrap/offset_surface.h"

namespace its {
using namespace wrapper;

namespace {

constexpr Named<WrapSide> sides[] = {{WrapSide::outer, "outer"}, {WrapSide::inner, "inner"}};

constexpr std::uint64_t samples = 200'000;  // of measured distances, each way
/// Of M's trees, and of what inspection takes before, per triangle.
constexpr std::uint64_t bytes_per_triangle = 800;
/// The finest cells are this part of the slack, or finer: at √3/2 of a cell from the level the slack is kept.
constexpr double cells_in_slack = 64, least_cells_in_slack = 8;
constexpr int least_depth = 6, most_depth = 18;
/// Of the slack: bends of the function beyond which a cell is halved before there is a surface to look at.
constexpr double coarse_bend = 0.75;
double longest_side(const Box& box) {
    const Vec3 d = box.max - box.min;
    return std::max({d.x, d.y, d.z});
}

/// Options and what follows from them and the mesh.
struct Plan {
    double clearance, slack;
    octree::Lattice lattice;
    surface::Grid grid;
    Vec3 origin;
};

void check_options(const WrapOptions& options) {
    require_threads(options.run.threads);
    if (!(options.clearance >= 0) || !std::isfinite(options.clearance))
        throw OptionError(fmt::format("clearance {}: must be 0 or more", options.clearance));
    if (!(options.slack >= 0) || !std::isfinite(options.slack))
        throw OptionError(fmt::format("slack {}: must be above 0", options.slack));
}

/// The lattice with the finest cells that coordinates allow, up to what the slack needs.
Plan make_plan(const Box& bounds, const WrapOptions& options) {
    octree::require_size(bounds);
    const double side = longest_side(bounds);
    Plan plan{options.clearance, options.slack, {}, {}, {}};
    if (plan.slack == 0) plan.slack = std::max(0.02 * options.clearance, 0.001 * side);
    if (!(plan.slack > 0))
        throw OptionError("all of the mesh is in one point, which a slack does not follow from; give one");
    const double away = plan.clearance + plan.slack;
    Box frame = bounds;
    for (int axis = 0; axis < 3; ++axis) frame.min[axis] -= away, frame.max[axis] += away;
    octree::require_size(frame);
    const double width = longest_side(frame);
    const double wanted = std::ceil(std::log2(cells_in_slack * (width / plan.slack)));
    int depth = int(std::clamp(wanted, double(least_depth), double(most_depth)));
    depth = std::max(octree::deepest_lattice(frame, depth), octree::least_levels);
    for (;; --depth) {
        plan.lattice = octree::make_nested_lattice(frame, depth, octree::least_levels);
        if (plan.lattice.width * least_cells_in_slack > plan.slack)
            throw OptionError(fmt::format(
                "slack {:.3g}: coordinates {:.3g} from the origin cannot be told apart well enough to "
                "prove it; choose a larger one, move the mesh nearer to the origin{}",
                plan.slack, plan.lattice.reach() * plan.lattice.width,
                options.coordinates == Coordinates::doubles ? "" : ", or keep doubles"));
        const Rounding rounding = surface::make_rounding(plan.lattice, options.coordinates);
        plan.origin = rounding.origin;
        const std::optional<surface::Grid> grid =
            surface::make_grid(plan.lattice, plan.lattice.width, plan.lattice.cells(), rounding);
        if (grid) {
            plan.grid = *grid;
            return plan;
        }
    }
}

double volume_of(const mesh::Arrays& mesh) {
    if (mesh.triangles.empty()) return 0;
    const Vec3 origin = mesh.vertices[mesh.triangles[0][0]];
    double volume = 0;
    for (const Triangle& t : mesh.triangles)
        volume += dot(mesh.vertices[t[0]] - origin,
                      cross(mesh.vertices[t[1]] - origin, mesh.vertices[t[2]] - origin)) /
                  6;
    return volume;
}

void explain_empty(WrapReport& report) {
    report.empty = true;
    report.reason = report.sign == SignRule::unsigned_rule
                        ? "the mesh is not closed, so that it has no inside"
                        : fmt::format("no point inside the mesh is farther than {} from it",
                                      report.clearance + 1.5 * report.slack);
}

void measure(const mesh::Arrays& m, const Progress& progress, Wrap& wrap) {
    Parts parts(progress);
    const Stopwatch watch;
    wrap.report.to_mesh = distance::mesh_distance(wrap.mesh, m, samples, parts.until(0.5)).max;
    wrap.report.from_mesh = distance::mesh_distance(m, wrap.mesh, samples, parts.until(1)).max;
    wrap.report.seconds.measure = watch.seconds();
}

/// The wrap of a mesh whose triangles are turned already.
void make(const mesh::Arrays& mesh, const Plan& plan, const WrapOptions& options, surface::MemoryGuard& guard,
          const Progress& progress, Wrap& wrap) {
    Parts parts(progress);
    WrapReport& report = wrap.report;
    const bool inner = options.side == WrapSide::inner;
    if (inner && report.sign == SignRule::unsigned_rule) return explain_empty(report);
    const OffsetField field(mesh, report.sign);
    const double middle = plan.clearance + plan.slack / 2;
    const OffsetTask task{plan.lattice, field, inner ? -middle : middle, coarse_bend * plan.slack};
    const OffsetDemand demand{.mesh = mesh,
                              .frame = {plan.grid, inner ? SurfaceSide::inner : SurfaceSide::outer, 0},
                              .inner = inner,
                              .limits = {plan.clearance, plan.clearance + plan.slack}};
    OffsetTree tree(task, guard, parts.until(0.3));
    OffsetSurface surface = make_offset_surface(demand, task, tree, guard, parts.until(1));
    wrap.mesh = std::move(surface.mesh);
    report.lowest = surface.range.lower;
    report.highest = surface.range.upper;
    report.mesh_components = surface.mesh_components;
    report.components = surface.components;
    report.cells = surface.cells;
    report.passes = surface.passes;
    report.volume = volume_of(wrap.mesh);
    if (wrap.mesh.triangles.empty()) explain_empty(report);
}

}  // namespace

std::string_view name(WrapSide side) {
    return name_in(sides, side);
}

std::optional<WrapSide> parse_wrap_side(std::string_view name) {
    return value_in(sides, name);
}

Wrap wrap(const MeshView& view, const WrapOptions& options) {
    const Stopwatch watch;
    check_options(options);
    return run_call(options.run, "wrap", [&](const Progress& progress) {
        Parts parts(progress);
        const mesh::Native native(view);
        const mesh::Arrays& given = native;
        distance::require_searchable(given);
        surface::MemoryGuard guard(options.max_memory, "choose a larger slack");
        const surface::Taken trees(guard, bytes_per_triangle * given.triangles.size());
        const Plan plan = make_plan(octree::bounds(given), options);
        inspector::Inspection inspection = inspector::examine(given, parts.until(0.1));
        Wrap result;
        WrapReport& report = result.report;
        report.side = options.side;
        report.clearance = plan.clearance;
        report.slack = plan.slack;
        report.sign = wrapping_rule(inspection.report.sign);
        report.origin = plan.origin;
        const std::vector<Triangle> triangles =
            inspector::turned({given.triangles.begin(), given.triangles.end()}, inspection.turn);
        const mesh::Arrays mesh(given.vertices, triangles);
        if (report.sign != SignRule::unsigned_rule) report.mesh_volume = volume_of(mesh);
        make(mesh, plan, options, guard, parts.until(options.measure ? 0.7 : 1), result);
        report.seconds.wrap = watch.seconds();
        if (options.measure && !report.empty) measure(mesh, parts.until(1), result);
        report.seconds.total = watch.seconds();
        return result;
    });
}

}  // namespace its
