#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "verify/proof.h"

namespace its::verifier {
namespace {

/// A triangle, edge or corner of M in lattice units.
struct Part {
    Polygon polygon;
    std::uint32_t triangle = 0;
    std::int64_t plane[3] = {-1, -1, -1};  ///< lattice plane that the part lies in exactly, or −1
};

/// Walks the cells that a part of M may meet.
class Walker {
public:
    Walker(const Job& job, const Goal& goal, const shell::CellLists& lists, ProofTally& tally)
        : job_(job),
          lattice_(job.view.data().lattice),
          goal_(goal),
          lists_(lists),
          dilation_(cell_dilation(lattice_)),
          shrink_(96 * coordinate_ulp(lattice_)),
          tally_(tally) {}

    CellRange range(const Polygon& polygon, int axis) const {
        double low = polygon.vertex[0][axis], high = low;
        for (int i = 1; i < polygon.count; ++i) {
            low = std::min(low, polygon.vertex[i][axis]);
            high = std::max(high, polygon.vertex[i][axis]);
        }
        const std::int64_t last = std::int64_t(lattice_.cells()) - 1;
        return {std::clamp(std::int64_t(std::floor(low - dilation_)), std::int64_t{0}, last),
                std::clamp(std::int64_t(std::floor(high + dilation_)), std::int64_t{0}, last)};
    }

    /// All cells in slab i of `axis`. \param contact_only  no bounds: only which cells are met.
    void slab(const Part& part, int axis, std::int64_t i, bool contact_only) {
        const int second = (axis + 1) % 3, third = (axis + 2) % 3;
        Polygon sheet, row, piece;
        if (!cut(part.polygon, axis, i, sheet)) return;
        octree::Cell cell;
        cell[axis] = std::uint32_t(i);
        const CellRange rows = range(sheet, second);
        for (std::int64_t j = rows.low; j <= rows.high; ++j) {
            if (!cut(sheet, second, j, row)) continue;
            cell[second] = std::uint32_t(j);
            const CellRange cells = range(row, third);
            for (std::int64_t k = cells.low; k <= cells.high; ++k) {
                if (!cut(row, third, k, piece)) continue;
                cell[third] = std::uint32_t(k);
                meet(part, cell, piece, contact_only);
            }
        }
    }

private:
    bool cut(const Polygon& in, int axis, std::int64_t i, Polygon& out) const {
        return clip_slab(in, axis, double(i) - dilation_, double(i + 1) + dilation_, out);
    }

    void meet(const Part& part, const octree::Cell& cell, const Polygon& piece, bool contact_only) {
        const CellEntry entry = look_up(cell);
        coverage(part, cell, entry, piece);
        if (contact_only) return;
        ++tally_.pairs;
        if (piece.overflow) {
            ++tally_.overflow;
            return;
        }
        Polygon local = piece;
        for (int i = 0; i < local.count; ++i)  // exact: the result has no more bits than the vertex
            for (int axis = 0; axis < 3; ++axis) local.vertex[i][axis] -= double(cell[axis]);
        double v[8];
        job_.view.corners(cell, entry, v);
        double low = -infinity, high = infinity;
        if (entry.marked) {
            ++tally_.local_pairs;
            low = job_.view.data().surface.lower[entry.surface];
            high = job_.view.data().surface.upper[entry.surface];
        }
        bound_polygon(lattice_, goal_, cell, v, low, high, local, tally_);
    }

    CellEntry look_up(const octree::Cell& cell) {
        const octree::Cell parent = {cell[0] >> 1, cell[1] >> 1, cell[2] >> 1};
        if (parent != last_parent_) {
            last_parent_ = parent;
            last_group_ = job_.view.group(0, parent);
        }
        return job_.view.cell_of(last_group_, cell);
    }

    /// A cell that M certainly meets must be marked, and list the triangle.
    void coverage(const Part& part, const octree::Cell& cell, const CellEntry& entry, const Polygon& piece) {
        if (entry.marked && (!job_.same_mesh || lists(entry, part.triangle))) {
            tally_.listed += job_.same_mesh;
            return;
        }
        const double depth = certain_depth(part, cell, piece);
        if (depth < 0) {
            tally_.grazing += !entry.marked;
            return;
        }
        const Vec3 at = from_lattice(lattice_, piece.vertex[0]);
        if (entry.marked) {
            if (tally_.unlisted++ == 0) tally_.unlisted_at = at;
        } else {
            ++tally_.uncovered;
            if (depth >= tally_.uncovered_depth) tally_.uncovered_depth = depth, tally_.uncovered_at = at;
        }
    }

    bool lists(const CellEntry& entry, std::uint32_t triangle) const {
        const auto begin = lists_.triangle.begin();
        return std::binary_search(begin + std::ptrdiff_t(lists_.offset[entry.surface]),
                                  begin + std::ptrdiff_t(lists_.offset[entry.surface + 1]), triangle);
    }

