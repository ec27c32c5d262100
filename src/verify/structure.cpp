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
    if (octree.depth < 0 || octree.depth > max_depth)
        return fmt::format("depth {} is out of range", octree.depth);
    if (data.lattice.depth != octree.depth) return "lattice and octree differ in depth";
    if (!(data.lattice.width > 0) || !std::isfinite(data.lattice.width)) return "cell width is not positive";
    if (octree.levels.size() != std::size_t(octree.depth) + 1) return "number of levels is not depth + 1";
    if (data.field.values.size() != octree.levels.size()) return "field and octree differ in levels";
    for (std::size_t k = 0; k < octree.levels.size(); ++k) {
        const octree::Level& level = octree.levels[k];
        if (level.mask.size() != level.parent.size() || level.first.size() != level.parent.size() + 1)
            return fmt::format("level {}: arrays differ in size", k);
        if (data.field.values[k].size() != octree::group_points * level.parent.size())
            return fmt::format("level {}: not 27 values per group", k);
    }
    const octree::Level& top = octree.levels.back();
    if (top.parent.size() != 1 || top.parent[0] != 0) return "the top level is not the root's eight children";
    return {};
}

/// Order of the groups, prefix counts, and one group below each mask bit.
Complaint check_level(const octree::Octree& octree, int k) {
    const octree::Level& level = octree.levels[k];
    const std::uint64_t codes = std::uint64_t{1} << 3 * (octree.depth - k);
    std::uint64_t count = 0;
    const octree::Level* below = k > 0 ? &octree.levels[k - 1] : nullptr;
    for (std::uint64_t g = 0; g < level.groups(); ++g) {
        if (level.parent[g] >= codes) return fmt::format("level {}: group {} lies outside the root", k, g);
        if (g > 0 && level.parent[g] <= level.parent[g - 1])
            return fmt::format("level {}: group {} is not in ascending order", k, g);
        if (level.first[g] != count)
            return fmt::format("level {}: first[{}] is not the count of mask bits", k, g);
        for (unsigned bits = level.mask[g]; bits != 0; bits &= bits - 1, ++count) {
            if (!below) continue;
            const std::uint64_t code = level.parent[g] << 3 | unsigned(std::countr_zero(bits));
            if (count >= below->groups() || below->parent[count] != code)
                return fmt::format("level {}: child {} of group {} has no group below", k,
                                   std::countr_zero(bits), g);
        }
    }
    if (level.first[level.groups()] != count)
        return fmt::format("level {}: the total of mask bits is wrong", k);
    if (below && below->groups() != count) return fmt::format("level {}: has groups without parent", k - 1);
    return {};
}

Complaint check_surface(const shell::ShellData& data) {
    const shell::SurfaceCells& surface = data.surface;
    const std::uint64_t cells = data.octree.levels[0].first.back();
    if (surface.lower.size() != cells || surface.upper.size() != cells)
        return "local bounds: not one per surface cell";
    for (std::uint64_t c = 0; c < cells; ++c)
        if (!(surface.lower[c] <= surface.upper[c]))
            return fmt::format("local bounds: lower > upper in cell {}", c);
    const octree::Level& level = data.octree.levels[0];
    const shell::TriangleLists& lists = surface.lists;
    if (lists.offset.size() != level.groups() + 1 || lists.offset[0] != 0 ||
        lists.offset.back() != lists.bytes.size())
        return "triangle lists: offsets do not span the bytes";
    for (std::uint64_t g = 0; g < level.groups(); ++g)
        if (!shell::well_formed(lists, g, std::popcount(level.mask[g]), data.mesh.triangles.size()))
            return fmt::format("triangle lists: those of group {} are damaged", g);
    return {};
}

Complaint check_numbers(const shell::ShellData& data) {
    const ShellInfo& info = data.info;
    // One product of doubles: a relative error of 2⁻⁵³; allow it twice.
    const auto differ = [](double a, double b) { return !(std::abs(a - b) <= 0x1p-52 * std::abs(b)); };
    const double w = data.lattice.width;
    if (!(data.epsilon_inner <= 0) || !(data.epsilon_outer >= 0)) return "ε₁ ≤ 0 ≤ ε₂ does not hold";
    if (!std::isfinite(data.epsilon_inner) || !std::isfinite(data.epsilon_outer)) return "ε is not finite";
    if (differ(info.epsilon_inner, data.epsilon_inner * w) ||
        differ(info.epsilon_outer, data.epsilon_outer * w))
        return "info: ε differs from the arrays'";
    if (!(info.rounding >= 0) || !std::isfinite(info.rounding)) return "info: γ is not a length";
    if (info.depth != data.octree.depth || info.cell_width != w) return "info: depth or cell width differ";
    if (info.surface_cells != data.octree.levels[0].first.back())
        return "info: number of surface cells differs";
    if (info.scale != data.lattice.scale()) return "info: scale differs";
    const std::int64_t n = data.lattice.cells();
    if (info.root.min != data.lattice.position({0, 0, 0}) || info.root.max != data.lattice.position({n, n, n}))
        return "info: root differs from the lattice's";
    return {};
}

