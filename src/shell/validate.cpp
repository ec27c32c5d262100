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

namespace its {
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

void check_lattice(const Lattice& lattice) {
    require(lattice.depth >= 0 && lattice.depth <= max_depth, "depth {} is not in [0, {}]", lattice.depth,
            max_depth);
    const double scale = lattice.width * double(std::uint64_t{1} << lattice.depth);
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

void check_mesh(const Mesh& mesh, const Lattice& lattice) {
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

/// The sizes of the level's arrays, its codes, and `first`.
void check_level(const Octree& octree, int k) {
    const Level& level = octree.levels[std::size_t(k)];
    const std::uint64_t groups = level.groups();
    require(level.mask.size() == groups && level.first.size() == groups + 1,
            "arrays of level {} differ in size", k);
    require(groups > 0, "level {} is empty", k);
    // Parents are cells of level k+1, of which there are 2^(K−k) a side.
    const std::uint64_t codes = std::uint64_t{1} << (3 * (octree.depth - k));
    require_all(groups, fmt::format("level {}: group", k), [&](std::uint64_t i) {
        return (level.parent[i] < codes) && (i == 0 || level.parent[i - 1] < level.parent[i]);
    });
    require(level.first[0] == 0, "level {} does not begin at 0", k);
    require_all(groups, fmt::format("level {}: index of group", k), [&](std::uint64_t i) {
        return level.first[i + 1] - level.first[i] == std::uint64_t(std::popcount(level.mask[i]));
    });
}

/// Groups of level k−1 are the marked children of level k, in order.
void check_links(const Octree& octree, int k) {
    const Level& level = octree.levels[std::size_t(k)];
    const Level& finer = octree.levels[std::size_t(k) - 1];
    require(level.first.back() == finer.groups(), "level {} does not match the level below", k);
    require_all(level.groups(), fmt::format("level {}: children of group", k), [&](std::uint64_t i) {
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
    const Octree& octree = shell.octree;
    require(octree.depth == shell.lattice.depth && octree.levels.size() == std::size_t(octree.depth) + 1,
            "{} levels at depth {}", octree.levels.size(), shell.lattice.depth);
    for (int k = octree.depth; k >= 0; --k) check_level(octree, k);
    require(octree.levels.back().groups() == 1, "the root has {} groups", octree.levels.back().groups());
    for (int k = octree.depth; k > 0; --k) check_links(octree, k);
    require(octree.surface_cells() > 0, "no cell meets the mesh");
}

void check_field(const ShellData& shell) {
    const auto& levels = shell.field.values;
    require(levels.size() == shell.octree.levels.size(), "the field has {} levels", levels.size());
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const std::vector<double>& values = levels[k];
        require(values.size() == shell.octree.levels[k].groups() * group_points, "level {} has {} values", k,
                values.size());
        require_all(values.size(), fmt::format("level {}: value", k),
                    [&](std::uint64_t i) { return std::isfinite(values[i]); });
    }
}

void check_surface(const ShellData& shell) {
    const SurfaceCells& surface = shell.surface;
    const std::uint64_t cells = shell.octree.surface_cells();
    require(
        surface.lower.size() == cells && surface.upper.size() == cells && surface.offset.size() == cells + 1,
        "the arrays of surface cells differ in size");
    require_all(cells, "bounds of surface cell", [&](std::uint64_t i) {
        return std::isfinite(surface.lower[i]) && std::isfinite(surface.upper[i]) &&
               (surface.lower[i] <= surface.upper[i]);
    });
    require(surface.offset[0] == 0 && surface.offset[cells] == surface.triangle.size(),
            "the triangle lists of surface cells do not fill their array");
    require_all(cells, "triangle list of surface cell",
                [&](std::uint64_t i) { return surface.offset[i] <= surface.offset[i + 1]; });
    const std::uint64_t triangles = shell.mesh.triangles.size();
    require_all(surface.triangle.size(), "triangle reference",
                [&](std::uint64_t i) { return surface.triangle[i] < triangles; });
}

void check_info(const ShellData& shell) {
    const ShellInfo& info = shell.info;
    require(std::isfinite(shell.epsilon_inner) && std::isfinite(shell.epsilon_outer) &&
                shell.epsilon_inner <= 0 && shell.epsilon_outer >= 0,
            "ε₁ ≤ 0 ≤ ε₂ does not hold");
    require(info.epsilon_inner == shell.lattice.width * shell.epsilon_inner &&
                info.epsilon_outer == shell.lattice.width * shell.epsilon_outer,
            "ε₁ and ε₂ differ between lattice and mesh units");
    require(info.depth == shell.lattice.depth && info.cell_width == shell.lattice.width &&
                info.scale == shell.lattice.scale(),
            "the description does not match the lattice");
    require(info.sign <= SignRule::even_odd && info.extrema <= Extrema::candidates &&
                info.solver <= Solver::lscg,
            "an unknown sign rule, bound or solver");
    const std::int64_t side = shell.lattice.cells();
    require(info.root.min == shell.lattice.position({0, 0, 0}) &&
                info.root.max == shell.lattice.position({side, side, side}),
            "the root cube does not match the lattice");
    require(std::isfinite(info.rounding) && info.rounding >= 0, "rounding {} is not a length", info.rounding);
    std::uint64_t cells = 1;  // the root
    for (const Level& level : shell.octree.levels) cells += 8 * level.groups();
    require(info.surface_cells == shell.octree.surface_cells() && info.cells == cells,
            "the description does not match the octree");
}

}  // namespace

void validate(const ShellData& shell) {
    check_lattice(shell.lattice);
    check_mesh(shell.mesh, shell.lattice);
    check_octree(shell);
    check_field(shell);
    check_surface(shell);
    check_info(shell);
}

}  // namespace its
