#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/disjoint_sets.h"
#include "base/names.h"
#include "base/parallel.h"
#include "geometry/box.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "inspect/cycle.h"
#include "inspect/inspect.h"
#include "inspect/orient.h"
#include "inspect/repair.h"
#include "inspect/sides.h"
#include "inspect/wrong_parts.h"
#include "its/inspect.h"
#include "its/mesh.h"
#include "its/stopwatch.h"
#include "mesh/arrays.h"
#include "mesh/merged.h"
#include "mesh/scaled.h"

namespace its {
using namespace inspector;

namespace {

/// What is counted about edges; see MeshReport.
struct EdgeCounts {
    std::uint64_t edges = 0, boundary = 0, nonmanifold = 0, inconsistent = 0, odd = 0;
    std::vector<UnbalancedEdge> unbalanced;
};

/// Counts edges, from the triangles for which `use` holds, none of which repeats a corner.
template <class Use>
EdgeCounts count_edges(const mesh::Merged& mesh, Use&& use) {
    EdgeCounts counts;
    mesh::for_edges(mesh, use, [&](std::uint32_t low, std::span<const mesh::EdgeUse> uses) {
        const auto up =
            std::int64_t(std::count_if(uses.begin(), uses.end(), [](const auto& u) { return u.upwards; }));
        const std::int64_t excess = 2 * up - std::int64_t(uses.size());
        ++counts.edges;
        counts.boundary += uses.size() == 1;
        counts.nonmanifold += uses.size() > 2;
        counts.inconsistent += uses.size() == 2 && excess != 0;
        counts.odd += uses.size() % 2;
        if (excess != 0) counts.unbalanced.push_back({low, uses[0].high, excess});
    });
    return counts;
}

/// Triangles over the same three positions as an earlier one, in any order and direction.
std::uint64_t count_duplicates(const mesh::Merged& mesh) {
    // Only triangles with the same lowest corner can be the same.
    std::vector<std::uint64_t> begin(mesh.points.size() + 1);
    for (const Triangle& t : mesh.triangles) {
        if (!mesh::repeats_corner(t)) ++begin[std::min({t[0], t[1], t[2]}) + std::size_t{1}];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint64_t> others(begin.back());  // the middle corner, the highest
    std::vector<std::uint64_t> at(begin.begin(), begin.end() - 1);
    for (Triangle t : mesh.triangles) {
        if (mesh::repeats_corner(t)) continue;
        std::sort(t.begin(), t.end());
        others[at[t[0]]++] = std::uint64_t{t[1]} << 32 | t[2];
    }
    std::uint64_t duplicates = 0;
    for (std::size_t low = 0; low + 1 < begin.size(); ++low) {
        const auto first = others.begin() + std::ptrdiff_t(begin[low]),
                   last = others.begin() + std::ptrdiff_t(begin[low + 1]);
        std::sort(first, last);
        duplicates += std::uint64_t(last - std::unique(first, last));
    }
    return duplicates;
}

/// Sets of points that triangles connect.
std::uint64_t count_components(const mesh::Merged& mesh) {
    DisjointSets sets(mesh.points.size());
    std::uint64_t components = mesh.points.size();
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 1; k < 3; ++k) components -= sets.join(t[0], t[k]);
    return components;
}

double volume_of(const mesh::Merged& mesh, const Box& box) {
    const Vec3 centre = 0.5 * box.min + 0.5 * box.max;
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.points[t[0]] - centre, b = mesh.points[t[1]] - centre,
                   c = mesh.points[t[2]] - centre;
        sum += dot(a, cross(b, c));
    }
    return sum / 6;
}

/// In whole percent, never more than there is.
double percent(double share) {
    return std::floor(100 * share);
}

/// The share of the area that must separate inside from outside for a mesh with holes to have an inside.
constexpr double least_separating = 0.5;
/// Edges with an odd number of triangles, per triangle, beyond which a mesh is a soup: half of the three that
/// each has.
constexpr double most_open_edges = 1.5;

void all_around(std::vector<std::uint8_t>& turn, std::size_t triangles) {
    turn.assign(triangles, 1);
}

/// The boundary cancels: winding numbers are whole.
void decide_cycle(const mesh::Merged& mesh, Inspection& out) {
    MeshReport& report = out.report;
    report.sign = SignRule::winding;
    report.sign_reason =
        report.t_junctions == 0
            ? "every edge is used as often in one direction as in the other, so winding numbers are defined"
            : fmt::format(
                  "closed: at {} T-junctions an edge is split on one side only, by points exactly on it, "
                  "which leaves no gap, so winding numbers are defined",
                  report.t_junctions);
    report.sign_advice = SignAdvice::around_both_sides;
    if (!(report.signed_volume < 0)) return;
    if (sample_sides(mesh, winding::Filling(mesh)).any_inside) {
        report.sign_reason += "; more volume is enclosed inside out than right side out, and stays outside";
        return;
    }
    all_around(out.turn, mesh.triangles.size());
    report.sign_reason +=
        "; the mesh is inside out (its signed volume is negative, and nothing has a positive winding number), "
        "so all triangles are turned around";
    report.sign_advice = SignAdvice::winding_as_it_is;
}

/// Every edge has an even number of triangles, but their directions do not agree.
void decide_even(const mesh::Merged& merged, Inspection& out) {
    MeshReport& report = out.report;
    const Patches patches = find_patches(merged);
    const auto balanced = [&](const std::vector<std::uint8_t>& turn) {
        const mesh::Merged after{merged.points, turned(merged.triangles, turn)};
        const EdgeCounts edges =
            count_edges(after, [&](std::size_t i) { return !mesh::repeats_corner(after.triangles[i]); });
        return cancel_segments(after.points, edges.unbalanced, Chain::signed_sum).open == 0;
    };
    report.sign_advice = SignAdvice::around_both_sides;
    for (const bool all : {false, true}) {
        if (!patches.orientable) break;
        const std::vector<std::uint8_t> turn = outward_turns(merged, patches, all);
        if (!balanced(turn)) continue;
        out.turn = turn;
        report.repaired = std::uint64_t(std::count(turn.begin(), turn.end(), 1));
        report.sign = SignRule::winding;
        report.sign_reason =
            "closed, but not all triangles agree about the outside: those that do not are turned around, part "
            "by part, so that most of each part faces outward, and winding numbers are defined";
        report.sign_advice = SignAdvice::crossings_as_it_is;
        return;
    }
    report.sign = SignRule::even_odd;
    report.sign_reason = fmt::format(
        "closed (every edge has an even number of triangles), but {}: inside is where a ray to infinity "
        "crosses an odd number of triangles",
        patches.orientable ? "the parts cannot be turned so that all agree" : "one-sided, like a Klein bottle");
}

/// What was done to the directions of triangles, as the end of a sentence; empty: nothing.
std::string repair_text(const Directions& directions) {
    std::string text;
    if (directions.repaired > 0)
        text += fmt::format("; {} triangles that disagreed with most of those around them are turned around",
                            directions.repaired);
    if (directions.reversed) text += "; the mesh is inside out, so all triangles are turned around";
    return text;
}

/// Some edge has an odd number of triangles: M has a boundary.
void decide_open(const mesh::Merged& mesh, Inspection& out) {
    MeshReport& report = out.report;
    report.sign = SignRule::unsigned_rule;
    report.sign_advice =
        report.inconsistent_edges > 0 ? SignAdvice::generalized_as_it_is : SignAdvice::fill_nevertheless;
    if (double(report.open_odd_edges) > most_open_edges * double(report.triangles)) {
        report.separating = 0;
        report.sign_reason = fmt::format(
            "{} edges have an odd number of triangles, more than half of what the triangles have: a soup, "
            "without inside",
            report.open_odd_edges);
        return;
    }
    Directions directions = choose_directions(mesh, report.inconsistent_edges);
    report.separating = directions.separating;
    std::string state =
        fmt::format("{} edges are not used equally often in both directions", report.open_edges);
    if (report.inconsistent_edges > 0)
        state += fmt::format(", at {} two triangles disagree about the outside", report.inconsistent_edges);
    if (directions.inconsistent > 0)
        state += fmt::format(", at {} of these whatever is turned around", directions.inconsistent);
    const double needed = report.inconsistent_edges > 0 ? nearly_all : least_separating;
    if (report.separating < needed) {
        report.sign_reason = fmt::format(
            "{}, and only {:.0f} % of the area would separate inside from outside with the holes "
            "filled ({:.0f} % is asked for), so there is no inside",
            state, percent(report.separating), percent(needed));
        return;
    }
    report.sign = SignRule::generalized;
    report.sign_reason = fmt::format(
        "{}, but {:.0f} % of the area separates inside from outside with the holes filled ({:.0f} % is asked "
        "for), so generalized winding numbers fill them{}",
        state, percent(report.separating), percent(needed), repair_text(directions));
    report.sign_advice = SignAdvice::with_holes_open;
    report.repaired = directions.repaired;
    out.turn = std::move(directions.turn);
    out.filling = std::move(directions.filling);
}

void choose_sign(const mesh::Merged& mesh, Inspection& out) {
    MeshReport& report = out.report;
    if (report.degenerate == report.triangles) {
        report.sign = SignRule::unsigned_rule;
        report.sign_reason = "every triangle has zero area, so nothing can be inside";
    } else if (report.open_edges == 0) {
        decide_cycle(mesh, out);
    } else if (report.open_odd_edges == 0) {
        decide_even(mesh, out);
    } else {
        decide_open(mesh, out);
    }
    report.turned = std::uint64_t(std::count(out.turn.begin(), out.turn.end(), 1));
}

constexpr Named<SignRule> rules[] = {{SignRule::winding, "winding"},
                                     {SignRule::generalized, "generalized"},
                                     {SignRule::unsigned_rule, "unsigned"},
                                     {SignRule::even_odd, "even-odd"}};

constexpr Named<PartFault> faults[] = {{PartFault::inside_out, "inside-out"},
                                       {PartFault::like_its_container, "like-its-container"}};

constexpr Named<SignAdvice> advices[] = {{SignAdvice::none, "none"},
                                         {SignAdvice::around_both_sides, "around-both-sides"},
                                         {SignAdvice::with_holes_open, "with-holes-open"},
                                         {SignAdvice::winding_as_it_is, "winding-as-it-is"},
                                         {SignAdvice::crossings_as_it_is, "crossings-as-it-is"},
                                         {SignAdvice::generalized_as_it_is, "generalized-as-it-is"},
                                         {SignAdvice::fill_nevertheless, "fill-nevertheless"}};

}  // namespace

