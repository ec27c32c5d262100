#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/array.h"
#include "octree/morton.h"
#include "octree/ranks.h"

/// The sparse octree as Morton-sorted arrays of sibling groups.
namespace its::octree {

inline constexpr std::uint64_t no_group = ~std::uint64_t{0};

/// The 27 grid points of a sibling group: index x + 3y + 9z, each of x, y, z in {0, 1, 2}.
inline constexpr int group_points = 27;

/// Index, among the group's 27 points, of corner `corner` of child `child` (both x + 2y + 4z).
inline constexpr int group_point(int child, int corner) {
    const int x = (child & 1) + (corner & 1);
    const int y = (child >> 1 & 1) + (corner >> 1 & 1);
    const int z = (child >> 2) + (corner >> 2);
    return x + 3 * y + 9 * z;
}

/// All cells of one level k. They come in groups of eight siblings; a group is named by its parent cell.
struct Level {
    Array<std::uint64_t> parent;  ///< Morton code of the parent (a cell of level k+1), ascending
    Array<std::uint8_t> mask;     ///< bit c: child c is subdivided (k > 0) or meets M (k = 0)
    Ranks first;  ///< first[g]: number of mask bits before group g, over the level: the index of
                  ///< the group in level k−1, or of the surface cell, that belongs to the
                  ///< lowest set bit; first[groups()] is the total

    /// Above level 0, of an octree with surface cells there: bit c: child c is not subdivided and meets M. Else
    /// empty: surface cells are of level 0, and `mask` tells them.
    Array<std::uint8_t> leaf;
    Ranks first_leaf;  ///< as `first`, of `leaf`

    Level() = default;
    Level(Array<std::uint64_t> parents, Array<std::uint8_t> masks, Array<std::uint8_t> leaves = {})
        : parent(std::move(parents)),
          mask(std::move(masks)),
          first(mask),
          leaf(std::move(leaves)),
          first_leaf(leaf) {}
    std::uint64_t groups() const { return parent.size(); }
};

/// A cell as it is stored.
struct CellPlace {
    std::uint64_t group;
    int child;
    int level = 0;
};

/// Levels 0 (finest) to depth; the root cube is the parent of the one group of level depth.
struct Octree {
    int depth = 0;
    std::vector<Level> levels;

    /// Group of the level whose parent has this code, or no_group: O(log groups).
    std::uint64_t find(int level, std::uint64_t parent) const;

    /// Whether surface cells, the leaves that meet M, may be of any level.
    bool adaptive() const { return levels.size() > 1 && levels[1].leaf.size() == levels[1].groups(); }

    /// Bit c: child c of a group is a surface cell.
    unsigned surface_mask(int level, std::uint64_t group) const {
        if (level == 0) return levels[0].mask[group];
        return levels[std::size_t(level)].leaf.empty() ? 0u : levels[std::size_t(level)].leaf[group];
    }
    /// Bit c: child c of a group is subdivided.
    unsigned subdivided_mask(int level, std::uint64_t group) const {
        return level == 0 ? 0u : levels[std::size_t(level)].mask[group];
    }

    /// Surface cells are numbered from level 0 on, in the order of groups and children. The number of the first
    /// one in a group.
    std::uint64_t first_surface_cell(int level, std::uint64_t group) const {
        return surface_cells_below(level) + surface_ranks(level)[group];
    }
    /// In levels below this one: O(levels).
    std::uint64_t surface_cells_below(int level) const {
        std::uint64_t cells = 0;
        for (int k = 0; k < level; ++k) cells += surface_ranks(k).back();
        return cells;
    }
    std::uint64_t surface_cells() const { return surface_cells_below(int(levels.size())); }

    /// Groups that may have surface cells are numbered likewise, those of level 0 alone if no other has any.
    std::uint64_t surface_groups_below(int level) const {
        std::uint64_t groups = 0;
        for (int k = 0; k < level; ++k)
            if (k == 0 || adaptive()) groups += levels[std::size_t(k)].groups();
        return groups;
    }
    std::uint64_t surface_groups() const { return surface_groups_below(int(levels.size())); }

    /// Where surface cell number `cell` is: O(log groups).
    CellPlace surface_place(std::uint64_t cell) const;

private:
    const Ranks& surface_ranks(int level) const {
        return level == 0 ? levels[0].first : levels[std::size_t(level)].first_leaf;
    }
};

/// The octree whose finest marked cells are `surface` (Morton codes, strictly ascending, not empty): their
/// siblings, their parents with siblings, and so on up to the root.
Octree make_octree(int depth, std::span<const std::uint64_t> surface);

/// Grid points of all levels: corners of cells, each once a level.
std::uint64_t count_grid_points(const Octree& octree);

}  // namespace its::octree
