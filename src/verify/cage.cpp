#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "its/stopwatch.h"
#include "its/verify_cage.h"
#include "verify/boundary.h"
#include "verify/cage_distance.h"
#include "verify/pairs.h"

namespace its::verifier {
namespace {

constexpr std::uint64_t grain = 64;
constexpr double infinity = std::numeric_limits<double>::infinity();
/// Of the largest distance of a vertex: what the proven one may be too large by.
constexpr double excess = 0x1p-10;

/// A mesh with one vertex at each position, and all in numbers whose products no double is too small or large
/// for.
struct Body {
    Mesh mesh;
    std::vector<std::uint32_t> part;  ///< of each vertex, the lowest of those it is connected with
    std::vector<Vec3> one_of_each;    ///< a vertex of each part
};

void require_mesh(const Mesh& mesh, const char* name) {
    if (mesh.triangles.empty()) throw InputError(fmt::format("the {} has no triangles", name));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t]) {
            if (v >= mesh.vertices.size())
                throw InputError(fmt::format("the {}: triangle {} has vertex {}, and there are {}", name, t, v,
                                             mesh.vertices.size()));
            const Vec3& p = mesh.vertices[v];
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
                throw InputError(fmt::format("the {}: vertex {} is not finite", name, v));
        }
}

double largest_coordinate(const Mesh& mesh) {
    double largest = 0;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::abs(mesh.vertices[v][axis]));
    return largest;
}

Body make_body(const Mesh& given, int exponent) {
    const Positions positions = number_positions(given);
    Body body;
    body.mesh.vertices = positions.at;
    for (Vec3& v : body.mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) v[axis] = std::ldexp(v[axis], -exponent);
    for (const Triangle& t : given.triangles)
        body.mesh.triangles.push_back({positions.number[t[0]], positions.number[t[1]], positions.number[t[2]]});
    std::vector<std::uint32_t>& part = body.part;
    part.resize(positions.at.size());
    for (std::uint32_t v = 0; v < part.size(); ++v) part[v] = v;
    const auto find = [&](std::uint32_t v) {
        while (part[v] != v) v = part[v] = part[part[v]];
        return v;
    };
    for (const Triangle& t : body.mesh.triangles)
        for (const std::uint32_t other : {t[1], t[2]}) {
            const std::uint32_t a = find(t[0]), b = find(other);
            part[std::max(a, b)] = std::min(a, b);
        }
    for (std::uint32_t v = 0; v < part.size(); ++v) {
        part[v] = find(v);
        if (part[v] == v) body.one_of_each.push_back(body.mesh.vertices[v]);
    }
    return body;
}

/// Adds up violations that fn(i, count) finds among `total` items, and the first of them.
struct Tally {
    std::uint64_t violations = 0, first = 0;
};
template <class F>
Tally count_violations(std::uint64_t total, const Progress& progress, std::string_view name, const F& fn) {
    std::vector<Tally> parts(chunk_count(total, grain));
    Stage stage(progress, name, total);
    for_chunks(total, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) {
            const std::uint64_t found = fn(i);
            if (found > 0 && parts[chunk].violations == 0) parts[chunk].first = i;
            parts[chunk].violations += found;
        }
        stage.advance(end - begin);
    });
    Tally all;
    for (const Tally& part : parts) {
        if (all.violations == 0) all.first = part.first;
        all.violations += part.violations;
    }
    return all;
}

VerifyCheck check_of(std::string name, std::uint64_t tested, std::uint64_t violations, std::string detail) {
    VerifyCheck check;
    check.name = std::move(name);
    check.passed = violations == 0;
    check.complete = true;
    check.tested = tested;
    check.violations = violations;
    check.detail = std::move(detail);
    return check;
}

std::string text(const Vec3& p, int exponent) {
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", std::ldexp(p.x, exponent), std::ldexp(p.y, exponent),
                       std::ldexp(p.z, exponent));
}

