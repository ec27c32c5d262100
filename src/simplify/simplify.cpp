#include "its/simplify.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "distance/closest_point.h"
#include "geometry/vec3.h"
#include "simplify/rules.h"
#include "simplify/transfer.h"

namespace its {

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
void check_mesh(const Mesh& mesh) {
    if (mesh.triangles.empty()) throw InputError("the mesh has no triangles");
    if (mesh.triangles.size() >= no_index / 3)
        throw InputError(fmt::format("the mesh has {} triangles; at most {} can be simplified",
                                     mesh.triangles.size(), no_index / 3 - 1));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t v : mesh.triangles[t]) {
            if (v >= mesh.vertices.size())
                throw InputError(fmt::format("triangle {} uses vertex {} of {}", t, v, mesh.vertices.size()));
            const Vec3& p = mesh.vertices[v];
            if (!finite(p)) throw InputError(fmt::format("vertex {} is not a finite point", v));
            if (!(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= 1e75))
                throw InputError(fmt::format("vertex {} is beyond 1e75, where squares overflow", v));
        }
    }
}

std::string_view name(SimplifyMethod method) {
    constexpr std::string_view names[] = {"certified", "vertex", "priority", "qem"};
    return names[std::size_t(method)];
}

/// \throws OptionError
void check_options(const SimplifyOptions& o) {
    const bool certified = o.method == SimplifyMethod::certified;
    if (o.threads < 0) throw OptionError(fmt::format("threads {}: must be 0 or more", o.threads));
    if (o.faces && *o.faces == 0) throw OptionError("faces 0: must be at least 1");
    if (o.tolerance && !(*o.tolerance > 0 && std::isfinite(*o.tolerance)))
        throw OptionError(fmt::format("tolerance {}: must be a length above 0, in mesh units", *o.tolerance));
    if (o.tolerance && !certified)
        throw OptionError(fmt::format("tolerance: {} proves no distance; use certified", name(o.method)));
    if (o.depth && (*o.depth < 0 || *o.depth > max_depth))
        throw OptionError(fmt::format("depth {}: must be 0 to {}", *o.depth, max_depth));
    if (o.depth && o.method == SimplifyMethod::qem)
        throw OptionError("depth: qem uses no shell; use vertex, priority or certified");
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

/// The error that quadrics alone make at this count: of vertices of the original, at regular intervals.
double error_of_quadrics(const Complex& original, std::uint64_t faces) {
    Complex complex = original;
    AnyCollapse rule;
    Decimator(complex, rule).run(faces, 0, [](std::uint64_t) {});
    const Mesh result = to_mesh(complex);
    const ClosestPointTree tree(result.vertices, result.triangles);
    const std::uint64_t stride = std::max<std::uint64_t>(original.vertices() / pilot_samples, 1);
    double worst = 0;
    for (std::uint64_t v = 0; v < original.vertices(); v += stride)
        worst = std::max(worst, tree.find(original.position(std::uint32_t(v))).squared);
    return std::sqrt(worst);
}

/// The shell that the options ask for, if any.
std::optional<ThinShell> make_shell(const Mesh& mesh, const SimplifyOptions& o) {
    const bool wanted = o.method == SimplifyMethod::certified ? o.depth || (!o.tolerance && !o.faces)
                                                              : o.method != SimplifyMethod::qem;
    if (!wanted) return std::nullopt;
    ThinShell shell = build(mesh, {.depth = o.depth,
                                   .sign = o.sign,
                                   .max_memory = o.max_memory,
                                   .threads = o.threads,
                                   .progress = o.progress});
    if (o.tolerance && *o.tolerance < shell.info().thickness())
        throw OptionError(fmt::format(
            "tolerance {}: a shell of depth {} cannot reach it, being {:.6g} thick; use a greater depth, "
            "or none: the tolerance is proven without a shell",
            *o.tolerance, shell.info().depth, shell.info().thickness()));
    return shell;
}

/// What the phases of simplify() work on.
struct Job {
    const SimplifyOptions& options;
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

/// Of the bounds: no two points of the mesh are farther apart, and no tolerance above it means anything.
double diagonal(const Complex& complex) {
    Box box{complex.position(0), complex.position(0)};
    for (std::uint32_t v = 1; v < complex.vertices(); ++v) {
        const Vec3& p = complex.position(v);
        box.min = {std::min(box.min.x, p.x), std::min(box.min.y, p.y), std::min(box.min.z, p.z)};
        box.max = {std::max(box.max.x, p.x), std::max(box.max.y, p.y), std::max(box.max.z, p.z)};
    }
    return norm(box.max - box.min);
}

/// Runs the decimator within the tolerance, or within the least that reaches the face count. Returns the one
/// that the last collapse kept to.
template <class Report>
double decimate(const Job& job, const Complex& original, double least, Decimator& decimator, Report&& report) {
    const SimplifyOptions& o = job.options;
    const std::uint64_t faces = o.faces.value_or(0);
    if (o.method != SimplifyMethod::certified || !o.faces) {
        decimator.run(faces, o.tolerance.value_or(no_limit), report);
        return o.tolerance.value_or(no_limit);
    }
    const double limit = o.tolerance.value_or(std::max(diagonal(original), least));
    double tolerance = std::min(std::max(first_tolerance * error_of_quadrics(original, faces), least), limit);
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
            "{}: {} pairs of triangles meet; leave out no-self-intersections, or mend the mesh", what, pairs));
}

