#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "verify/proof.h"

namespace its::verifier {
namespace {

/// A triangle of M in lattice units.
struct Part {
    Polygon polygon;
    std::uint32_t triangle = 0;
};

/// Walks the cells that a part of M may meet.
class Walker {
public:
    Walker(const Job& job, const Goal& goal, ProofTally& tally)
        : job_(job),
          lattice_(job.view.lattice()),
          goal_(goal),
          lists_(job.arrays.lists),
          dilation_(cell_dilation(lattice_)),
          certain_(certain_dilation(lattice_)),
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

    /// All cells in slab i of `axis`.
    void slab(const Part& part, int axis, std::int64_t i) {
        const int second = (axis + 1) % 3, third = (axis + 2) % 3;
        Polygon sheet, row, piece;
        if (!cut(part.polygon, axis, i, sheet)) return;
        Cell cell;
        cell[axis] = std::uint32_t(i);
        const CellRange rows = range(sheet, second);
        for (std::int64_t j = rows.low; j <= rows.high; ++j) {
            if (!cut(sheet, second, j, row)) continue;
            cell[second] = std::uint32_t(j);
            const CellRange cells = range(row, third);
            for (std::int64_t k = cells.low; k <= cells.high; ++k) {
                if (!cut(row, third, k, piece)) continue;
                cell[third] = std::uint32_t(k);
                meet(part, cell, look_up(cell), piece);
            }
        }
    }

    /// All leaves below a cell of a level, where surface cells are of several: each cell on the way cuts the
    /// part anew, so that roundings do not add up.
    void descend(const Part& part, int level, const Cell& cell) {
        const double width = std::ldexp(1.0, level);
        Polygon piece = part.polygon, next;
        for (int axis = 0; axis < 3; ++axis) {
            const double low = width * double(cell[std::size_t(axis)]);
            if (!clip_slab(piece, axis, low - dilation_, low + width + dilation_, next)) return;
            piece = next;
        }
        const bool divided = level > 0 && job_.view.group(level - 1, cell) != no_group;
        const CellEntry entry = divided ? CellEntry{} : leaf_of(level, cell);
        if (entry.marked || level == 0) return meet(part, cell, entry, piece);
        for (std::uint32_t child = 0; child < 8; ++child)  // f is not trilinear in all of an empty leaf
            descend(part, level - 1,
                    {2 * cell[0] + (child & 1), 2 * cell[1] + (child >> 1 & 1), 2 * cell[2] + (child >> 2)});
    }

private:
    bool cut(const Polygon& in, int axis, std::int64_t i, Polygon& out) const {
        return clip_slab(in, axis, double(i) - dilation_, double(i + 1) + dilation_, out);
    }

    /// A cell that is not subdivided, of a level; not marked if it is in a leaf only.
    CellEntry leaf_of(int level, const Cell& cell) const {
        const std::uint64_t group = job_.view.group(level, {cell[0] >> 1, cell[1] >> 1, cell[2] >> 1});
        return job_.view.cell_of(group, cell, level);
    }

    /// The part in a cell of the entry's level.
    void meet(const Part& part, const Cell& cell, const CellEntry& entry, const Polygon& piece) {
        const double width = std::ldexp(1.0, entry.level);
        coverage(part, cell, entry, piece);
        ++tally_.pairs;
        if (piece.overflow) {
            ++tally_.overflow;
            return;
        }
        Polygon local = piece;
        for (int i = 0; i < local.count; ++i)  // exact: the result has no more bits than the vertex
            for (int axis = 0; axis < 3; ++axis)
                local.vertex[i][axis] =
                    (local.vertex[i][axis] - width * double(cell[std::size_t(axis)])) / width;
        double v[8];
        job_.view.corners(cell, entry, v);
        double low = -infinity, high = infinity;
        if (entry.marked) {
            ++tally_.local_pairs;
            low = job_.view.data().surface.lower[entry.surface];
            high = job_.view.data().surface.upper[entry.surface];
        }
        bound_polygon(lattice_, goal_, cell, width, v, low, high, local, tally_);
    }

    CellEntry look_up(const Cell& cell) {
        const Cell parent = {cell[0] >> 1, cell[1] >> 1, cell[2] >> 1};
        if (parent != last_parent_) {
            last_parent_ = parent;
            last_group_ = job_.view.group(0, parent);
        }
        return job_.view.cell_of(last_group_, cell);
    }

