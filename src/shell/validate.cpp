#include "shell/validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string_view>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "its/inspect.h"

namespace its::shell {
namespace {

constexpr std::uint64_t grain = std::uint64_t{1} << 16;

template <class... Args>
void require(bool holds, fmt::format_string<Args...> text, Args&&... args) {
    if (!holds)
        throw InputError(fmt::format("damaged shell: {}", fmt::format(text, std::forward<Args>(args)...)));
}

/// Throws, with the lowest index i of `count` for which holds(i) is false, whatever the number of threads.
template <class Holds>
void require_all(std::uint64_t count, std::string_view what, Holds&& holds) {
    std::atomic<std::uint64_t> lowest = count;
    for_chunks(count, grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        // No early exit inside the chunk: the loop has no branch and vectorises.
        bool good = true;
        for (std::uint64_t i = begin; i < end; ++i) good &= holds(i);
        if (good) return;
        std::uint64_t bad = begin;
        while (holds(bad)) ++bad;
        std::uint64_t seen = lowest.load();
        while (bad < seen && !lowest.compare_exchange_weak(seen, bad)) {
        }
    });
    require(lowest == count, "{} {} is wrong", what, lowest.load());
}

/// Scales that build() accepts, with room for its rounding up; beyond them exact predicates could overflow.
constexpr double min_scale = 1e-75, max_scale = 1e76;

void check_lattice(const octree::Lattice& lattice) {
    require(lattice.depth >= 0 && lattice.depth <= max_adaptive_depth, "depth {} is not in [0, {}]",
            lattice.depth, max_adaptive_depth);
    require(lattice.room >= 0 && lattice.room <= std::min(lattice.depth, octree::least_levels),
            "a root cube {} levels above the scale", lattice.room + 1);
    const double scale = lattice.scale();
    require(scale >= min_scale && scale <= max_scale, "cell width {} is out of range", lattice.width);
    // width = odd · 2^e. Positions are (base + 4i) · width/4, which is exact if the bits of both factors add up
    // to no more than the 53 of a double.
    int exponent = 0;
    const auto significand = static_cast<std::uint64_t>(std::ldexp(std::frexp(lattice.width, &exponent), 53));
    const int width_bits = 53 - std::countr_zero(significand);
    const std::int64_t limit = std::int64_t{1} << (53 - width_bits);
    for (const std::int64_t base : lattice.base) {
        require(-limit <= base && base <= limit && base + 4 * std::int64_t{lattice.cells()} <= limit,
                "lattice positions from {} on are not exact", base);
    }
}

void check_mesh(const MeshArrays& mesh, const octree::Lattice& lattice) {
    constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();  // indices have 32 bits
    require(mesh.vertices.size() <= most && mesh.triangles.size() <= most, "the mesh has too many elements");
    require(!mesh.triangles.empty(), "the mesh has no triangles");
    require_all(mesh.vertices.size(), "vertex", [&](std::uint64_t i) {
        const Vec3& v = mesh.vertices[i];
        return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
    });
    const std::int64_t side = lattice.cells();
    const Box root{lattice.position({0, 0, 0}), lattice.position({side, side, side})};
    const auto inside = [&](const Vec3& v) {
        return (v.x >= root.min.x) & (v.x <= root.max.x) & (v.y >= root.min.y) & (v.y <= root.max.y) &
               (v.z >= root.min.z) & (v.z <= root.max.z);
    };
    const auto vertices = static_cast<std::uint32_t>(mesh.vertices.size());
    require_all(mesh.triangles.size(), "triangle", [&](std::uint64_t i) {
        const Triangle& t = mesh.triangles[i];
        return t[0] < vertices && t[1] < vertices && t[2] < vertices && inside(mesh.vertices[t[0]]) &&
               inside(mesh.vertices[t[1]]) && inside(mesh.vertices[t[2]]);
    });
}

void check_level_sizes(const octree::Octree& octree, int k) {
    const octree::Level& level = octree.levels[std::size_t(k)];
    require(level.mask.size() == level.groups() && level.first.size() == level.groups() + 1,
            "arrays of level {} differ in size", k);
    require(level.groups() > 0, "level {} is empty", k);
    const bool may_be_leaves = octree.adaptive() && k > 0;
    require(level.leaf.size() == (may_be_leaves ? level.groups() : 0),
            "level {} has surface cells of {} groups", k, level.leaf.size());
    if (!may_be_leaves) return;
    require(level.first_leaf.size() == level.groups() + 1, "arrays of level {} differ in size", k);
    require_all(level.groups(), fmt::format("level {}: surface cells of group", k),
                [&](std::uint64_t i) { return (level.leaf[i] & level.mask[i]) == 0; });
}

/// Groups of level k−1 are the marked children of level k, in order; so their codes ascend, and lie in the
/// root, if those of level k do.
void check_links(const octree::Octree& octree, int k) {
    const octree::Level& level = octree.levels[std::size_t(k)];
    const octree::Level& finer = octree.levels[std::size_t(k) - 1];
    require(level.first.back() == finer.groups(), "level {} does not match level {} in size", k - 1, k);
    require_all(level.groups(), fmt::format("level {} in level {}: children of group", k - 1, k),
                [&](std::uint64_t i) {
                    std::uint64_t group = level.first[i];
                    bool good = true;
                    for (unsigned left = level.mask[i]; left != 0; left &= left - 1) {
                        const auto child = std::uint64_t(std::countr_zero(left));
                        good &= finer.parent[group++] == (level.parent[i] << 3 | child);
                    }
                    return good;
                });
}

void check_octree(const ShellData& shell) {
    const octree::Octree& octree = shell.octree;
    require(octree.depth == shell.lattice.depth && octree.levels.size() == std::size_t(octree.depth) + 1,
            "{} levels at depth {}", octree.levels.size(), shell.lattice.depth);
    for (int k = octree.depth; k >= 0; --k) check_level_sizes(octree, k);
    require(octree.levels.back().groups() == 1 && octree.levels.back().parent[0] == 0,
            "level {} is not the root's eight children", octree.depth);
    for (int k = octree.depth; k > 0; --k) check_links(octree, k);
    require(octree.surface_cells() > 0, "no cell meets the mesh");
}

void check_sizes(const ShellData& shell) {
    const auto& levels = shell.field.values;
    require(levels.size() == shell.octree.levels.size(), "the field has {} levels", levels.size());
    for (std::size_t k = 0; k < levels.size(); ++k)
        require(levels[k].size() == shell.octree.levels[k].groups() * octree::group_points,
                "level {} has {} values", k, levels[k].size());
    const SurfaceCells& surface = shell.surface;
    const std::uint64_t cells = shell.octree.surface_cells(), groups = shell.octree.surface_groups();
    require(surface.corners_inside.size() == (shell.octree.adaptive() ? cells : 0),
            "sides of the corners of {} surface cells", surface.corners_inside.size());
    require(surface.lower.size() == cells && surface.upper.size() == cells &&
                surface.lists.offset.size() == groups + 1,
            "the arrays of surface cells differ in size");
    const signs::CellSides& sides = shell.sides;
    require(sides.inside.size() == levels.size(), "sides of {} levels", sides.inside.size());
    for (std::size_t k = 0; k < levels.size(); ++k)
        require(sides.inside[k].size() == shell.octree.levels[k].groups(), "level {} has {} groups with sides",
                k, sides.inside[k].size());
    require(sides.winding.empty() || sides.winding.size() == cells, "{} winding numbers", sides.winding.size());
}

/// Not for NaN. What is computed from such values stays finite, and searches along them end.
struct Possible {
    explicit Possible(const octree::Lattice& lattice) : most(lattice.largest_value()) {}
    bool operator()(double value) const { return std::abs(value) <= most; }
    double most;
};

void check_field(const ShellData& shell) {
    const Possible possible(shell.lattice);
    for (std::size_t k = 0; k < shell.field.values.size(); ++k) {
        const Array<double>& values = shell.field.values[k];
        require_all(values.size(), fmt::format("level {}: value", k),
                    [&](std::uint64_t i) { return possible(values[i]); });
    }
}

void check_surface(const ShellData& shell) {
    const SurfaceCells& surface = shell.surface;
    const Possible possible(shell.lattice);
    require_all(surface.lower.size(), "bounds of surface cell", [&](std::uint64_t i) {
        return possible(surface.lower[i]) && possible(surface.upper[i]) &&
               (surface.lower[i] <= surface.upper[i]);
    });
    const octree::Octree& octree = shell.octree;
    const TriangleLists& lists = surface.lists;
    require(lists.offset[0] == 0 && lists.offset.back() == lists.bytes.size(),
            "the triangle lists of surface cells do not fill their array");
    for (int k = 0; k == 0 || (k <= octree.depth && octree.adaptive()); ++k) {
        const std::uint64_t before = octree.surface_groups_below(k);
        require_all(octree.levels[std::size_t(k)].groups(), fmt::format("level {}: triangle lists of group", k),
                    [&](std::uint64_t i) {
                        return well_formed(lists, before + i, std::popcount(octree.surface_mask(k, i)),
                                           shell.mesh.triangles.size());
                    });
    }
}

/// A surface cell is inside where its winding number is at least 1, and so is its lowest corner.
void check_sides(const ShellData& shell) {
    const signs::CellSides& sides = shell.sides;
    const Array<std::uint8_t>& corners = shell.surface.corners_inside;
    if (sides.winding.empty() && corners.empty()) return;
    const octree::Octree& octree = shell.octree;
    for (int k = 0; k == 0 || (k <= octree.depth && octree.adaptive()); ++k)
        require_all(octree.levels[std::size_t(k)].groups(), fmt::format("level {}: sides of group", k),
                    [&](std::uint64_t i) {
                        std::uint64_t cell = octree.first_surface_cell(k, i);
                        bool good = true;
                        for (unsigned left = octree.surface_mask(k, i); left != 0; left &= left - 1, ++cell) {
                            const bool inside = sides.inside[std::size_t(k)][i] >> std::countr_zero(left) & 1;
                            good &= sides.winding.empty() || (sides.winding[cell] >= 1) == inside;
                            good &= corners.empty() || ((corners[cell] & 1) != 0) == inside;
                        }
                        return good;
                    });
}

void check_info(const ShellData& shell) {
    const ShellInfo& info = shell.info;
    require(shell.epsilon_inner <= 0 && shell.epsilon_outer >= 0, "ε₁ ≤ 0 ≤ ε₂ does not hold");
    const Possible possible(shell.lattice);
    require(possible(shell.epsilon_inner) && possible(shell.epsilon_outer),
            "ε₁ or ε₂ is larger than distances in the root cube");
    require(info.epsilon_inner == shell.lattice.width * shell.epsilon_inner &&
                info.epsilon_outer == shell.lattice.width * shell.epsilon_outer,
            "ε₁ and ε₂ differ between lattice and mesh units");
    require(info.depth == shell.lattice.resolution_depth() && info.cell_width == shell.lattice.width &&
                info.scale == shell.lattice.scale(),
            "the description does not match the lattice");
    require(info.sign <= SignRule::even_odd && info.extrema <= Extrema::candidates &&
                info.solver <= Solver::lscg && info.up <= UpAxis::z,
            "an unknown sign rule, bound, solver or axis");
    const std::int64_t side = shell.lattice.cells();
    require(info.root.min == shell.lattice.position({0, 0, 0}) &&
                info.root.max == shell.lattice.position({side, side, side}),
            "the root cube does not match the lattice");
    require(info.adaptive == shell.octree.adaptive(), "the description does not match the octree");
    require(std::isfinite(info.thickness_asked) && info.thickness_asked >= 0 &&
                (info.adaptive || info.thickness_asked == 0),
            "built to a thickness of {}", info.thickness_asked);
    require(info.coarse_cells <= info.surface_cells && finite(info.coarse.min) && finite(info.coarse.max),
            "{} cells are too coarse", info.coarse_cells);
    require(std::isfinite(info.weld) && info.weld >= 0, "welded with {}, which is not a length", info.weld);
    require(std::isfinite(info.rounding) && info.rounding >= 0, "rounding {} is not a length", info.rounding);
    std::uint64_t cells = 1;  // the root
    for (const octree::Level& level : shell.octree.levels) cells += 8 * level.groups();
    require(info.surface_cells == shell.octree.surface_cells() && info.cells == cells,
            "the description does not match the octree");
}

}  // namespace

void validate_structure(const ShellData& shell) {
    check_lattice(shell.lattice);
    check_mesh(shell.mesh, shell.lattice);
    check_octree(shell);
    check_sizes(shell);
    check_info(shell);
}

void validate_payload(const ShellData& shell) {
    check_field(shell);
    check_surface(shell);
    check_sides(shell);
}

void validate(const ShellData& shell) {
    validate_structure(shell);
    validate_payload(shell);
}

}  // namespace its::shell
