#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/platform/compiler.h"
#include "its/shell.h"
#include "octree/morton.h"
#include "octree/octree.h"
#include "shell/shell_data.h"

/// Where a point is in the octree, fast: a dense grid over the coarse levels, and the shell's own arrays below
/// it. docs/design/query.md has the layout and the alternatives that were measured.
namespace its::query {

/// One level of the shell's arrays, without the owners.
struct LevelView {
    const std::uint8_t* mask = nullptr;
    const std::uint8_t* inside = nullptr;
    const octree::Ranks::Word* ranks = nullptr;
    const double* values = nullptr;
    const std::uint8_t* leaf = nullptr;  ///< surface cells; null where `mask` says them, or there are none
    const octree::Ranks::Word* leaf_ranks = nullptr;
    std::uint64_t first_cell = 0,
                  first_group = 0;  ///< number of its first surface cell, and of its groups' lists
};

class OpenSides;

struct QueryIndex {
    static constexpr int top_bits = 6;  ///< the grid has at most 2^top_bits cells a side
    // An entry of the grid, for a lattice cell of level `level`:
    static constexpr std::uint32_t subdivided = 1u << 31;  ///< the other bits: its group in level − 1
    static constexpr std::uint32_t inside = 1u << 30;      ///< else: in a leaf, which is on this side,
    /// and bit o: a grid point of level − 1 is on octant o, so that f is not trilinear there.
    static constexpr std::uint32_t octants = 0xff;
    /// Else: in a surface cell that is no smaller; all octants are marked.
    static constexpr std::uint32_t surface = 1u << 29;

    explicit QueryIndex(const shell::ShellData& shell);
    ~QueryIndex();
    QueryIndex(const QueryIndex&) = delete;
    QueryIndex& operator=(const QueryIndex&) = delete;

    std::uint64_t top_index(const octree::Cell& cell) const {
        const auto n = std::uint64_t{side};
        return (std::uint64_t{cell[2] >> level} * n + (cell[1] >> level)) * n + (cell[0] >> level);
    }

    const shell::ShellData& shell;
    Vec3 origin;       ///< of the lattice, mesh units
    double width = 1;  ///< of a finest cell, mesh units
    double cells = 2;  ///< finest cells per side of the root
    bool adaptive = false;
    int level = 1;                   ///< t ≥ 1
    std::uint32_t side;              ///< n = 2^(K+1−t): cells of level t per side of the root
    std::vector<std::uint32_t> top;  ///< n³ entries, x fastest, and one that is outside, for points of no cell
    std::vector<double> values;      ///< F_t at the (n+1)³ lattice points of level t
    std::array<LevelView, max_adaptive_depth + 1> levels;

    /// Under SignRule::generalized; the sides of leaves that the levels refer to then, right in steady cubes.
    std::unique_ptr<OpenSides> open;
    std::vector<std::vector<std::uint8_t>> open_inside;

    std::uint64_t memory_bytes() const;