    /// A cell that M meets when dilated as the file promises must be marked, and list the triangle.
    void coverage(const Part& part, const Cell& cell, const CellEntry& entry, const Polygon& piece) {
        const bool listed = entry.marked && job_.same_mesh && lists(entry, part.triangle);
        if (listed || (entry.marked && !job_.same_mesh)) {
            tally_.listed += listed;
            return;
        }
        const double width = std::ldexp(1.0, entry.level);
        if (!certainly_meets(cell, width, piece)) {
            tally_.grazing += !entry.marked;
            return;
        }
        const Vec3 at = lattice_.from_lattice(piece.vertex[0]);
        if (entry.marked) {
            if (tally_.unlisted++ == 0) tally_.unlisted_at = at;
        } else {
            const double depth = depth_in(cell, width, piece);
            ++tally_.uncovered;
            if (depth >= tally_.uncovered_depth) tally_.uncovered_depth = depth, tally_.uncovered_at = at;
        }
    }

    bool lists(const CellEntry& entry, std::uint32_t triangle) const {
        const auto begin = lists_.triangle.begin();
        return std::binary_search(begin + std::ptrdiff_t(lists_.begin[entry.surface]),
                                  begin + std::ptrdiff_t(lists_.begin[entry.surface + 1]), triangle);
    }

    /// Whether some vertex is so near to the cell that, whatever rounding did, the triangle meets the cell
    /// dilated as the file promises.
    bool certainly_meets(const Cell& cell, double width, const Polygon& piece) const {
        Polygon inside = piece, next;
        for (int axis = 0; axis < 3; ++axis) {
            const double low = width * double(cell[std::size_t(axis)]);
            if (!clip_slab(inside, axis, low - certain_, low + width + certain_, next) || next.overflow)
                return false;
            inside = next;
        }
        return true;
    }

    /// How deep in the cell the deepest vertex is.
    static double depth_in(const Cell& cell, double width, const Polygon& piece) {
        double deepest = 0;
        for (int i = 0; i < piece.count; ++i) {
            double depth = 0.5 * width;
            for (int axis = 0; axis < 3; ++axis) {
                const double x = piece.vertex[i][axis] - width * double(cell[std::size_t(axis)]);
                depth = std::min({depth, x, width - x});
            }
            deepest = std::max(deepest, depth);
        }
        return deepest;
    }

