#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "base/parallel.h"
#include "verify/checks.h"

namespace its::verifier {
namespace {

using Complaint = std::optional<std::string>;  ///< what is wrong; empty: nothing

Complaint check_shape(const shell::ShellData& data) {
    const octree::Octree& octree = data.octree;
    if (octree.depth < 0 || octree.depth > max_adaptive_depth)
        return fmt::format("depth {} is out of range", octree.depth);
    if (data.lattice.depth != octree.depth) return "lattice and octree differ in depth";
    if (!(data.lattice.width > 0) || !std::isfinite(data.lattice.width)) return "cell width is not positive";
    if (octree.levels.size() != std::size_t(octree.depth) + 1) return "number of levels is not depth + 1";
    if (data.field.values.size() != octree.levels.size()) return "field and octree differ in levels";
    for (std::size_t k = 0; k < octree.levels.size(); ++k) {
        const octree::Level& level = octree.levels[k];
        if (level.mask.size() != level.parent.size()) return fmt::format("level {}: arrays differ in size", k);
        const bool leaves = k > 0 && octree.levels[1].leaf.size() > 0;
        if (level.leaf.size() != (leaves ? level.parent.size() : 0))
            return fmt::format("level {}: surface cells of another number of groups", k);
        for (std::size_t g = 0; g < level.leaf.size(); ++g)
            if ((level.leaf[g] & level.mask[g]) != 0)
                return fmt::format("level {}: a surface cell of group {} is subdivided", k, g);
        if (data.field.values[k].size() != points_of_group * level.parent.size())
            return fmt::format("level {}: not 27 values per group", k);
    }
    const octree::Level& top = octree.levels.back();
    if (top.parent.size() != 1 || top.parent[0] != 0) return "the top level is not the root's eight children";
    return {};
}

/// Order of the groups, and one group below each mask bit.
Complaint check_level(const octree::Octree& octree, int k) {
    const octree::Level& level = octree.levels[std::size_t(k)];
    const std::uint64_t codes = std::uint64_t{1} << 3 * (octree.depth - k), groups = level.parent.size();
    std::uint64_t count = 0;
    const octree::Level* below = k > 0 ? &octree.levels[std::size_t(k) - 1] : nullptr;
    for (std::uint64_t g = 0; g < groups; ++g) {
        if (level.parent[g] >= codes) return fmt::format("level {}: group {} lies outside the root", k, g);
        if (g > 0 && level.parent[g] <= level.parent[g - 1])
            return fmt::format("level {}: group {} is not in ascending order", k, g);
        if (!below) continue;
        for (unsigned bits = level.mask[g]; bits != 0; bits &= bits - 1, ++count) {
            const std::uint64_t code = level.parent[g] << 3 | unsigned(std::countr_zero(bits));
            if (count >= below->parent.size() || below->parent[count] != code)
                return fmt::format("level {}: child {} of group {} has no group below", k,
                                   std::countr_zero(bits), g);
        }
    }
    if (below && below->parent.size() != count)
        return fmt::format("level {}: has groups without parent", k - 1);
    return {};
}

Complaint check_surface(const View& view) {
    const shell::ShellData& data = view.data();
    const shell::SurfaceCells& surface = data.surface;
    const std::uint64_t cells = view.surface_cells();
    if (surface.corners_inside.size() != (view.adaptive() ? cells : 0))
        return "sides of corners: not one byte per surface cell";
    if (cells == 0) return "no cell meets the mesh";
    if (surface.lower.size() != cells || surface.upper.size() != cells)
        return "local bounds: not one per surface cell";
    for (std::uint64_t c = 0; c < cells; ++c)
        if (!(surface.lower[c] <= surface.upper[c]) || !std::isfinite(surface.lower[c]) ||
            !std::isfinite(surface.upper[c]))
            return fmt::format("local bounds: lower > upper in cell {}, or not finite", c);
    const std::vector<Array<std::uint8_t>>& inside = data.sides.inside;
    if (inside.size() != data.octree.levels.size()) return "sides of cells: not of every level";
    for (std::size_t k = 0; k < inside.size(); ++k)
        if (inside[k].size() != data.octree.levels[k].parent.size())
            return fmt::format("level {}: not one byte of sides a group", k);
    if (!data.sides.winding.empty() && data.sides.winding.size() != cells)
        return "winding numbers: not one per surface cell";
    return {};
}

Complaint check_numbers(const View& view) {
    const shell::ShellData& data = view.data();
    const Lattice& lattice = view.lattice();
    const ShellInfo& info = data.info;
    // One product of doubles: a relative error of 2⁻⁵³; allow it twice.
    const auto differ = [](double a, double b) { return !(std::abs(a - b) <= 0x1p-52 * std::abs(b)); };
    const double w = lattice.width;
    if (!(data.epsilon_inner <= 0) || !(data.epsilon_outer >= 0)) return "ε₁ ≤ 0 ≤ ε₂ does not hold";
    if (!std::isfinite(data.epsilon_inner) || !std::isfinite(data.epsilon_outer)) return "ε is not finite";
    if (differ(info.epsilon_inner, data.epsilon_inner * w) ||
        differ(info.epsilon_outer, data.epsilon_outer * w))
        return "info: ε differs from the arrays'";
    if (!(info.weld >= 0) || !std::isfinite(info.weld)) return "info: the welding length is not a length";
    if (info.adaptive != view.adaptive()) return "info: cells of several sizes, or of one";
    if (!(info.thickness_asked >= 0) || !std::isfinite(info.thickness_asked) ||
        (info.thickness_asked > 0 && !info.adaptive))
        return "info: the thickness asked for is not one";
    if (info.deepest < -1) return "info: no limit of the depth is below −1";
    if (info.coarse_cells > info.surface_cells) return "info: more cells are too coarse than there are";
    if ((info.coarse_cells > 0) !=
        (info.thickness_asked > 0 && info.epsilon_outer - info.epsilon_inner > info.thickness_asked))
        return "info: cells are too coarse, or none, and the thickness is not";
    if (info.coarse_cells == 0 && (info.coarse.min != Vec3{} || info.coarse.max != Vec3{}))
        return "info: bounds of no cells that are too coarse";
    if (!(info.rounding >= 0) || !std::isfinite(info.rounding)) return "info: γ is not a length";
    if (info.depth != lattice.depth - lattice.room || info.cell_width != w)
        return "info: depth or cell width differ";
    if (info.surface_cells != view.surface_cells()) return "info: number of surface cells differs";
    if (info.scale != lattice.scale()) return "info: scale differs";
    std::uint64_t cells = 1;
    for (const octree::Level& level : data.octree.levels) cells += 8 * level.parent.size();
    if (info.cells != cells) return "info: number of cells differs";
    const std::int64_t n = lattice.cells();
    if (info.root.min != lattice.position({0, 0, 0}) || info.root.max != lattice.position({n, n, n}))
        return "info: root differs from the lattice's";
    return {};
}

struct PointTally {
    std::uint64_t compared = 0, differ = 0, not_finite = 0;
};

/// Compares the points that group g shares with its neighbours of lower code. Every two groups that share a
/// point are one step apart on each axis, so this meets all pairs once.
/// \return the points that no such neighbour has: bit i for point i
std::uint32_t compare_shared(const View& view, int k, std::uint64_t g, PointTally& tally) {
    std::uint32_t own = (std::uint32_t{1} << points_of_group) - 1;
    const Array<double>& values = view.data().field.values[k];
    const Array<std::uint64_t>& parent = view.data().octree.levels[k].parent;
    for (int i = 0; i < points_of_group; ++i)
        tally.not_finite += !std::isfinite(values[points_of_group * g + i]);
    const std::int64_t size = std::int64_t{1} << (view.data().octree.depth - k);
    const Cell me = separate(parent[g]);
    for (int n = 0; n < 27; ++n) {
        const int step[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
        Cell other;
        bool inside = n != 13;
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t c = std::int64_t(me[axis]) + step[axis];
            inside = inside && c >= 0 && c < size;
            other[axis] = std::uint32_t(c);
        }
        if (!inside || interleave(other) > parent[g]) continue;
        const std::uint64_t h = view.group(k, other);
        if (h == no_group) continue;
        for (int i = 0; i < points_of_group; ++i) {
            const int p[3] = {i % 3 - 2 * step[0], i / 3 % 3 - 2 * step[1], i / 9 - 2 * step[2]};
            if (std::min({p[0], p[1], p[2]}) < 0 || std::max({p[0], p[1], p[2]}) > 2) continue;
            ++tally.compared;
            own &= ~(std::uint32_t{1} << i);
            tally.differ +=
                std::bit_cast<std::uint64_t>(values[points_of_group * g + i]) !=
                std::bit_cast<std::uint64_t>(values[points_of_group * h + p[0] + 3 * p[1] + 9 * p[2]]);
        }
    }
    return own;
}

PointTally check_points(const View& view, const Progress& progress, Arrays& out) {
    const octree::Octree& octree = view.data().octree;
    std::uint64_t total = 0;
    for (const octree::Level& level : octree.levels) total += level.parent.size();
    Stage stage(progress, "verify: structure", total);
    PointTally sum;
    constexpr std::uint64_t grain = 1024;
    out.own_points.resize(octree.levels.size());
    for (int k = 0; k <= octree.depth; ++k) {
        const std::uint64_t groups = octree.levels[std::size_t(k)].parent.size();
        std::vector<std::uint32_t>& own = out.own_points[std::size_t(k)];
        own.resize(groups);
        std::vector<PointTally> tallies(chunk_count(groups, grain));
        for_chunks(groups, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t g = begin; g < end; ++g) own[g] = compare_shared(view, k, g, tallies[chunk]);
            stage.advance(end - begin);
        });
        for (const PointTally& t : tallies) {
            sum.compared += t.compared;
            sum.differ += t.differ;
            sum.not_finite += t.not_finite;
        }
        for (const std::uint32_t bits : own) out.grid_points += std::uint64_t(std::popcount(bits));
    }
    return sum;
}

}  // namespace