    /// As Lattice::to_lattice, the same bits.
    Vec3 to_lattice(const Vec3& p) const {
        return {(p.x - origin.x) / width, (p.y - origin.y) / width, (p.z - origin.z) / width};
    }
    /// False for NaN. M keeps 3/8·s away from the root's boundary: outside is outside.
    bool in_root(const Vec3& u) const {
        return (u.x >= 0) & (u.x < cells) & (u.y >= 0) & (u.y < cells) & (u.z >= 0) & (u.z < cells);
    }
};

/// Of a point in the root cube, its upper boundary excluded.
ITS_INLINE octree::Cell finest_cell(const Vec3& u) {
    const auto floor = [](double v) { return std::uint32_t(std::int32_t(v)); };
    return {floor(u.x), floor(u.y), floor(u.z)};
}

/// Of a point in the closed root cube.
inline octree::Cell clamped_cell(const QueryIndex& index, const Vec3& u) {
    octree::Cell cell = finest_cell(u);
    const std::uint32_t last = (index.side << index.level) - 1;
    for (std::uint32_t& i : cell) i = i < last ? i : last;
    return cell;
}

/// Exact: u and its floor.
ITS_INLINE Vec3 local_in(const Vec3& u, const octree::Cell& cell) {
    return {u.x - double(std::int32_t(cell[0])), u.y - double(std::int32_t(cell[1])),
            u.z - double(std::int32_t(cell[2]))};
}

/// Number of the child, among its siblings, that holds a finest cell on this level.
ITS_INLINE unsigned child_at(const octree::Cell& finest, int level) {
    return (finest[0] >> level & 1) | (finest[1] >> level & 1) << 1 | (finest[2] >> level & 1) << 2;
}

/// A stored cell: child of a group of a level.
struct Place {
    std::uint64_t group;
    unsigned child;
    int level;
    bool marked;  ///< a surface cell; else a leaf without M
};

/// A point in a surface cell.
struct SurfacePoint {
    std::uint64_t group;
    unsigned child;
    int level;
    octree::Cell corner;  ///< the cell's lowest, a lattice point
    Vec3 local;           ///< in the cell, [0, 1)
};

/// Set bits. Written out, since the baseline instruction set would take a call; compilers know this form and
/// replace it where there is an instruction.
ITS_INLINE std::uint64_t bit_count(std::uint64_t v) {
    v -= v >> 1 & 0x5555555555555555;
    v = (v & 0x3333333333333333) + (v >> 2 & 0x3333333333333333);
    v = (v + (v >> 4)) & 0x0f0f0f0f0f0f0f0f;
    return v * 0x0101010101010101 >> 56;
}

/// Number of mask bits before the child: its group in the level below, or its number as a surface cell.
ITS_INLINE std::uint64_t rank(const LevelView& level, std::uint64_t group, unsigned child) {
    const octree::Ranks::Word& word = level.ranks[group / 8];
    return word.before + bit_count(word.masks & ((std::uint64_t{1} << (8 * (group % 8) + child)) - 1));
}

/// Whether a child that is not subdivided is a surface cell, above level 0.
ITS_INLINE bool is_surface(const LevelView& level, std::uint64_t group, unsigned child) {
    return level.leaf != nullptr && (level.leaf[group] >> child & 1) != 0;
}

/// From a group of level − 1 down to the leaf that holds a finest cell.
ITS_INLINE Place descend(const LevelView* levels, std::uint64_t group, int level, const octree::Cell& finest) {
    Place at{group, child_at(finest, level), level, false};
    while (levels[at.level].mask[at.group] >> at.child & 1) {
        if (at.level == 0) {
            at.marked = true;
            return at;
        }
        at.group = rank(levels[at.level], at.group, at.child);
        at.child = child_at(finest, --at.level);
    }
    at.marked = is_surface(levels[at.level], at.group, at.child);
    return at;
}

/// Number of a surface cell.
ITS_INLINE std::uint64_t surface_number(const LevelView* levels, std::uint64_t group, unsigned child,
                                        int level) {
    const LevelView& view = levels[level];
    if (view.leaf == nullptr) return rank(view, group, child);
    const octree::Ranks::Word& word = view.leaf_ranks[group / 8];
    return view.first_cell + word.before +
           bit_count(word.masks & ((std::uint64_t{1} << (8 * (group % 8) + child)) - 1));
}

/// The triangles of a surface cell.
inline shell::TriangleList triangles_of(const QueryIndex& index, std::uint64_t group, unsigned child,
                                        int level) {
    const LevelView& view = index.levels[std::size_t(level)];
    const unsigned mask = view.leaf == nullptr ? view.mask[group] : view.leaf[group];
    return index.shell.triangles(mask, view.first_group + group, int(child));
}

ITS_INLINE bool inside_bit(const LevelView* levels, const Place& at) {
    return levels[at.level].inside[at.group] >> at.child & 1;
}

/// The eight corner values of a child, of the 27 of its group.
ITS_INLINE void corner_values(const double* group, unsigned child, double (&value)[8]) {
    const double* const lowest = group + (child & 1) + 3 * (child >> 1 & 1) + 9 * (child >> 2);
    constexpr int offset[8] = {0, 1, 3, 4, 9, 10, 12, 13};
    for (int c = 0; c < 8; ++c) value[c] = lowest[offset[c]];
}

ITS_INLINE void corner_values(const LevelView& level, std::uint64_t group, unsigned child, double (&value)[8]) {
    corner_values(level.values + octree::group_points * group, child, value);
}

/// A lattice cell of some level on which f is trilinear.
struct Patch {
    octree::Cell cell;  ///< within its level
    int level;
    double value[8];
};

/// The patch that holds a finest cell.
Patch find_patch(const QueryIndex& index, const octree::Cell& finest);

}  // namespace its::query