    const Job& job_;
    const Lattice& lattice_;
    const Goal& goal_;
    const Lists& lists_;
    double dilation_, certain_;
    Cell last_parent_ = {~0u, ~0u, ~0u};
    std::uint64_t last_group_ = no_group;
    ProofTally& tally_;
};

Part make_part(const Job& job, std::uint64_t t) {
    Part part;
    part.triangle = std::uint32_t(t);
    part.polygon.count = 3;
    for (int i = 0; i < 3; ++i)
        part.polygon.vertex[i] =
            job.view.lattice().to_lattice(job.mesh.vertices[job.mesh.triangles[t][std::size_t(i)]]);
    return part;
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

/// Where surface cells are of several levels: triangle by triangle, from the root down.
ProofTally walk_leaves(const Job& job, const Goal& goal) {
    const std::uint64_t triangles = job.mesh.triangles.size();
    constexpr std::uint64_t grain = 16;
    Stage stage(job.parts.until(0.5), "verify: proof", triangles);
    std::vector<ProofTally> tallies(chunk_count(triangles, grain));
    for_chunks(triangles, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        Walker walker(job, goal, tallies[chunk]);
        for (std::uint64_t t = begin; t < end; ++t)
            walker.descend(make_part(job, t), job.view.lattice().depth + 1, {0, 0, 0});
        stage.advance(end - begin);
    });
    ProofTally sum;
    for (const ProofTally& tally : tallies) sum.add(tally);
    return sum;
}

ProofTally walk(const Job& job, const Goal& goal) {
    if (job.view.adaptive()) return walk_leaves(job, goal);
    const std::uint64_t triangles = job.mesh.triangles.size();
    ProofTally unused;
    const Walker ruler(job, goal, unused);
    std::vector<std::uint64_t> first(triangles + 1);  // number of slabs before each triangle
    for (std::uint64_t t = 0; t < triangles; ++t) {
        const Slabs slabs = slabs_of(ruler, make_part(job, t).polygon);
        first[t + 1] = first[t] + std::uint64_t(slabs.range.high - slabs.range.low + 1);
    }
    const std::uint64_t count = first.back();
    constexpr std::uint64_t grain = 64;
    Stage stage(job.parts.until(0.5), "verify: proof", count);
    std::vector<ProofTally> tallies(chunk_count(count, grain));
    for_chunks(count, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        Walker walker(job, goal, tallies[chunk]);
        std::uint64_t t =
            std::uint64_t(std::upper_bound(first.begin(), first.end(), begin) - first.begin()) - 1;
        for (std::uint64_t i = begin; i < end; ++t) {
            const Part part = make_part(job, t);
            const Slabs slabs = slabs_of(walker, part.polygon);
            for (; i < std::min(end, first[t + 1]); ++i)
                walker.slab(part, slabs.axis, slabs.range.low + std::int64_t(i - first[t]));
        }
        stage.advance(end - begin);
    });
    ProofTally sum;
    for (const ProofTally& tally : tallies) sum.add(tally);
    return sum;
}

/// How far from a cell that lists it a triangle may be, per axis: the promised dilation, twice, and the
/// builder's allowance for the rounding of its normal, 16 roundings of |ab||ac| / |n| (sums of coordinates) of
/// the root's side; but a needle is no farther from the cell than it is wide, since its edges are tested as
/// well.
double list_margin(const Lattice& lattice, const Polygon& triangle) {
    const Vec3 u = triangle.vertex[1] - triangle.vertex[0], v = triangle.vertex[2] - triangle.vertex[0],
               w = triangle.vertex[2] - triangle.vertex[1], n = cross(u, v);
    const auto sum = [](const Vec3& a) { return std::abs(a.x) + std::abs(a.y) + std::abs(a.z); };
    const double area = norm(n), longest = std::max({norm(u), norm(v), norm(w)});
    const double wide = longest > 0 ? area / longest + 64 * lattice.ulp() : 0;
    const double slack = area > 0 ? 32 * lattice.ulp() * sum(u) * sum(v) / area : infinity;
    return 2 * lattice.dilation() + 64 * lattice.ulp() + 2 * std::min(slack, wide);
}

struct ListTally {
    std::uint64_t tested = 0, foreign = 0;
    Vec3 at;
};

/// The lists of a group's cells: triangles that are not near their cell.
void check_lists_of(const Job& job, int level, std::uint64_t group, ListTally& tally) {
    const Lattice& lattice = job.view.lattice();
    const Lists& lists = job.arrays.lists;
    const Cell parent = separate(job.view.data().octree.levels[std::size_t(level)].parent[group]);
    const double width = std::ldexp(1.0, level);
    std::uint64_t surface = job.view.first_surface(level, group);
    for (unsigned child = 0; child < 8; ++child) {
        if ((job.view.surface_bits(level, group) >> child & 1) == 0) continue;
        for (std::uint64_t i = lists.begin[surface]; i < lists.begin[surface + 1]; ++i) {
            Polygon piece = make_part(job, lists.triangle[i]).polygon, next;
            const double margin = list_margin(lattice, piece);
            bool near = true;
            Vec3 corner;
            for (int axis = 0; axis < 3 && near; ++axis) {
                corner[axis] = width * (2.0 * parent[std::size_t(axis)] + double(child >> axis & 1));
                near = clip_slab(piece, axis, corner[axis] - margin, corner[axis] + width + margin, next);
                piece = next;
            }
            ++tally.tested;
            if (!near && tally.foreign++ == 0) tally.at = lattice.from_lattice(corner);
        }
        ++surface;
    }
}

ListTally check_foreign(const Job& job) {
    constexpr std::uint64_t grain = 256;
    Stage stage(job.parts.until(0.55), "verify: lists", job.view.surface_cells());
    ListTally sum;
    for (int level = 0; level < job.view.surface_levels(); ++level) {
        const std::uint64_t groups = job.view.data().octree.levels[std::size_t(level)].parent.size();
        std::vector<ListTally> tallies(chunk_count(groups, grain));
        for_chunks(groups, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t g = begin; g < end; ++g) check_lists_of(job, level, g, tallies[chunk]);
            stage.advance(job.view.first_surface(level, end) - job.view.first_surface(level, begin));
        });
        for (const ListTally& t : tallies) {
            if (sum.foreign == 0) sum.at = t.at;
            sum.tested += t.tested, sum.foreign += t.foreign;
        }
    }
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
    // Certified bounds contain γ; what the paper's candidates leave of it is not promised.
    const bool certified = data.info.extrema == Extrema::certified;
    goal.strict_inner = certified ? goal.proven_inner : goal.inner;
    goal.strict_outer = certified ? goal.proven_outer : goal.outer;
    const double tolerance = tightness_tolerance(job.view.lattice());
    if (goal.inner < 0) goal.tight_inner = goal.inner + tolerance;
    if (goal.outer > 0) goal.tight_outer = goal.outer - tolerance;
    return goal;
}