bool whole_in_shell(const Complex& complex, const ThinShell& shell) {
    const TriangleBounds bounds(shell.data());
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
/// moved by; 0 if none is kept. \throws OptionError if it is more than what is asked for
double least_tolerance(const SimplifyOptions& o, const CollapseRule& rule, double moved) {
    const auto* certified = dynamic_cast<const Certified*>(&rule);
    if (certified == nullptr || certified->deviation() == nullptr) return 0;
    const double least = std::max(2 * certified->deviation()->rounding(), moved);
    if (o.tolerance && *o.tolerance < least)
        throw OptionError(
            fmt::format("tolerance {}: below what the mesh's coordinates can resolve; the least that can "
                        "be proven is {:.3g}",
                        *o.tolerance, least));
    return least;
}

void run(Job& job) {
    const SimplifyOptions& o = job.options;
    const Stopwatch watch;
    const bool keeps_tolerance = o.method == SimplifyMethod::certified && (o.tolerance || o.faces);
    if (o.no_self_intersections) require_no_intersections(job.complex, "the mesh meets itself");
    const std::unique_ptr<CollapseRule> rule = make_rule(job, keeps_tolerance);
    const Complex original = o.faces && keeps_tolerance ? job.complex : Complex(Mesh{});
    const double moved = o.single_precision ? job.complex.round_to_single() : 0.0;
    const double least = least_tolerance(o, *rule, moved);

    std::optional<WithoutIntersections> without;
    if (o.no_self_intersections) without.emplace(*rule, job.complex);
    Decimator decimator(job.complex, without ? *without : *rule, o.single_precision);
    Stage stage(o.progress, "simplify",
                job.complex.living_triangles() - std::min(o.faces.value_or(0), job.complex.living_triangles()));
    const double tolerance =
        decimate(job, original, least, decimator, [&](std::uint64_t gone) { stage.advance(gone); });

    SimplifyReport& report = job.report;
    report.collapses = decimator.collapses();
    report.refused = decimator.refused();
    report.stop = stop_reason(job, keeps_tolerance);
    if (keeps_tolerance) report.proven_bound = tolerance;
    if (o.method == SimplifyMethod::certified && job.shell)
        report.in_shell = moved == 0 || whole_in_shell(job.complex, *job.shell);
    if (o.no_self_intersections) require_no_intersections(job.complex, "the result meets itself");
    report.seconds.simplify = watch.seconds();
}

}  // namespace

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