    /// How deep in the cell some point of the part is for certain, or −1 if rounding leaves it open whether it
    /// meets the cell. On an axis where the part lies in a face of the cell exactly, there is nothing to ask.
    double certain_depth(const Part& part, const octree::Cell& cell, Polygon piece) const {
        bool in_face[3];
        for (int axis = 0; axis < 3; ++axis) {
            in_face[axis] = part.plane[axis] == cell[axis] || part.plane[axis] == std::int64_t(cell[axis]) + 1;
            Polygon inside;
            const double low = double(cell[axis]) + shrink_, high = double(cell[axis]) + 1 - shrink_;
            if (in_face[axis]) continue;
            if (!clip_slab(piece, axis, low, high, inside) || inside.overflow) return -1;
            piece = inside;
        }
        double deepest = 0;
        for (int i = 0; i < piece.count; ++i) {
            double depth = 0.5;
            for (int axis = 0; axis < 3; ++axis) {
                const double x = piece.vertex[i][axis] - double(cell[axis]);
                if (!in_face[axis]) depth = std::min({depth, x, 1 - x});
            }
            deepest = std::max(deepest, depth);
        }
        return deepest;
    }

    const Job& job_;
    const octree::Lattice& lattice_;
    const Goal& goal_;
    const shell::CellLists& lists_;
    // A vertex inside the cell shrunk by 96 is off by less than 3 + 12 · 6
    // = 75.
    double dilation_, shrink_;
    octree::Cell last_parent_ = {~0u, ~0u, ~0u};
    std::uint64_t last_group_ = octree::no_group;
    ProofTally& tally_;
};

/// Lattice plane that vertex v is on exactly, or −1.
std::int64_t exact_plane(const octree::Lattice& lattice, int axis, double x) {
    const double u = std::nearbyint((x - lattice.position(axis, 0)) / lattice.width);
    const std::int64_t i = std::int64_t(u);
    return lattice.position(axis, i) == x ? i : -1;
}

/// The triangle's corners `from` … `from + count − 1` (cyclic).
Part make_part(const Job& job, std::uint64_t t, int from, int count) {
    const octree::Lattice& lattice = job.view.data().lattice;
    Part part;
    part.triangle = std::uint32_t(t);
    part.polygon.count = count;
    for (int i = 0; i < count; ++i) {
        const Vec3& p = job.mesh.vertices[job.mesh.triangles[t][(from + i) % 3]];
        part.polygon.vertex[i] = lattice.to_lattice(p);
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t plane = exact_plane(lattice, axis, p[axis]);
            part.plane[axis] = i == 0 || plane == part.plane[axis] ? plane : -1;
        }
    }
    return part;
}

/// Edges and corners that lie in lattice planes exactly, where the whole triangle does not: the cells on both
/// sides are met.
void walk_contacts(const Job& job, Walker& walker, std::uint64_t t) {
    const Part whole = make_part(job, t, 0, 3);
    for (int from = 0; from < 3; ++from)
        for (int count = 1; count <= 2; ++count) {
            const Part part = make_part(job, t, from, count);
            bool more = false;
            for (int axis = 0; axis < 3; ++axis) more |= part.plane[axis] >= 0 && whole.plane[axis] < 0;
            if (!more) continue;
            const CellRange slabs = walker.range(part.polygon, 0);
            for (std::int64_t i = slabs.low; i <= slabs.high; ++i) walker.slab(part, 0, i, true);
        }
}

/// The triangle's slabs of cells along its longest axis: the units of work.
struct Slabs {
    int axis = 0;
    CellRange range;
};

Slabs slabs_of(const Walker& walker, const Polygon& polygon) {
    Slabs best;
    for (int axis = 0; axis < 3; ++axis) {
        const CellRange r = walker.range(polygon, axis);
        if (axis == 0 || r.high - r.low > best.range.high - best.range.low) best = {axis, r};
    }
    return best;
}

ProofTally walk(const Job& job, const Goal& goal) {
    const shell::ShellData& data = job.view.data();
    const shell::CellLists lists =
        shell::unpack_lists(data.octree.levels[0], data.surface.lists, data.mesh.triangles.size());
    const std::uint64_t triangles = job.mesh.triangles.size();
    ProofTally unused;
    const Walker ruler(job, goal, lists, unused);
    std::vector<std::uint64_t> first(triangles + 1);  // number of slabs before each triangle
    for (std::uint64_t t = 0; t < triangles; ++t) {
        const Slabs slabs = slabs_of(ruler, make_part(job, t, 0, 3).polygon);
        first[t + 1] = first[t] + std::uint64_t(slabs.range.high - slabs.range.low + 1);
    }
    const std::uint64_t count = first.back();
    constexpr std::uint64_t grain = 64;
    Stage stage(job.options.progress, "verify: proof", count);
    std::vector<ProofTally> tallies(chunk_count(count, grain));
    for_chunks(count, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        Walker walker(job, goal, lists, tallies[chunk]);
        std::uint64_t t =
            std::uint64_t(std::upper_bound(first.begin(), first.end(), begin) - first.begin()) - 1;
        for (std::uint64_t i = begin; i < end; ++t) {
            const Part part = make_part(job, t, 0, 3);
            const Slabs slabs = slabs_of(walker, part.polygon);
            if (i == first[t]) walk_contacts(job, walker, t);
            for (; i < std::min(end, first[t + 1]); ++i)
                walker.slab(part, slabs.axis, slabs.range.low + std::int64_t(i - first[t]), false);
        }
        stage.advance(end - begin);
    });
    ProofTally sum;
    for (const ProofTally& tally : tallies) sum.add(tally);
    return sum;
}