/// Width of the largest surface cell, in finest cells.
double largest_cell(const View& view) {
    for (int level = view.surface_levels() - 1; level > 0; --level) {
        const std::uint64_t groups = view.data().octree.levels[std::size_t(level)].parent.size();
        if (view.first_surface(level, groups) > view.first_surface(level, 0)) return std::ldexp(1.0, level);
    }
    return 1;
}

void report_coverage(const Job& job, const ProofTally& sum, VerifyReport& report) {
    const double w = job.width();
    VerifyCheck coverage{"G1 coverage",
                         sum.uncovered == 0 && sum.overflow == 0,
                         true,
                         sum.pairs,
                         sum.uncovered,
                         sum.uncovered > 0 ? -sum.uncovered_depth * w : 0.0,
                         ""};
    coverage.detail =
        sum.uncovered > 0
            ? fmt::format("{} cells that M meets are not marked; M is {:.3g} deep in the worst, at {}",
                          sum.uncovered, sum.uncovered_depth * w, place(sum.uncovered_at))
            : fmt::format("every cell that M meets when dilated by {:.3g} is marked",
                          certain_dilation(job.view.lattice()) * w);
    if (sum.overflow > 0) coverage.detail += fmt::format("; {} pieces could not be clipped", sum.overflow);
    report.checks.push_back(coverage);

    VerifyCheck lists{"G3 triangle lists",
                      sum.unlisted == 0,
                      true,
                      sum.listed + sum.unlisted,
                      sum.unlisted,
                      0,
                      "not compared: the mesh differs from the shell's copy"};
    if (job.same_mesh) {
        const ListTally foreign = check_foreign(job);
        lists.passed = lists.passed && foreign.foreign == 0;
        lists.tested += foreign.tested;
        lists.violations += foreign.foreign;
        lists.detail = "every cell lists the triangles that meet it, dilated by rounding, and no others";
        if (sum.unlisted > 0)
            lists.detail =
                fmt::format("{} triangles are missing in the list of a cell that they meet, first at {}",
                            sum.unlisted, place(sum.unlisted_at));
        else if (foreign.foreign > 0)
            lists.detail =
                fmt::format("{} triangles are listed in a cell that they do not meet, first in that at {}",
                            foreign.foreign, place(foreign.at));
    }
    report.checks.push_back(lists);
}

}  // namespace

void check_all_of_mesh(const Job& job, VerifyReport& report) {
    const Goal goal = make_goal(job);
    const ProofTally sum = walk(job, goal);
    const double w = job.width(), tolerance = proven_tolerance(job.view.lattice(), largest_cell(job.view));
    report.proven_min = sum.low * w;
    report.proven_max = sum.high * w;
    report_coverage(job, sum, report);

    const double proven = std::min(goal.proven_outer - sum.high, sum.low - goal.proven_inner);
    const double margin = sum.violations > 0 ? -sum.excess : proven;
    VerifyCheck proof{"G1 containment, proven",
                      sum.violations == 0 && margin >= -tolerance && sum.overflow == 0,
                      true,
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
        {"local bounds, proven", local_ok, true, sum.local_pairs, sum.local_violations,
         (sum.local_violations > 0 ? -sum.local_excess : sum.local_margin) * w,
         sum.local_violations > 0
             ? fmt::format("f on M leaves the bounds of its cell, most at {}", place(sum.local_excess_at))
             : fmt::format("f on M within the bounds of its cell; closest at {}", place(sum.local_at))});

    const double inner_gap = goal.inner < 0 ? sum.attained_low - goal.inner : 0.0;
    const double outer_gap = goal.outer > 0 ? goal.outer - sum.attained_high : 0.0;
    const double loosest = tightness_tolerance(job.view.lattice());
    const std::uint64_t loose = (inner_gap > loosest) + std::uint64_t(outer_gap > loosest);
    report.checks.push_back(
        {"G2 tightness", loose == 0, true, 2, loose, (loosest - std::max(inner_gap, outer_gap)) * w,
         fmt::format("f attains ε₁ but for {:.3g} cell widths at {}, ε₂ but for {:.3g} at {}", inner_gap,
                     place(sum.low_at), outer_gap, place(sum.high_at))});
}

}  // namespace its::verifier
