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

/// The values at the corners of the grid's cell that holds `finest`.
void grid_corners(const QueryIndex& index, const Cell& finest, double (&value)[8]) {
    const std::uint64_t row = index.side + 1;
    const std::uint64_t lowest =
        (std::uint64_t{finest[2] >> index.level} * row + (finest[1] >> index.level)) * row +
        (finest[0] >> index.level);
    for (unsigned c = 0; c < 8; ++c)
        value[c] = index.values[lowest + (c & 1) + (c >> 1 & 1) * row + (c >> 2) * row * row];
}

/// Groups and halos as one tree: where a point is on its way down. Below the grid `values` are the 27 of the
/// group or halo at `level`.
struct Walk {
    int level;
    bool in_halo;
    std::uint64_t group;  ///< or halo
};

/// The group or halo below the grid's cell with this entry; false if there is none.
bool enter(const QueryIndex& index, std::uint32_t entry, Walk& at) {
    at.level = index.level - 1;
    at.in_halo = !(entry & QueryIndex::subdivided);
    at.group = at.in_halo ? (entry & QueryIndex::halo) - 1 : entry & ~QueryIndex::subdivided;
    return !at.in_halo || (entry & QueryIndex::halo) != 0;
}

const double* values_at(const QueryIndex& index, const Walk& at) {
    const auto level = std::size_t(at.level);
    return at.in_halo ? index.halos[level][at.group].value
                      : index.levels[level].values + group_points * at.group;
}

/// One level down, into the child's group or halo; false if it has neither.
bool step(const QueryIndex& index, unsigned child, Walk& at) {
    const auto level = std::size_t(at.level);
    if (!at.in_halo && index.levels[level].mask[at.group] >> child & 1) {
        if (at.level == 0) return false;
        at.group = rank(index.levels[level], at.group, child);
    } else {
        if (at.level <= index.halo_level) return false;  // none are known below
        const std::uint32_t next =
            at.in_halo ? index.halos[level][at.group].next[child] : index.next[level][8 * at.group + child];
        if (next == 0) return false;
        at.in_halo = true;
        at.group = next - 1;
    }
    --at.level;
    return true;
}

/// F_k at the 27 points of a cell of level k + 1 from its corners: no finer hats yet.
Halo plain_halo(const double (&corner)[8]) {
    Halo halo{};
    for (unsigned p = 0; p < group_points; ++p) {
        double sum = 0;
        for (unsigned e = 0; e < 8; ++e)
            sum +=
                corner[(p % 3 + (e & 1)) / 2 + (p / 3 % 3 + (e >> 1 & 1)) / 2 * 2 + (p / 9 + (e >> 2)) / 2 * 4];
        halo.value[p] = 0.125 * sum;
    }
    return halo;
}

/// The halo of an undivided cell of level k + 1 that touches a group of level k; made if it is not there yet.
Halo& halo_in(QueryIndex& index, const Cell& cell, int k) {
    Cell finest;
    for (std::size_t axis = 0; axis < 3; ++axis) finest[axis] = cell[axis] << (k + 1);
    double corner[8];
    std::uint32_t* slot = &index.top[index.top_index(finest)];
    std::uint32_t known = *slot & QueryIndex::halo;
    if (k + 1 == index.level) {
        if (known == 0) grid_corners(index, finest, corner);
    } else {  // in a group, or in a halo: its parent touches the parent of the group that it touches
        Walk at;
        enter(index, *slot, at);
        while (at.level > k + 1) step(index, child_at(finest, at.level), at);
        const unsigned child = child_at(finest, k + 1);
        const auto level = std::size_t(k) + 1;
        slot =
            at.in_halo ? &index.halos[level][at.group].next[child] : &index.next[level][8 * at.group + child];
        known = *slot;
        if (known == 0) corner_values(values_at(index, at), child, corner);
    }
    std::vector<Halo>& halos = index.halos[std::size_t(k)];
    if (known != 0) return halos[known - 1];
    halos.push_back(plain_halo(corner));
    *slot += std::uint32_t(halos.size());
    return halos.back();
}

/// Gives a halo the values of a group at the points that they share; the group is on its side −d.
void share(const double* group, const std::array<int, 3>& d, Halo& halo) {
    const auto from = [](int side) { return side < 0 ? 2u : 0u; };
    const auto to = [](int side) { return side > 0 ? 0u : 2u; };
    for (unsigned z = from(d[2]); z <= to(d[2]); ++z)
        for (unsigned y = from(d[1]); y <= to(d[1]); ++y)
            for (unsigned x = from(d[0]); x <= to(d[0]); ++x)
                halo.value[x + 3 * y + 9 * z] =
                    group[std::size_t(int(x) + 2 * d[0]) + 3 * std::size_t(int(y) + 2 * d[1]) +
                          9 * std::size_t(int(z) + 2 * d[2])];
}

/// All halos at the groups of level k.
void make_halos(QueryIndex& index, int k) {
    const Level& level = index.shell.octree.levels[std::size_t(k)];
    if (k + 1 < index.level)
        index.next[std::size_t(k) + 1].assign(8 * index.shell.octree.levels[std::size_t(k) + 1].groups(), 0);
    for (std::uint64_t group = 0; group < level.groups(); ++group) {
        const Cell parent = morton_decode(level.parent[group]);
        for (int direction = 0; direction < 27; ++direction) {
            const std::array<int, 3> d = {direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
            std::array<std::int64_t, 3> cell;
            bool in_root = true;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                cell[axis] = std::int64_t{parent[axis]} + d[axis];
                in_root &= cell[axis] >= 0 && cell[axis] < std::int64_t{index.side} << (index.level - 1 - k);
            }
            if (!in_root || group_in(index, cell, k + 1) != no_group) continue;
            Halo& halo =
                halo_in(index, {std::uint32_t(cell[0]), std::uint32_t(cell[1]), std::uint32_t(cell[2])}, k);
            share(index.levels[std::size_t(k)].values + group_points * group, d, halo);
        }
    }
    index.halo_level = k;
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
                     data.octree.levels[k].first.words(), data.field.values[k].data()};
    top = make_top(*this);
    values = coarse_values(*this);
    halo_level = level;
    do make_halos(*this, halo_level - 1);
    while (halo_level > 0 && data.octree.levels[std::size_t(halo_level) - 1].groups() <= most_halo_groups);
}

std::uint64_t QueryIndex::memory_bytes() const {
    std::uint64_t bytes = sizeof(*this) + top.size() * sizeof(top[0]) + values.size() * sizeof(values[0]);
    for (const auto& level_halos : halos) bytes += level_halos.size() * sizeof(Halo);
    for (const auto& level_next : next) bytes += level_next.size() * sizeof(level_next[0]);
    return bytes;
}

Patch find_patch(const QueryIndex& index, const Cell& finest) {
    Patch patch;
    Walk at;
    patch.level = index.level;
    if (enter(index, index.top[index.top_index(finest)], at)) {
        while (step(index, child_at(finest, at.level), at)) {
        }
        patch.level = at.level;
        corner_values(values_at(index, at), child_at(finest, at.level), patch.value);
    } else {
        grid_corners(index, finest, patch.value);
    }
    for (std::size_t axis = 0; axis < 3; ++axis) patch.cell[axis] = finest[axis] >> patch.level;
    while (patch.level > 0 && patch.level <= index.halo_level && refine_once(index, finest, patch)) {
    }
    return patch;
}

}  // namespace its