Simplified simplify(const Mesh& mesh, const SimplifyOptions& options) {
    return simplify(mesh, MeshAttributes{}, options);
}

Simplified simplify(const Mesh& mesh, const MeshAttributes& attributes, const SimplifyOptions& options) {
    const Stopwatch watch;
    check_options(options);
    check_mesh(mesh);
    check_attributes(mesh, attributes);
    const AttributeTransfer transfer(mesh, attributes);
    Job job{options, Complex(mesh, transfer.wedges()), {}, {}};
    job.report.seam_edges_before = job.complex.seam_edges();
    job.report.faces_before = job.complex.living_triangles();
    job.report.vertices_before = job.complex.vertices();
    check_faces(job);
    const Stopwatch shell_watch;
    job.shell = make_shell(mesh, options);
    if (job.shell) {
        job.report.shell = job.shell->info();
        job.report.seconds.shell = shell_watch.seconds();
    }
    run(job);
    job.report.faces_after = job.complex.living_triangles();
    job.report.vertices_after = living_vertices(job.complex);
    job.report.seam_edges_after = job.complex.seam_edges();
    Simplified result{to_mesh(job.complex), {}, job.report};
    if (!attributes.empty()) result.attributes = transfer.attributes_of(job.complex, result.mesh);
    result.report.seconds.total = watch.seconds();
    return result;
}

MeshDistance mesh_distance(const Mesh& from, const Mesh& to, std::uint64_t samples, int threads) {
    check_mesh(from);
    check_mesh(to);
    return with_threads(threads, [&] {
        const ClosestPointTree tree(to.vertices, to.triangles);
        std::vector<double> area_before(from.triangles.size() + 1, 0);
        for (std::size_t t = 0; t < from.triangles.size(); ++t) {
            const auto& [a, b, c] = from.triangles[t];
            const Vec3& p = from.vertices[a];
            area_before[t + 1] = area_before[t] + norm(cross(from.vertices[b] - p, from.vertices[c] - p));
        }
        const double area = area_before.back();
        // Sample i stands for the i-th part of the area; its place in its triangle by the additive recurrence
        // of the plastic number, folded into the triangle.
        const std::uint64_t grain = 4096, vertices = from.vertices.size(), count = area > 0 ? samples : 0;
        std::vector<MeshDistance> parts(chunk_count(vertices + count, grain));
        std::vector<bool> used(vertices, false);
        for (const Triangle& t : from.triangles)
            for (const std::uint32_t v : t) used[v] = true;
        for_chunks(vertices + count, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            MeshDistance& part = parts[chunk];
            for (std::uint64_t i = begin; i < end; ++i) {
                if (i < vertices) {
                    if (used[i]) part.max = std::max(part.max, std::sqrt(tree.find(from.vertices[i]).squared));
                    continue;
                }
                const double at = area * (double(i - vertices) + 0.5) / double(count);
                const auto t =
                    std::size_t(std::upper_bound(area_before.begin() + 1, area_before.end() - 1, at) -
                                area_before.begin() - 1);
                double s = std::fmod(0.7548776662466927 * double(i), 1.0),
                       r = std::fmod(0.5698402909980532 * double(i), 1.0);
                if (s + r > 1) s = 1 - s, r = 1 - r;
                const auto& [a, b, c] = from.triangles[t];
                const Vec3& p = from.vertices[a];
                const double d2 =
                    tree.find(p + (s * (from.vertices[b] - p) + r * (from.vertices[c] - p))).squared;
                part.max = std::max(part.max, std::sqrt(d2));
                part.mean += std::sqrt(d2);
                part.root_mean_square += d2;
            }
        });
        MeshDistance all;
        for (const MeshDistance& part : parts) {
            all.max = std::max(all.max, part.max);
            all.mean += part.mean;
            all.root_mean_square += part.root_mean_square;
        }
        if (count > 0) {
            all.mean /= double(count);
            all.root_mean_square = std::sqrt(all.root_mean_square / double(count));
        }
        return all;
    });
}

}  // namespace its