std::string_view name(SignRule rule) {
    return name_in(rules, rule);
}

std::optional<SignRule> parse_sign_rule(std::string_view name) {
    return value_in(rules, name);
}

std::string_view name(SignAdvice advice) {
    return name_in(advices, advice);
}

std::optional<SignAdvice> parse_sign_advice(std::string_view name) {
    return value_in(advices, name);
}

std::optional<SignRule> advised_rule(SignAdvice advice) {
    switch (advice) {
        case SignAdvice::around_both_sides:
        case SignAdvice::with_holes_open:
            return SignRule::unsigned_rule;
        case SignAdvice::winding_as_it_is:
            return SignRule::winding;
        case SignAdvice::crossings_as_it_is:
            return SignRule::even_odd;
        case SignAdvice::generalized_as_it_is:
        case SignAdvice::fill_nevertheless:
            return SignRule::generalized;
        case SignAdvice::none:
            break;
    }
    return std::nullopt;
}

std::string_view name(PartFault fault) {
    return name_in(faults, fault);
}

std::optional<PartFault> parse_part_fault(std::string_view name) {
    return value_in(faults, name);
}

namespace {

double volume_in_units_of_caller(double volume, const geometry::Scaling& scaling) {
    return std::ldexp(volume, 3 * scaling.exponent);
}

Inspection examine_scaled(const mesh::Arrays& mesh, const Progress& progress) {
    constexpr int steps = 7;
    Stage stage(progress, "mesh", steps);
    const mesh::Merged merged = mesh::merge(mesh);
    stage.advance(1);
    Inspection out;
    MeshReport& report = out.report;
    report.vertices = merged.points.size();
    report.triangles = merged.triangles.size();
    std::vector<bool> degenerate(merged.triangles.size());
    std::uint64_t faces = 0;
    for (std::size_t i = 0; i < merged.triangles.size(); ++i) {
        const Triangle& t = merged.triangles[i];
        const bool repeats = mesh::repeats_corner(t);
        degenerate[i] =
            repeats || geometry::is_degenerate(merged.points[t[0]], merged.points[t[1]], merged.points[t[2]]);
        faces += !repeats;
        report.degenerate += degenerate[i];
    }
    stage.advance(1);
    report.duplicate = count_duplicates(merged);
    stage.advance(1);
    const EdgeCounts edges =
        count_edges(merged, [&](std::size_t i) { return !mesh::repeats_corner(merged.triangles[i]); });
    report.boundary_edges = edges.boundary;
    report.nonmanifold_edges = edges.nonmanifold;
    report.inconsistent_edges = edges.inconsistent;
    report.unbalanced_edges = edges.unbalanced.size();
    report.odd_edges = edges.odd;
    if (report.unbalanced_edges > 0 && report.degenerate > 0) {
        // Zero-area triangles have no winding number of their own: they may close cracks, but never open one.
        const EdgeCounts without = count_edges(merged, [&](std::size_t i) { return !degenerate[i]; });
        report.unbalanced_edges = std::min<std::uint64_t>(report.unbalanced_edges, without.unbalanced.size());
        report.odd_edges = std::min(report.odd_edges, without.odd);
    }
    stage.advance(1);
    // Their own boundaries cancel: it does not matter whether these edges are with or without them.
    const Remainder whole = cancel_segments(merged.points, edges.unbalanced, Chain::signed_sum);
    report.open_edges = whole.open;
    if (report.unbalanced_edges > 0) report.t_junctions = whole.t_junctions;
    report.open_odd_edges = whole.open;
    if (whole.open > 0) {
        const Remainder odd = cancel_segments(merged.points, edges.unbalanced, Chain::modulo_two);
        report.open_odd_edges = odd.open;
        if (odd.open == 0) report.t_junctions = odd.t_junctions;
    }
    report.components = count_components(merged);
    stage.advance(1);
    report.euler = std::int64_t(report.vertices) - std::int64_t(edges.edges) + std::int64_t(faces);
    report.closed = report.boundary_edges == 0 || report.open_odd_edges == 0;
    report.oriented = report.inconsistent_edges == 0;
    report.bounds = geometry::bounds(merged.points);
    report.signed_volume = volume_of(merged, report.bounds);
    choose_sign(merged, out);
    stage.advance(1);
    if (out.turn.empty())
        examine_parts(merged, out);
    else
        examine_parts({merged.points, turned(merged.triangles, out.turn)}, out);
    stage.advance(1);
    return out;
}

}  // namespace

