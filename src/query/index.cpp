#include "query/index.h"

#include <algorithm>

namespace its {

namespace {

/// Values at the points of a lattice of n cells a side.
struct Grid {
    std::uint32_t n;
    std::vector<double> value;

    explicit Grid(std::uint32_t cells) : n(cells), value(std::size_t{cells + 1} * (cells + 1) * (cells + 1)) {}
    double& at(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
        return value[(std::size_t{z} * (n + 1) + y) * (n + 1) + x];
    }
};

/// The trilinear interpolation on a lattice twice as fine.
Grid upsampled(Grid& coarse) {
    Grid fine(2 * coarse.n);
    for (std::uint32_t z = 0; z <= fine.n; ++z)
        for (std::uint32_t y = 0; y <= fine.n; ++y)
            for (std::uint32_t x = 0; x <= fine.n; ++x) {
                double sum = 0;
                for (unsigned c = 0; c < 8; ++c)
                    sum += coarse.at((x + (c & 1)) / 2, (y + (c >> 1 & 1)) / 2, (z + (c >> 2)) / 2);
                fine.at(x, y, z) = 0.125 * sum;
            }
    return fine;
}

/// F_k at its grid points of level k; elsewhere the grid keeps F_{k+1}.
void put_level(Grid& grid, const Level& level, const double* values) {
    for (std::uint64_t group = 0; group < level.groups(); ++group) {
        const Cell parent = morton_decode(level.parent[group]);
        for (std::uint32_t p = 0; p < group_points; ++p)
            grid.at(2 * parent[0] + p % 3, 2 * parent[1] + p / 3 % 3, 2 * parent[2] + p / 9) =
                values[group_points * group + p];
    }
}

/// F_t at all lattice points of level t.
std::vector<double> coarse_values(const QueryIndex& index) {
    const Octree& octree = index.shell.octree;
    if (index.level > octree.depth) return std::vector<double>(8);  // the root cube is subdivided: never read
    Grid grid(2);
    for (int k = octree.depth;; --k) {
        put_level(grid, octree.levels[std::size_t(k)], index.levels[std::size_t(k)].values);
        if (k == index.level) return std::move(grid.value);
        grid = upsampled(grid);
    }
}

void fill_cube(QueryIndex& index, const Cell& at, std::uint32_t size, std::uint32_t entry) {
    for (std::uint32_t z = 0; z < size; ++z)
        for (std::uint32_t y = 0; y < size; ++y) {
            const std::uint64_t row = (std::uint64_t{at[2] + z} * index.side + at[1] + y) * index.side + at[0];
            std::fill_n(index.top.begin() + std::ptrdiff_t(row), size, entry);
        }
}

/// Says which octants of the leaf entries around a subdivided one its grid points touch.
void mark_neighbours(QueryIndex& index, const Cell& at) {
    for (int direction = 0; direction < 27; ++direction) {
        const std::array<int, 3> d = {direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
        std::uint64_t place = 0;
        bool usable = true;
        unsigned touched = QueryIndex::octants;
        for (int axis = 2; axis >= 0; --axis) {
            constexpr std::array<unsigned, 3> upper = {0xaa, 0xcc, 0xf0};  // octants on the axis' upper side
            const std::int64_t i = std::int64_t{at[axis]} + d[axis];
            usable &= i >= 0 && i < index.side;
            place = place * index.side + std::uint64_t(i);
            if (d[axis] < 0) touched &= upper[axis];
            if (d[axis] > 0) touched &= ~upper[axis];
        }
        if (usable && !(index.top[place] & QueryIndex::subdivided)) index.top[place] |= touched;
    }
}

std::vector<std::uint32_t> make_top(QueryIndex& index) {
    const Octree& octree = index.shell.octree;
    index.top.assign(std::size_t{index.side} * index.side * index.side + 1, 0);
    for (int k = octree.depth; k >= index.level; --k) {
        const Level& level = octree.levels[std::size_t(k)];
        const int scale = k - index.level;
        for (std::uint64_t group = 0; group < level.groups(); ++group) {
            const Cell parent = morton_decode(level.parent[group]);
            for (unsigned c = 0; c < 8; ++c) {
                const bool in = index.levels[std::size_t(k)].inside[group] >> c & 1;
                if (level.mask[group] >> c & 1 || !in) continue;
                const Cell at = {(2 * parent[0] + (c & 1)) << scale, (2 * parent[1] + (c >> 1 & 1)) << scale,
                                 (2 * parent[2] + (c >> 2)) << scale};
                fill_cube(index, at, 1u << scale, QueryIndex::inside);
            }
        }
    }
    const Level& below = octree.levels[std::size_t(index.level) - 1];
    for (std::uint64_t group = 0; group < below.groups(); ++group)
        fill_cube(index, morton_decode(below.parent[group]), 1, QueryIndex::subdivided | std::uint32_t(group));
    for (std::uint64_t group = 0; group < below.groups(); ++group)
        mark_neighbours(index, morton_decode(below.parent[group]));
    return std::move(index.top);
}

/// The group of level − 1 in a cell of `level` ≤ t, or no_group if it is not subdivided or does not exist.
std::uint64_t group_in(const QueryIndex& index, const std::array<std::int64_t, 3>& cell, int level) {
    const std::int64_t side = std::int64_t{index.side} << (index.level - level);
    Cell finest;
    for (int axis = 0; axis < 3; ++axis) {
        if (cell[axis] < 0 || cell[axis] >= side) return no_group;
        finest[axis] = std::uint32_t(cell[axis]) << level;
    }
    const std::uint32_t entry = index.top[index.top_index(finest)];
    if (!(entry & QueryIndex::subdivided)) return no_group;
    std::uint64_t group = entry & ~QueryIndex::subdivided;
    for (int k = index.level - 1; k >= level; --k) {
        const unsigned child = child_at(finest, k);
        if (!(index.levels[std::size_t(k)].mask[group] >> child & 1)) return no_group;
        group = rank(index.levels[std::size_t(k)], group, child);
    }
    return group;
}

/// The patch's octant that holds `finest`, if a grid point of the next finer level is on it. A corner c of
/// octant o lies on the patch's boundary along the axes where c and o agree, and is a grid point if a neighbour
/// in some of these directions is subdivided; there are no grid points elsewhere, since the patch is not.
bool refine_once(const QueryIndex& index, const Cell& finest, Patch& patch) {
    const unsigned octant = child_at(finest, patch.level - 1);
    std::array<std::uint64_t, 8> group;  // by the set of axes of the direction
    group[0] = no_group;
    bool any = false;
    for (unsigned axes = 1; axes < 8; ++axes) {
        std::array<std::int64_t, 3> cell;
        for (int axis = 0; axis < 3; ++axis)
            cell[axis] =
                std::int64_t{patch.cell[axis]} + (axes >> axis & 1 ? (octant >> axis & 1 ? 1 : -1) : 0);
        group[axes] = group_in(index, cell, patch.level);
        any |= group[axes] != no_group;
    }
    if (!any) return false;

    const double* const finer = index.levels[std::size_t(patch.level) - 1].values;
    double refined[8];
    for (unsigned c = 0; c < 8; ++c) {
        const unsigned outer = ~(c ^ octant) & 7;
        unsigned axes = 0;
        for (unsigned a = 1; a < 8 && axes == 0; ++a)
            if ((a & ~outer) == 0 && group[a] != no_group) axes = a;
        if (axes != 0) {  // seen from the neighbour, its other side
            std::uint64_t point = 0;
            for (int axis = 2; axis >= 0; --axis) {
                const unsigned half = (octant >> axis & 1) + (c >> axis & 1);
                point = 3 * point + (axes >> axis & 1 ? 2 - half : half);
            }
            refined[c] = finer[group_points * group[axes] + point];
        } else {
            double sum = 0;  // trilinear at halves: of each axis the two ends, or twice the same
            for (unsigned e = 0; e < 8; ++e) sum += patch.value[(e & (octant ^ c)) | (octant & c)];
            refined[c] = 0.125 * sum;
        }
    }
    std::copy_n(refined, 8, patch.value);
    --patch.level;
    for (int axis = 0; axis < 3; ++axis) patch.cell[axis] = finest[axis] >> patch.level;
    return true;
}

}  // namespace

QueryIndex::QueryIndex(const ShellData& data)
    : shell(data),
      origin(data.lattice.position({0, 0, 0})),
      width(data.lattice.width),
      cells(double(data.lattice.cells())),
      level(std::max(1, data.lattice.depth + 1 - top_bits)),
      side(data.lattice.cells() >> level) {
    for (std::size_t k = 0; k < data.octree.levels.size(); ++k)
        levels[k] = {data.octree.levels[k].mask.data(), data.sides.inside[k].data(),
                     data.octree.levels[k].first.data(), data.field.values[k].data()};
    top = make_top(*this);
    values = coarse_values(*this);
}

void refine(const QueryIndex& index, const Cell& finest, Patch& patch) {
    while (patch.level > 0 && refine_once(index, finest, patch)) {
    }
}

Patch find_patch(const QueryIndex& index, const Cell& finest) {
    Patch patch;
    const std::uint32_t entry = index.top[index.top_index(finest)];
    if (entry & QueryIndex::subdivided) {
        const Place at = descend(index.levels.data(), entry & ~QueryIndex::subdivided, index.level - 1, finest);
        patch.level = at.level;
        corner_values(index.levels[std::size_t(at.level)], at.group, at.child, patch.value);
    } else {
        patch.level = index.level;
        const std::uint64_t row = index.side + 1;
        const std::uint64_t lowest =
            (std::uint64_t{finest[2] >> index.level} * row + (finest[1] >> index.level)) * row +
            (finest[0] >> index.level);
        for (unsigned c = 0; c < 8; ++c)
            patch.value[c] = index.values[lowest + (c & 1) + (c >> 1 & 1) * row + (c >> 2) * row * row];
    }
    for (int axis = 0; axis < 3; ++axis) patch.cell[axis] = finest[axis] >> patch.level;
    const bool touched =
        entry & QueryIndex::subdivided ? patch.level > 0 : entry >> child_at(finest, index.level - 1) & 1;
    if (touched) refine(index, finest, patch);
    return patch;
}

}  // namespace its
