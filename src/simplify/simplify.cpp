#include "its/simplify.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/names.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "distance/closest_point.h"
#include "geometry/vec3.h"
#include "inspect/inspect.h"
#include "its/stopwatch.h"
#include "mesh/arrays.h"
#include "mesh/require.h"
#include "mesh/scaled.h"
#include "shell/access.h"
#include "simplify/hausdorff_bound.h"
#include "simplify/rules.h"
#include "simplify/transfer.h"

namespace its {
using namespace simplifier;

namespace {

/// Any need is below it, except that of a collapse which no tolerance allows.
constexpr double no_limit = std::numeric_limits<double>::max();

/// With a face count to reach, the tolerance starts at this part of the error that quadrics alone make at that
/// count, and is raised by a factor whenever no collapse is left.
constexpr double first_tolerance = 0.45;
/// Each raise is larger than the last, so that a count out of reach is soon found out.
constexpr double tolerance_step = 1.1, step_growth = 1.02;

constexpr std::uint64_t pilot_samples = 10'000;

/// \throws InputError
void check_mesh(const mesh::Arrays& mesh) {
    if (mesh.triangles.size() >= no_index / 3)
        throw InputError(fmt::format("the mesh has {} triangles; at most {} can be simplified",
                                     mesh.triangles.size(), no_index / 3 - 1));
    mesh::require_usable(mesh);
}

constexpr Named<SimplifyMethod> methods[] = {{SimplifyMethod::certified, "certified"},
                                             {SimplifyMethod::vertex, "vertex"},
                                             {SimplifyMethod::priority, "priority"},
                                             {SimplifyMethod::qem, "qem"}};

constexpr Named<SimplifyStop> stops[] = {{SimplifyStop::faces_reached, "faces-reached"},
                                         {SimplifyStop::tolerance_reached, "tolerance-reached"},
                                         {SimplifyStop::shell_reached, "shell-reached"},
                                         {SimplifyStop::topology_reached, "topology-reached"}};

/// \throws OptionError
void check_options(const SimplifyOptions& o) {
    const bool certified = o.method == SimplifyMethod::certified;
    require_threads(o.run.threads);
    if (o.faces && *o.faces == 0) throw OptionError("faces 0: must be at least 1");
    if (o.tolerance && !(*o.tolerance > 0 && std::isfinite(*o.tolerance)))
        throw OptionError(fmt::format("tolerance {}: must be a length above 0, in mesh units", *o.tolerance));
    if (o.tolerance && !certified)
        throw OptionError(fmt::format("tolerance: {} proves no distance; use certified", name(o.method)));
    if (o.depth && (*o.depth < 0 || *o.depth > max_depth))
        throw OptionError(fmt::format("depth {}: must be 0 to {}", *o.depth, max_depth));
    if (!(o.thickness >= 0) || !std::isfinite(o.thickness))
        throw OptionError(fmt::format("thickness {}: must be finite and at least 0", o.thickness));
    if (o.depth && o.thickness > 0)
        throw OptionError("thickness and depth: a shell is built to one of them; leave the other out");
    if ((o.depth || o.thickness > 0) && o.method == SimplifyMethod::qem)
        throw OptionError(fmt::format("{}: qem uses no shell; use vertex, priority or certified",
                                      o.depth ? "depth" : "thickness"));
    if (!(o.gamma >= 0 && std::isfinite(o.gamma)))
        throw OptionError(fmt::format("gamma {}: must be a number of 0 or more", o.gamma));
    if (!o.faces && (o.method == SimplifyMethod::qem || o.method == SimplifyMethod::priority))
        throw OptionError(fmt::format("{} needs a number of faces to stop at", name(o.method)));
}

Mesh to_mesh(const Complex& complex) {
    Mesh mesh;
    std::vector<std::uint32_t> number(complex.vertices(), no_index);
    mesh.triangles.reserve(complex.living_triangles());
    for (std::uint32_t t = 0; t < complex.triangles(); ++t) {
        if (!complex.has_triangle(t)) continue;
        Triangle corners = complex.triangle(t);
        for (std::uint32_t& v : corners) {
            if (number[v] == no_index) {
                number[v] = std::uint32_t(mesh.vertices.size());
                mesh.vertices.push_back(complex.position(v));
            }
            v = number[v];
        }
        mesh.triangles.push_back(corners);
    }
    return mesh;
}

/// What quadrics alone make of the mesh at the number of faces.
struct Pilot {
    Complex complex{Mesh{}};
    double error = 0;  ///< distance of one of the original's vertices, of some thousands the farthest
    std::uint64_t collapses = 0;
};

Pilot run_pilot(const Complex& original, const Complex& start, const Numbers& numbers, std::uint64_t faces) {
    Pilot pilot{start};
    AnyCollapse rule;
    Decimator decimator(pilot.complex, rule, numbers);
    decimator.run(faces, 0, [](std::uint64_t) {});
    pilot.collapses = decimator.collapses();
    const Mesh result = to_mesh(pilot.complex);
    const distance::ClosestPointTree tree(result.vertices, result.triangles);
    const std::uint64_t stride = std::max<std::uint64_t>(original.vertices() / pilot_samples, 1);
    double worst = 0;
    for (std::uint64_t v = 0; v < original.vertices(); v += stride)
        worst = std::max(worst, tree.find(original.position(std::uint32_t(v))).squared);
    pilot.error = std::sqrt(worst);
    return pilot;
}

/// What is said of a shell of scaled coordinates, in the caller's units.
ShellInfo in_units_of_caller(ShellInfo info, const geometry::Scaling& scaling) {
    if (scaling.exponent == 0) return info;
    info.scale = scaling.out(info.scale);
    info.cell_width = scaling.out(info.cell_width);
    info.root = scaling.out(info.root);
    info.epsilon_inner = -scaling.out_upwards(-info.epsilon_inner);
    info.epsilon_outer = scaling.out_upwards(info.epsilon_outer);
    info.rounding = scaling.out_upwards(info.rounding);
    info.coarse = scaling.out(info.coarse);
    info.thickness_asked = scaling.out(info.thickness_asked);
    info.input_hash = {};  // of the scaled mesh
    return info;
}

/// The shell that the options ask for, if any.
std::optional<ThinShell> make_shell(const mesh::Arrays& mesh, const SimplifyOptions& o,
                                    const geometry::Scaling& scaling, Parts& parts, SimplifyReport& report) {
    const bool wanted = o.method == SimplifyMethod::certified
                            ? o.depth || o.thickness > 0 || (!o.tolerance && !o.faces)
                            : o.method != SimplifyMethod::qem;
    if (!wanted) return std::nullopt;
    MeshReport of_mesh;
    ThinShell shell = build(mesh.view(),
                            {.depth = o.depth,
                             .thickness = o.thickness,
                             .sign = o.sign,
                             .max_memory = o.max_memory,
                             .run = {.threads = o.run.threads, .progress = parts.until(0.4)}},
                            &of_mesh);
    report.parts = inspector::in_units_of_caller(std::move(of_mesh.parts), scaling);
    if (o.tolerance && *o.tolerance < shell.info().thickness())
        throw OptionError(fmt::format(
            "tolerance {}: a shell of depth {} cannot reach it, being {:.6g} thick; use a thinner one, "
            "or none: the tolerance is proven without a shell",
            scaling.out(*o.tolerance), shell.info().depth, scaling.out(shell.info().thickness())));
    return shell;
}

/// What the phases of simplify() work on: all in scaled coordinates.
struct Job {
    const SimplifyOptions& options;
    Numbers numbers;
    Parts parts;
    Complex complex;
    std::optional<ThinShell> shell;
    SimplifyReport report;
};

/// \throws OptionError if the topology does not allow so few faces
void check_faces(const Job& job) {
    if (!job.options.faces) return;
    const std::uint64_t fewest = job.complex.fewest_triangles();
    if (*job.options.faces < fewest)
        throw OptionError(
            fmt::format("faces {}: the topology of the mesh (its components, holes and handles) needs "
                        "at least {}",
                        *job.options.faces, fewest));
}

Box bounds_of(const Complex& complex) {
    Box box{complex.position(0), complex.position(0)};
    for (std::uint32_t v = 1; v < complex.vertices(); ++v) {
        const Vec3& p = complex.position(v);
        for (int axis = 0; axis < 3; ++axis) {
            box.min[axis] = std::min(box.min[axis], p[axis]);
            box.max[axis] = std::max(box.max[axis], p[axis]);
        }
    }
    return box;
}

/// No two points of the mesh are farther apart than its bounds' diagonal, and no tolerance above it means
/// anything.
double diagonal(const Complex& complex) {
    const Box box = bounds_of(complex);
    return norm(box.max - box.min);
}

/// In the caller's units. About the centre of the bounds, with room for as much around them, where they are far
/// from the origin for their size.
Rounding make_rounding(const Complex& complex, Coordinates coordinates, const geometry::Scaling& scaling) {
    constexpr double far = 8;  // in longest sides of the bounds
    if (coordinates == Coordinates::doubles) return {};
    const Box box = scaling.out(bounds_of(complex));
    double size = 0, largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        size = std::max(size, box.max[axis] - box.min[axis]);
        largest = std::max({largest, std::abs(box.min[axis]), std::abs(box.max[axis])});
    }
    if (coordinates == Coordinates::single || largest <= far * size || size == 0)
        return {Rounding::Kind::single, {}, 0};
    const Rounding rounding = Rounding::about(0.5 * box.min + 0.5 * box.max, size);
    if (!rounding.has_room(largest + size))
        throw OptionError(
            "the mesh is too far from the origin, or too small, for 32-bit numbers about a centre; use "
            "doubles");
    return rounding;
}

/// Runs the decimator within the least tolerance that reaches the face count. Returns the one that the last
/// collapse kept to.
template <class Report>
double reach_faces(const SimplifyOptions& o, double pilot_error, double least, double most,
                   Decimator& decimator, Report&& report) {
    const std::uint64_t faces = *o.faces;
    const double limit = o.tolerance.value_or(std::max(most, least));
    double tolerance = std::min(std::max(first_tolerance * pilot_error, least), limit);
    double kept = least;
    for (double step = tolerance_step;; step *= step_growth) {
        const std::uint64_t before = decimator.collapses();
        const bool reached = decimator.run(faces, tolerance, report);
        if (decimator.collapses() > before) kept = tolerance;
        const double next = decimator.next_tolerance(tolerance);
        if (reached || next > limit || tolerance == limit) return kept;
        tolerance = std::min(std::max(next, step * tolerance), limit);
    }
}

SimplifyStop stop_reason(const Job& job, bool keeps_tolerance) {
    if (job.options.faces && job.complex.living_triangles() <= *job.options.faces)
        return SimplifyStop::faces_reached;
    if (keeps_tolerance && job.options.tolerance) return SimplifyStop::tolerance_reached;
    const bool in_shell = job.shell && job.options.method != SimplifyMethod::priority;
    return in_shell ? SimplifyStop::shell_reached : SimplifyStop::topology_reached;
}

std::uint64_t living_vertices(const Complex& complex) {
    std::uint64_t count = 0;
    for (std::uint32_t v = 0; v < complex.vertices(); ++v) count += complex.has_vertex(v) ? 1 : 0;
    return count;
}

/// \throws InputError if the mesh meets itself
void require_no_intersections(const Complex& complex, std::string_view what) {
    if (const std::uint64_t pairs = count_intersections(complex); pairs > 0)
        throw InputError(fmt::format(
            "{}: {} pairs of triangles meet; allow self-intersections, or mend the mesh", what, pairs));
}

bool whole_in_shell(const Complex& complex, const ThinShell& shell) {
    const shell::TriangleBounds bounds(shell::Access::data(shell));
    for (std::uint32_t t = 0; t < complex.triangles(); ++t) {
        if (!complex.has_triangle(t)) continue;
        const Triangle& c = complex.triangle(t);
        if (!bounds.in_shell(complex.position(c[0]), complex.position(c[1]), complex.position(c[2])))
            return false;
    }
    return true;
}

std::unique_ptr<CollapseRule> make_rule(const Job& job, bool keeps_tolerance) {
    switch (job.options.method) {
        case SimplifyMethod::certified:
            return std::make_unique<Certified>(job.complex, keeps_tolerance, job.shell ? &*job.shell : nullptr);
        case SimplifyMethod::vertex:
            return std::make_unique<VertexInShell>(*job.shell);
        case SimplifyMethod::priority:
            return std::make_unique<ShellPriority>(*job.shell, job.options.gamma);
        case SimplifyMethod::qem:
            break;
    }
    return std::make_unique<AnyCollapse>();
}

/// The least tolerance that can be proven: some way above the rounding errors, and at least what the mesh was
/// moved by; 0 if none is kept.
/// \throws OptionError if it is more than what is asked for
double least_tolerance(const SimplifyOptions& o, const CollapseRule& rule, double moved,
                       const geometry::Scaling& scaling) {
    const auto* certified = dynamic_cast<const Certified*>(&rule);
    if (certified == nullptr || certified->deviation() == nullptr) return 0;
    const double least = std::max(2 * certified->deviation()->rounding(), moved);
    if (o.tolerance && *o.tolerance < least)
        throw OptionError(
            fmt::format("tolerance {}: below what the mesh's coordinates can resolve; the least that can "
                        "be proven is {:.3g}",
                        scaling.out(*o.tolerance), scaling.out_upwards(least)));
    return least;
}

/// Rarely, where the faces that the count allows are large for the details of the mesh, quadrics alone do
/// better than collapses that must be proven one by one. Then their result is proven as a whole, and taken.
void take_pilot_if_better(Job& job, Pilot& pilot, const Complex& original) {
    const SimplifyOptions& o = job.options;
    double& bound = *job.report.proven_bound;
    const bool comparable = !job.shell && !o.no_self_intersections &&
                            pilot.complex.living_triangles() <= job.complex.living_triangles();
    if (!comparable || pilot.error >= bound) return;
    const Mesh before = to_mesh(original), after = to_mesh(pilot.complex);
    const double there = hausdorff_bound(before, after, bound, job.parts.until(0.95));
    if (there >= bound) return;
    const double both = std::max(there, hausdorff_bound(after, before, bound, job.parts.until(1)));
    if (both >= bound) return;
    bound = both;
    job.complex = std::move(pilot.complex);
    job.report.collapses = pilot.collapses;
}

void run(Job& job) {
    const SimplifyOptions& o = job.options;
    const Stopwatch watch;
    const bool keeps_tolerance = o.method == SimplifyMethod::certified && (o.tolerance || o.faces);
    if (o.no_self_intersections) require_no_intersections(job.complex, "the mesh meets itself");
    const std::unique_ptr<CollapseRule> rule = make_rule(job, keeps_tolerance);
    const bool by_pilot = keeps_tolerance && o.faces;
    const Complex original = by_pilot ? job.complex : Complex(Mesh{});
    job.numbers.rounding = make_rounding(job.complex, o.coordinates, job.numbers.scaling);
    job.report.origin = job.numbers.rounding.origin;
    const double moved = job.complex.round_to(job.numbers);
    const double least = least_tolerance(o, *rule, moved, job.numbers.scaling);
    Pilot pilot = by_pilot ? run_pilot(original, job.complex, job.numbers, *o.faces) : Pilot{};

    std::optional<WithoutIntersections> without;
    if (o.no_self_intersections) without.emplace(*rule, job.complex);
    Decimator decimator(job.complex, without ? *without : *rule, job.numbers);
    Stage stage(job.parts.until(by_pilot ? 0.9 : 1), "simplify",
                job.complex.living_triangles() - std::min(o.faces.value_or(0), job.complex.living_triangles()));
    const auto advance = [&](std::uint64_t gone) { stage.advance(gone); };
    double tolerance = o.tolerance.value_or(no_limit);
    if (by_pilot)
        tolerance = reach_faces(o, pilot.error, least, diagonal(original), decimator, advance);
    else
        decimator.run(o.faces.value_or(0), tolerance, advance);

    SimplifyReport& report = job.report;
    report.collapses = decimator.collapses();
    report.refused = decimator.refused();
    if (keeps_tolerance) report.proven_bound = tolerance;
    if (by_pilot) take_pilot_if_better(job, pilot, original);
    report.stop = stop_reason(job, keeps_tolerance);
    if (o.method == SimplifyMethod::certified && job.shell)
        report.in_shell = moved == 0 || whole_in_shell(job.complex, *job.shell);
    if (o.no_self_intersections) require_no_intersections(job.complex, "the result meets itself");
    report.seconds.simplify = watch.seconds();
}

/// The tolerance among scaled coordinates; one that is beyond all sizes there stays so.
SimplifyOptions scaled_options(SimplifyOptions options, const geometry::Scaling& scaling) {
    constexpr double beyond_all = 0x1p400;
    if (options.tolerance && scaling.exponent != 0)
        options.tolerance = std::min(scaling.in(*options.tolerance), beyond_all);
    if (options.thickness > 0)  // 0 has a meaning of its own
        options.thickness =
            std::clamp(scaling.in(options.thickness), std::numeric_limits<double>::denorm_min(), beyond_all);
    return options;
}

/// \throws InputError if the coordinates are to be 32-bit numbers and are beyond those or too small for them
void check_precision(const mesh::Arrays& mesh, const SimplifyOptions& o) {
    using Single = std::numeric_limits<float>;
    if (o.coordinates == Coordinates::doubles) return;
    const double largest = mesh::largest_coordinate(mesh);
    if (largest > double{Single::max()} || (largest > 0 && largest < double{Single::min()}))
        throw InputError(
            fmt::format("coordinates of {:.3g} are {} all 32-bit numbers; take a format with doubles, "
                        "or scale the mesh",
                        largest, largest > 1 ? "beyond" : "below"));
}

Simplified simplified(const mesh::Arrays& given, const MeshAttributes& attributes,
                      const SimplifyOptions& given_options, const Progress& progress) {
    const Stopwatch watch;
    check_precision(given, given_options);
    const mesh::Scaled scaled(given);
    const geometry::Scaling& scaling = scaled.scaling();
    const mesh::Arrays& mesh = scaled.arrays();
    const SimplifyOptions options = scaled_options(given_options, scaling);
    const AttributeTransfer transfer(mesh, attributes);
    Job job{options, {{}, scaling}, Parts(progress), Complex(mesh, transfer.wedges()), {}, {}};
    job.report.seam_edges_before = job.complex.seam_edges();
    job.report.faces_before = job.complex.living_triangles();
    job.report.vertices_before = job.complex.vertices();
    check_faces(job);
    const Stopwatch shell_watch;
    job.shell = make_shell(mesh, options, scaling, job.parts, job.report);
    if (job.shell) {
        job.report.shell = in_units_of_caller(job.shell->info(), scaling);
        job.report.seconds.shell = shell_watch.seconds();
    }
    run(job);
    job.report.faces_after = job.complex.living_triangles();
    job.report.vertices_after = living_vertices(job.complex);
    job.report.seam_edges_after = job.complex.seam_edges();
    Simplified result{to_mesh(job.complex), {}, job.report};
    if (!attributes.empty()) result.attributes = transfer.attributes_of(job.complex, result.mesh);
    for (Vec3& v : result.mesh.vertices) v = scaling.out(v);
    if (result.report.proven_bound)
        result.report.proven_bound = scaling.out_upwards(*result.report.proven_bound);
    result.report.seconds.total = watch.seconds();
    return result;
}

/// The next thicker shell after one of these options; false: there is none.
bool make_thicker(SimplifyOptions& options, const ShellInfo& last) {
    if (last.depth > least_adaptive_depth) {
        options.thickness = 2 * last.thickness_asked;
        return true;
    }
    options.thickness = 0;
    options.depth = last.depth - 1;
    return last.depth > 0;
}

/// In the thinnest of shells, each as thick as two of the one before, in which the number of faces is reached:
/// the one that build() makes by itself holds no vertex that a large reduction needs. Each costs less than that
/// before.
Simplified in_thinnest_shell(const mesh::Arrays& mesh, const MeshAttributes& attributes,
                             SimplifyOptions options, const Progress& progress) {
    const Stopwatch watch;
    Parts parts(progress);
    SimplifyReport::Seconds spent;
    for (;;) {
        Simplified result = simplified(mesh, attributes, options, parts.next(0.5));
        SimplifyReport& report = result.report;
        spent.shell += report.seconds.shell;
        spent.simplify += report.seconds.simplify;
        if (report.faces_after > *options.faces && make_thicker(options, *report.shell)) continue;
        report.seconds = {spent.shell, spent.simplify, watch.seconds()};
        return result;
    }
}

Simplified simplified_by(const mesh::Arrays& mesh, const MeshAttributes& attributes, const SimplifyOptions& o,
                         const Progress& progress) {
    return o.method == SimplifyMethod::vertex && o.faces && !o.depth && o.thickness == 0
               ? in_thinnest_shell(mesh, attributes, o, progress)
               : simplified(mesh, attributes, o, progress);
}

}  // namespace