/// Each edge in two triangles, once in either direction.
VerifyCheck check_edges(const Mesh& mesh) {
    struct Edge {
        std::uint32_t low, high;
        bool forward;
        std::uint32_t triangle;
    };
    std::vector<Edge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3];
            edges.push_back({std::min(a, b), std::max(a, b), a < b, i});
        }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return std::tuple(a.low, a.high, a.forward, a.triangle) <
               std::tuple(b.low, b.high, b.forward, b.triangle);
    });
    std::uint64_t tested = 0, violations = 0;
    std::uint32_t first = 0;
    for (std::size_t i = 0; i < edges.size(); ++tested) {
        std::size_t end = i;
        while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
        if (!(end - i == 2 && edges[i].forward != edges[i + 1].forward)) {
            if (violations == 0) first = edges[i].triangle;
            ++violations;
        }
        i = end;
    }
    return check_of("closed", tested, violations,
                    violations == 0 ? "every edge has two triangles, one in either direction"
                                    : fmt::format("{} edges have not one triangle in either direction, such as "
                                                  "one of triangle {}",
                                                  violations, first));
}

/// The triangles at each vertex form one fan. Precondition: edges passed.
VerifyCheck check_vertices(const Mesh& mesh) {
    struct Corner {
        std::uint32_t vertex, next, before;  ///< the triangle's other corners
    };
    std::vector<Corner> corners;
    corners.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) corners.push_back({t[k], t[(k + 1) % 3], t[(k + 2) % 3]});
    std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
        return std::tuple(a.vertex, a.next, a.before) < std::tuple(b.vertex, b.next, b.before);
    });
    std::uint64_t tested = 0, violations = 0;
    for (std::size_t i = 0; i < corners.size(); ++tested) {
        std::size_t end = i;
        while (end < corners.size() && corners[end].vertex == corners[i].vertex) ++end;
        std::size_t at = i, steps = 0;
        do {
            const auto found = std::lower_bound(
                corners.begin() + std::ptrdiff_t(i), corners.begin() + std::ptrdiff_t(end), corners[at].before,
                [](const Corner& corner, std::uint32_t next) { return corner.next < next; });
            at = std::size_t(found - corners.begin());
            ++steps;
        } while (at != i && at < end && steps <= end - i);
        if (steps != end - i || at != i) ++violations;
        i = end;
    }
    return check_of("2-manifold", tested, violations,
                    violations == 0 ? "the triangles at every vertex form one fan"
                                    : fmt::format("{} vertices have several fans of triangles", violations));
}

VerifyCheck check_areas(const Mesh& mesh, const Progress& progress) {
    const Tally tally =
        count_violations(mesh.triangles.size(), progress, "verify: areas",
                         [&](std::uint64_t i) { return std::uint64_t(is_degenerate(corners_of(mesh, i))); });
    return check_of("areas", mesh.triangles.size(), tally.violations,
                    tally.violations == 0 ? "no triangle is degenerate"
                                          : fmt::format("{} triangles are degenerate, such as {}",
                                                        tally.violations, tally.first));
}

VerifyCheck check_self_intersections(const Mesh& mesh, const Boxes& boxes, const Progress& progress) {
    const Tally tally =
        count_violations(mesh.triangles.size(), progress, "verify: self-intersections", [&](std::uint64_t i) {
            const Corners s = corners_of(mesh, i);
            std::uint64_t found = 0;
            if (is_degenerate(s)) return found;
            const Box box = box_of(s);
            boxes.for_near(box, [&](std::uint32_t j) {
                if (j <= i) return;
                const Corners t = corners_of(mesh, j);
                if (overlap(box, box_of(t)) && !is_degenerate(t) && meet_beside_shared(s, t)) ++found;
            });
            return found;
        });
    return check_of("no self-intersections", mesh.triangles.size(), tally.violations,
                    tally.violations == 0
                        ? "triangles meet in the corners and edges that they share only"
                        : fmt::format("{} pairs of triangles meet, such as one with triangle {}",
                                      tally.violations, tally.first));
}