std::optional<Arrays> check_structure(const shell::ShellData& data, const Progress& progress,
                                      VerifyReport& report) {
    VerifyCheck check;
    check.name = "structure";
    check.complete = true;
    const auto finish = [&](std::uint64_t violations, const std::string& detail) {
        check.passed = violations == 0;
        check.violations = violations;
        check.detail = detail;
        report.checks.push_back(check);
    };
    Complaint complaint = check_shape(data);
    for (int k = data.octree.depth; !complaint && k >= 0; --k) complaint = check_level(data.octree, k);
    if (complaint) return finish(1, *complaint), std::nullopt;
    Arrays arrays{View(data), {}, {}, 0};
    const View& view = arrays.view;
    complaint = check_surface(view);
    if (!complaint) complaint = decode_lists(view, arrays.lists);
    if (complaint) return finish(1, *complaint), std::nullopt;
    const PointTally points = check_points(view, progress, arrays);
    check.tested = points.compared;
    if (points.not_finite > 0)
        return finish(points.not_finite, fmt::format("{} values are not finite", points.not_finite)),
               std::nullopt;
    complaint = check_numbers(view);
    if (!complaint && points.differ > 0)
        complaint = fmt::format("{} shared grid points have different bits in two groups", points.differ);
    finish(points.differ + (complaint && points.differ == 0),
           complaint ? *complaint
                     : fmt::format("{} levels, {} surface cells, all {} shared grid points equal",
                                   data.octree.levels.size(), view.surface_cells(), points.compared));
    return arrays;
}

}  // namespace its::verifier