Inspection inspector::examine(const mesh::Arrays& mesh, const Progress& progress) {
    const mesh::Scaled scaled(mesh);
    const geometry::Scaling& scaling = scaled.scaling();
    Inspection out = examine_scaled(scaled.arrays(), progress);
    out.report.bounds = scaling.out(out.report.bounds);
    out.report.signed_volume = volume_in_units_of_caller(out.report.signed_volume, scaling);
    out.report.parts = in_units_of_caller(std::move(out.report.parts), scaling);
    return out;
}

PartsReport inspector::in_units_of_caller(PartsReport parts, const geometry::Scaling& scaling) {
    for (WrongPart& part : parts.wrong) {
        part.bounds = scaling.out(part.bounds);
        part.volume = volume_in_units_of_caller(part.volume, scaling);
    }
    return parts;
}

MeshReport inspect(const MeshView& mesh, const Run& run) {
    const Stopwatch watch;
    const mesh::Native native(mesh);
    MeshReport report = with_threads(run.threads, [&] { return examine(native).report; });
    report.seconds.total = watch.seconds();
    return report;
}

std::vector<Triangle> inspector::turned(std::vector<Triangle> triangles, std::span<const std::uint8_t> turn) {
    for (std::size_t i = 0; i < turn.size(); ++i)
        if (turn[i] != 0) std::swap(triangles[i][1], triangles[i][2]);
    return triangles;
}

Mesh inspector::turned(Mesh mesh, std::span<const std::uint8_t> turn) {
    mesh.triangles = turned(std::move(mesh.triangles), turn);
    return mesh;
}

Mesh oriented(const MeshView& mesh, const Run& run) {
    const mesh::Native native(mesh);
    return with_threads(run.threads, [&] { return turned(mesh::copy_of(native), examine(native).turn); });
}

Mesh turn_parts(const MeshView& mesh, const Run& run) {
    const mesh::Native native(mesh);
    return with_threads(run.threads, [&] {
        const Inspection inspection = examine(native);
        return turned(turned(mesh::copy_of(native), inspection.turn), inspection.part_turn);
    });
}

}  // namespace its