VerifyCheck check_disjoint(const Mesh& cage, const Mesh& mesh, const Boxes& boxes, const Progress& progress) {
    const Tally tally =
        count_violations(cage.triangles.size(), progress, "verify: disjoint", [&](std::uint64_t i) {
            const Corners s = corners_of(cage, i);
            std::uint64_t found = 0;
            if (is_degenerate(s)) return found;
            boxes.for_near(box_of(s), [&](std::uint32_t j) { found += meet(s, corners_of(mesh, j)) ? 1 : 0; });
            return found;
        });
    return check_of("disjoint", cage.triangles.size(), tally.violations,
                    tally.violations == 0 ? "no triangle meets one of the mesh"
                                          : fmt::format("{} pairs of triangles of cage and mesh meet, such as "
                                                        "one with triangle {} of the cage",
                                                        tally.violations, tally.first));
}

/// The cage's winding number about a point of each part of M is 1.
VerifyCheck check_enclosing(const Body& cage, const Boxes& boxes, const Body& mesh, int exponent,
                            const Progress& progress) {
    const Tally tally =
        count_violations(mesh.one_of_each.size(), progress, "verify: enclosing", [&](std::uint64_t i) {
            return std::uint64_t(winding_number(cage.mesh, boxes, mesh.one_of_each[i]) != 1);
        });
    return check_of("enclosing", mesh.one_of_each.size(), tally.violations,
                    tally.violations == 0
                        ? "the cage's winding number about a point of each part of the mesh is 1"
                        : fmt::format("{} parts of the mesh are not enclosed, such as the one with {}",
                                      tally.violations, text(mesh.one_of_each[tally.first], exponent)));
}

/// M is closed, and its winding number about a point of each part of the cage is 1 or more.
void check_enclosed(const Body& cage, const Body& mesh, const Boxes& boxes, int exponent,
                    const Progress& progress, std::vector<VerifyCheck>& checks) {
    const std::uint64_t open = find_boundary(mesh.mesh).edges.size();
    checks.push_back(
        check_of("mesh closed", mesh.mesh.triangles.size(), open,
                 open == 0 ? "the mesh is closed, as a set of oriented segments"
                           : fmt::format("the mesh has {} edges that do not cancel: it has no inside", open)));
    const Tally tally =
        count_violations(cage.one_of_each.size(), progress, "verify: enclosed", [&](std::uint64_t i) {
            return std::uint64_t(winding_number(mesh.mesh, boxes, cage.one_of_each[i]) < 1);
        });
    checks.push_back(
        check_of("enclosed", cage.one_of_each.size(), tally.violations,
                 tally.violations == 0
                     ? "the mesh's winding number about a point of each part of the cage is 1 or more"
                     : fmt::format("{} parts of the cage are not inside the mesh, such as the one with {}",
                                   tally.violations, text(cage.one_of_each[tally.first], exponent))));
}

struct Interval {
    double nearest, farthest;
};

Interval measure(const Mesh& cage, const CageDistance& distance, double allowed, const Progress& progress) {
    Parts parts(progress);
    const std::uint64_t count = cage.triangles.size();
    std::vector<double> away(cage.vertices.size());
    {
        Stage stage(parts.until(0.3), "verify: distances", away.size());
        for_chunks(away.size(), grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t i = begin; i < end; ++i) away[i] = distance.distance(cage.vertices[i]);
            stage.advance(end - begin);
        });
    }
    const double least = *std::min_element(away.begin(), away.end()),
                 most = *std::max_element(away.begin(), away.end());
    std::vector<Interval> found(chunk_count(count, grain), Interval{infinity, 0});
    Stage stage(parts.until(1), "verify: bounds", count);
    for_chunks(count, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) {
            const Corners t = corners_of(cage, i);
            found[chunk].nearest = std::min(found[chunk].nearest, distance.lower(t, least));
            found[chunk].farthest =
                std::max(found[chunk].farthest, distance.upper(t, most, excess * most, allowed));
        }
        stage.advance(end - begin);
    });
    Interval all{infinity, 0};
    for (const Interval& part : found)
        all = {std::min(all.nearest, part.nearest), std::max(all.farthest, part.farthest)};
    return all;
}