Goal make_goal(const Job& job) {
    const shell::ShellData& data = job.view.data();
    const double rounding = data.info.rounding / job.width();
    Goal goal;
    goal.inner = data.epsilon_inner;
    goal.outer = data.epsilon_outer;
    goal.proven_inner = std::min(goal.inner + rounding, 0.0);
    goal.proven_outer = std::max(goal.outer - rounding, 0.0);
    const double tolerance = tightness_tolerance(data.lattice);
    if (goal.inner < 0) goal.tight_inner = goal.inner + tolerance;
    if (goal.outer > 0) goal.tight_outer = goal.outer - tolerance;
    return goal;
}

void report_coverage(const Job& job, const ProofTally& sum, VerifyReport& report) {
    const double w = job.width();
    VerifyCheck coverage{"G1 coverage",
                         sum.uncovered == 0 && sum.overflow == 0,
                         sum.pairs,
                         sum.uncovered,
                         sum.uncovered > 0 ? -sum.uncovered_depth * w : 0.0,
                         ""};
    coverage.detail =
        sum.uncovered > 0
            ? fmt::format("{} cells that M meets are not marked; M is {:.3g} deep in the worst, at {}",
                          sum.uncovered, sum.uncovered_depth * w, place(sum.uncovered_at))
            : fmt::format(
                  "every cell that M meets is marked; {} unmarked ones are nearer to M than "
                  "{:.3g} and not decided",
                  sum.grazing, 96 * coordinate_ulp(job.view.data().lattice) * w);
    if (sum.overflow > 0) coverage.detail += fmt::format("; {} pieces could not be clipped", sum.overflow);
    report.checks.push_back(coverage);

    VerifyCheck lists{"G3 triangle lists", sum.unlisted == 0, sum.listed + sum.unlisted, sum.unlisted, 0.0, ""};
    lists.detail = !job.same_mesh     ? "not compared: the mesh differs from the shell's copy"
                   : sum.unlisted > 0 ? fmt::format(
                                            "{} triangles are missing in the list of a cell that they meet, "
                                            "first at {}",
                                            sum.unlisted, place(sum.unlisted_at))
                                      : "every triangle is listed in every cell that it meets";
    report.checks.push_back(lists);
}

}  // namespace

void check_all_of_mesh(const Job& job, VerifyReport& report) {
    const Goal goal = make_goal(job);
    const ProofTally sum = walk(job, goal);
    const double w = job.width(), tolerance = proven_tolerance(job.view.data().lattice);
    report.proven_min = sum.low * w;
    report.proven_max = sum.high * w;
    report_coverage(job, sum, report);

    const double margin = std::min(goal.proven_outer - sum.high, sum.low - goal.proven_inner);
    VerifyCheck proof{"G1 containment, proven",
                      sum.violations == 0 && margin >= -tolerance && sum.overflow == 0,
                      sum.pieces,
                      sum.violations,
                      margin * w,
                      ""};
    proof.detail =
        fmt::format("{} cell–triangle pairs, {} pieces; {} of them within the tolerance of {:.3g} only",
                    sum.pairs, sum.pieces, sum.undecided, tolerance * w);
    if (sum.violations > 0)
        proof.detail += fmt::format("; f = {:.9g} at {}, {:.9g} at {}", sum.attained_low * w, place(sum.low_at),
                                    sum.attained_high * w, place(sum.high_at));
    report.checks.push_back(proof);

    const bool local_ok = sum.local_violations == 0 && sum.local_margin >= -tolerance;
    report.checks.push_back(
        {"local bounds, proven", local_ok, sum.local_pairs, sum.local_violations, sum.local_margin * w,
         fmt::format("f on M within the bounds of its cell; closest at {}", place(sum.local_at))});

    const double inner_gap = goal.inner < 0 ? sum.attained_low - goal.inner : 0.0;
    const double outer_gap = goal.outer > 0 ? goal.outer - sum.attained_high : 0.0;
    const double loosest = tightness_tolerance(job.view.data().lattice);
    const std::uint64_t loose = (inner_gap > loosest) + std::uint64_t(outer_gap > loosest);
    report.checks.push_back(
        {"G2 tightness", loose == 0, 2, loose, (loosest - std::max(inner_gap, outer_gap)) * w,
         fmt::format("f attains ε₁ but for {:.3g} cell widths at {}, ε₂ but for {:.3g} at {}", inner_gap,
                     place(sum.low_at), outer_gap, place(sum.high_at))});
}

}  // namespace its::verifier