std::string_view name(SimplifyMethod method) {
    return name_in(methods, method);
}

std::optional<SimplifyMethod> parse_simplify_method(std::string_view name) {
    return value_in(methods, name);
}

std::string_view name(SimplifyStop stop) {
    return name_in(stops, stop);
}

std::optional<SimplifyStop> parse_simplify_stop(std::string_view name) {
    return value_in(stops, name);
}

std::string_view reason(SimplifyStop stop) {
    switch (stop) {
        case SimplifyStop::faces_reached:
            return "the number of faces is reached";
        case SimplifyStop::tolerance_reached:
            return "no collapse is left that is proven to keep the tolerance";
        case SimplifyStop::shell_reached:
            return "no collapse is left that stays in the shell";
        case SimplifyStop::topology_reached:
            break;
    }
    return "no collapse is left that keeps the topology and flips no triangle";
}

namespace {

/// A mesh and what belongs to it, with the corners of some triangles exchanged.
struct Turned {
    Mesh mesh;
    MeshAttributes attributes;
    PartsReport parts;  ///< of the mesh before
};

Turned turn_parts_of(const mesh::Arrays& mesh, const MeshAttributes& attributes) {
    const inspector::Inspection inspection = inspector::examine(mesh);
    Turned out{mesh::copy_of(mesh), attributes, inspection.report.parts};
    const auto turn = [&](std::vector<Triangle>& triangles) {
        triangles = inspector::turned(std::move(triangles), inspection.turn);
        triangles = inspector::turned(std::move(triangles), inspection.part_turn);
    };
    turn(out.mesh.triangles);
    if (!attributes.colours.empty()) turn(out.attributes.colours.corners);
    if (!attributes.texture.empty()) turn(out.attributes.texture.corners);
    if (!attributes.normals.empty()) turn(out.attributes.normals.corners);
    return out;
}

}  // namespace

Simplified simplify(const MeshView& mesh, const SimplifyOptions& options) {
    return simplify(mesh, MeshAttributes{}, options);
}

Simplified simplify(const MeshView& mesh, const MeshAttributes& attributes, const SimplifyOptions& options) {
    check_options(options);
    const mesh::Native native(mesh);
    check_mesh(native);
    check_attributes(mesh, attributes);
    const Stopwatch watch;
    return run_call(options.run, "simplify", [&](const Progress& progress) {
        if (!options.turn_parts) return simplified_by(native, attributes, options, progress);
        const Turned turned = turn_parts_of(native, attributes);
        Simplified result = simplified_by(turned.mesh, turned.attributes, options, progress);
        result.report.parts = turned.parts;
        result.report.seconds.total = watch.seconds();
        return result;
    });
}

}  // namespace its