void check_lengths(const VerifyCageOptions& options) {
    for (const auto& length : {options.clearance, options.distance})
        if (length && !(*length >= 0 && std::isfinite(*length)))
            throw OptionError(fmt::format("length {}: must be 0 or more", *length));
    if (options.clearance && options.distance && *options.clearance > *options.distance)
        throw OptionError(fmt::format("clearance {:g} is larger than the distance {:g}", *options.clearance,
                                      *options.distance));
}

/// The checks of the distances that were asked for.
void judge_distances(const VerifyCageOptions& options, const VerifyCageReport& report, std::uint64_t triangles,
                     std::vector<VerifyCheck>& checks) {
    const auto add = [&](const char* name, bool good, double margin, std::string detail) {
        checks.push_back(check_of(name, triangles, good ? 0 : 1, std::move(detail)));
        checks.back().worst = margin;
    };
    if (options.clearance)
        add("clearance", report.nearest >= *options.clearance, report.nearest - *options.clearance,
            fmt::format("no point of the cage is nearer than {}, proven; at least {} was asked for",
                        report.nearest, *options.clearance));
    if (options.distance)
        add("distance", report.farthest <= *options.distance, *options.distance - report.farthest,
            fmt::format("no point of the cage is farther than {}, proven; at most {} was asked for",
                        report.farthest, *options.distance));
}

VerifyCageReport check_all(const Mesh& given_cage, const Mesh& given_mesh, const VerifyCageOptions& options,
                           const Progress& progress) {
    Parts parts(progress);
    require_mesh(given_cage, "cage");
    require_mesh(given_mesh, "mesh");
    const double largest = std::max(largest_coordinate(given_cage), largest_coordinate(given_mesh));
    const bool common = largest == 0 || (largest > 0x1p-100 && largest < 0x1p100);
    const int exponent = common ? 0 : std::ilogb(largest);
    const Body cage = make_body(given_cage, exponent), mesh = make_body(given_mesh, exponent);
    const Boxes of_cage(cage.mesh), of_mesh(mesh.mesh);
    VerifyCageReport report;
    report.cage_components = cage.one_of_each.size();
    report.mesh_components = mesh.one_of_each.size();
    std::vector<VerifyCheck>& checks = report.checks;
    checks.push_back(check_edges(cage.mesh));
    if (checks.back().passed) checks.push_back(check_vertices(cage.mesh));
    checks.push_back(check_areas(cage.mesh, parts.until(0.05)));
    checks.push_back(check_self_intersections(cage.mesh, of_cage, parts.until(0.25)));
    checks.push_back(check_disjoint(cage.mesh, mesh.mesh, of_mesh, parts.until(0.45)));
    if (options.inner)
        check_enclosed(cage, mesh, of_mesh, exponent, parts.until(0.5), checks);
    else
        checks.push_back(check_enclosing(cage, of_cage, mesh, exponent, parts.until(0.5)));
    const double allowed = options.distance ? std::ldexp(*options.distance, -exponent) : infinity;
    const CageDistance distance(mesh.mesh, of_mesh, std::ldexp(largest, -exponent));
    const Interval interval = measure(cage.mesh, distance, allowed, parts.until(1));
    report.nearest = std::ldexp(interval.nearest, exponent);
    report.farthest = std::ldexp(interval.farthest, exponent);
    judge_distances(options, report, cage.mesh.triangles.size(), checks);
    return report;
}

}  // namespace
}  // namespace its::verifier

namespace its {
using namespace verifier;

bool VerifyCageReport::passed() const {
    return std::all_of(checks.begin(), checks.end(), [](const VerifyCheck& check) { return check.passed; });
}

VerifyCageReport verify_cage(const MeshView& cage, const MeshView& mesh, const VerifyCageOptions& options) {
    const Stopwatch watch;
    check_lengths(options);
    return run_call(options.run, "verify cage", [&](const Progress& progress) {
        VerifyCageReport report = check_all(to_mesh(cage), to_mesh(mesh), options, progress);
        report.seconds.total = watch.seconds();
        return report;
    });
}

}  // namespace its