struct PointTally {
    std::uint64_t compared = 0, differ = 0, not_finite = 0;
};

/// Compares the points that group g shares with its neighbours of higher Morton code. Every two groups
/// that share a point are one step apart on each axis, so this meets all pairs once.
void compare_shared(const View& view, int k, std::uint64_t g, PointTally& tally) {
    const Array<double>& values = view.data().field.values[k];
    const Array<std::uint64_t>& parent = view.data().octree.levels[k].parent;
    for (int i = 0; i < octree::group_points; ++i)
        tally.not_finite += !std::isfinite(values[octree::group_points * g + i]);
    const std::int64_t size = std::int64_t{1} << (view.data().octree.depth - k);
    const octree::Cell me = octree::morton_decode(parent[g]);
    for (int n = 0; n < 27; ++n) {
        const int step[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
        octree::Cell other;
        bool inside = n != 13;
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t c = std::int64_t(me[axis]) + step[axis];
            inside = inside && c >= 0 && c < size;
            other[axis] = std::uint32_t(c);
        }
        if (!inside || octree::morton_encode(other) < parent[g]) continue;
        const std::uint64_t h = view.group(k, other);
        if (h == octree::no_group) continue;
        for (int i = 0; i < octree::group_points; ++i) {
            const int p[3] = {i % 3 - 2 * step[0], i / 3 % 3 - 2 * step[1], i / 9 - 2 * step[2]};
            if (std::min({p[0], p[1], p[2]}) < 0 || std::max({p[0], p[1], p[2]}) > 2) continue;
            ++tally.compared;
            tally.differ +=
                std::bit_cast<std::uint64_t>(values[octree::group_points * g + i]) !=
                std::bit_cast<std::uint64_t>(values[octree::group_points * h + p[0] + 3 * p[1] + 9 * p[2]]);
        }
    }
}

PointTally check_points(const shell::ShellData& data, const VerifyOptions& options) {
    const View view(data);
    std::uint64_t total = 0;
    for (const octree::Level& level : data.octree.levels) total += level.groups();
    Stage stage(options.progress, "verify: structure", total);
    PointTally sum;
    constexpr std::uint64_t grain = 1024;
    for (int k = 0; k <= data.octree.depth; ++k) {
        const std::uint64_t groups = data.octree.levels[k].groups();
        std::vector<PointTally> tallies(chunk_count(groups, grain));
        for_chunks(groups, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t g = begin; g < end; ++g) compare_shared(view, k, g, tallies[chunk]);
            stage.advance(end - begin);
        });
        for (const PointTally& t : tallies) {
            sum.compared += t.compared;
            sum.differ += t.differ;
            sum.not_finite += t.not_finite;
        }
    }
    return sum;
}

}  // namespace

bool check_structure(const shell::ShellData& data, const VerifyOptions& options, VerifyReport& report) {
    VerifyCheck check;
    check.name = "structure";
    const auto finish = [&](bool passed, std::uint64_t violations, const std::string& detail) {
        check.passed = passed;
        check.violations = violations;
        check.detail = detail;
        report.checks.push_back(check);
    };
    Complaint complaint = check_shape(data);
    for (int k = data.octree.depth; !complaint && k >= 0; --k) complaint = check_level(data.octree, k);
    if (!complaint) complaint = check_surface(data);
    if (complaint) {
        finish(false, 1, *complaint);
        return false;
    }
    const PointTally points = check_points(data, options);
    check.tested = points.compared;
    if (points.not_finite > 0) {
        finish(false, points.not_finite, fmt::format("{} values are not finite", points.not_finite));
        return false;
    }
    complaint = check_numbers(data);
    const std::uint64_t violations = points.differ + (complaint ? 1 : 0);
    if (!complaint && points.differ > 0)
        complaint = fmt::format("{} shared grid points have different bits in two groups", points.differ);
    finish(violations == 0, violations,
           complaint
               ? *complaint
               : fmt::format("{} levels, {} surface cells, {} shared grid points equal",
                             data.octree.levels.size(), data.octree.levels[0].first.back(), points.compared));
    return true;
}

}  // namespace its::verifier
