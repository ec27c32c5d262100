#include "query/index.h"

#include <algorithm>
#include <bit>

#include "base/parallel.h"
#include "its/inspect.h"
#include "octree/neighbours.h"
#include "query/open_sides.h"

namespace its::query {

namespace {

constexpr std::uint64_t side_grain = 4096;

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
void put_level(Grid& grid, const octree::Level& level, const double* values) {
    for (std::uint64_t group = 0; group < level.groups(); ++group) {
        const octree::Cell parent = octree::morton_decode(level.parent[group]);
        for (std::uint32_t p = 0; p < octree::group_points; ++p)
            grid.at(2 * parent[0] + p % 3, 2 * parent[1] + p / 3 % 3, 2 * parent[2] + p / 9) =
                values[octree::group_points * group + p];
    }
}

/// F_t at all lattice points of level t.
std::vector<double> coarse_values(const QueryIndex& index) {
    const octree::Octree& octree = index.shell.octree;
    if (index.level > octree.depth) return std::vector<double>(8);  // the root cube is subdivided: never read
    Grid grid(2);
    for (int k = octree.depth;; --k) {
        put_level(grid, octree.levels[std::size_t(k)], index.levels[std::size_t(k)].values);
        if (k == index.level) return std::move(grid.value);
        grid = upsampled(grid);
    }
}

void fill_cube(QueryIndex& index, const octree::Cell& at, std::uint32_t size, std::uint32_t entry) {
    for (std::uint32_t z = 0; z < size; ++z)
        for (std::uint32_t y = 0; y < size; ++y) {
            const std::uint64_t row = (std::uint64_t{at[2] + z} * index.side + at[1] + y) * index.side + at[0];
            std::fill_n(index.top.begin() + std::ptrdiff_t(row), size, entry);
        }
}

/// Says which octants of the undivided cells around a subdivided one its grid points are on.
void mark_neighbours(QueryIndex& index, const octree::Cell& at) {
    for (int direction = 0; direction < 27; ++direction) {
        const std::array<int, 3> d = {direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
        std::uint64_t place = 0;
        bool usable = true;
        unsigned touched = QueryIndex::octants;
        for (std::size_t axis = 3; axis-- > 0;) {
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
    const octree::Octree& octree = index.shell.octree;
    index.top.assign(std::size_t{index.side} * index.side * index.side + 1, 0);
    for (int k = octree.depth; k >= index.level; --k) {
        const octree::Level& level = octree.levels[std::size_t(k)];
        const int scale = k - index.level;
        for (std::uint64_t group = 0; group < level.groups(); ++group) {
            const octree::Cell parent = octree::morton_decode(level.parent[group]);
            for (unsigned c = 0; c < 8; ++c) {
                const bool in = index.levels[std::size_t(k)].inside[group] >> c & 1;
                const bool surface = is_surface(index.levels[std::size_t(k)], group, c);
                if (level.mask[group] >> c & 1 || !(in || surface)) continue;
                const octree::Cell at = {(2 * parent[0] + (c & 1)) << scale,
                                         (2 * parent[1] + (c >> 1 & 1)) << scale,
                                         (2 * parent[2] + (c >> 2)) << scale};
                fill_cube(index, at, 1u << scale,
                          surface ? QueryIndex::surface | QueryIndex::octants : QueryIndex::inside);
            }
        }
    }
    const octree::Level& below = octree.levels[std::size_t(index.level) - 1];
    for (std::uint64_t group = 0; group < below.groups(); ++group)
        fill_cube(index, octree::morton_decode(below.parent[group]), 1,
                  QueryIndex::subdivided | std::uint32_t(group));
    for (std::uint64_t group = 0; group < below.groups(); ++group)
        mark_neighbours(index, octree::morton_decode(below.parent[group]));
    return std::move(index.top);
}

/// The values at the corners of the grid's cell that holds `finest`.
ITS_INLINE void grid_corners(const QueryIndex& index, const octree::Cell& finest, double (&value)[8]) {
    const std::uint64_t row = index.side + 1;
    const std::uint64_t lowest =
        (std::uint64_t{finest[2] >> index.level} * row + (finest[1] >> index.level)) * row +
        (finest[0] >> index.level);
    for (unsigned c = 0; c < 8; ++c)
        value[c] = index.values[lowest + (c & 1) + (c >> 1 & 1) * row + (c >> 2) * row * row];
}

/// The groups in the eight cells of a level around the corner that is nearest to a point: the one that holds
/// it, and its neighbours across each set of axes, on the side of the point's octant.
struct Around {
    std::uint64_t group[8];  ///< 0 where there is none
    unsigned present = 0;    ///< bit s: group[s] is there
};

ITS_INLINE Around around_grid_cell(const QueryIndex& index, const octree::Cell& finest, unsigned octant) {
    Around around;
    for (unsigned s = 0; s < 8; ++s) {
        std::uint64_t place = 0;
        bool usable = true;
        for (std::size_t axis = 3; axis-- > 0;) {
            std::uint32_t i = finest[axis] >> index.level;
            if (s >> axis & 1) i += octant >> axis & 1 ? 1u : ~0u;
            usable &= i < index.side;
            place = place * index.side + i;
        }
        const std::uint32_t entry = usable ? index.top[place] : 0;
        around.group[s] = entry >> 31 ? entry & ~QueryIndex::subdivided : 0;
        around.present |= (entry >> 31) << s;
    }
    return around;
}

/// The same one level down, around the corner of the point's octant `next` in the octant. A neighbour across
/// axes s is in the neighbour across those of s along which `next` is on the octant's side; it is child octant
/// ^ s.
ITS_INLINE Around descend(const LevelView& level, const Around& from, unsigned octant, unsigned next) {
    Around around;
    for (unsigned s = 0; s < 8; ++s) {  // without branches: which of them are there cannot be foreseen
        const unsigned parent = s & ~(octant ^ next), child = octant ^ s;
        const std::uint64_t group = from.group[parent];
        const octree::Ranks::Word& word = level.ranks[group / 8];
        const std::uint64_t bit = std::uint64_t{1} << (8 * (group % 8) + child);
        const std::uint64_t there = word.masks >> (8 * (group % 8) + child) & from.present >> parent & 1;
        around.group[s] = (0 - there) & (word.before + bit_count(word.masks & (bit - 1)));
        around.present |= unsigned(there) << s;
    }
    return around;
}

/// Corner values of an octant, from those of the whole.
ITS_INLINE void halve(unsigned octant, double (&value)[8]) {
    for (unsigned bit = 1; bit < 8; bit <<= 1)
        for (unsigned i = 0; i < 8; ++i) {
            if (i & bit) continue;
            const double along[3] = {value[i], 0.5 * (value[i] + value[i | bit]), value[i | bit]};
            const unsigned upper = octant & bit ? 1 : 0;
            value[i] = along[upper];
            value[i | bit] = along[upper + 1];
        }
}

/// [octant][c][s]: of corner c of an octant, its number among the 27 points of the neighbour across axes s on
/// the octant's side, if it is one of them.
constexpr auto points = [] {
    std::array<std::array<std::array<std::uint8_t, 8>, 8>, 8> table{};
    for (unsigned octant = 0; octant < 8; ++octant)
        for (unsigned c = 0; c < 8; ++c)
            for (unsigned s = 0; s < 8; ++s) {
                int neighbour = octree::itself, stride = 1;
                for (unsigned axis = 0; axis < 3; ++axis, stride *= 3)
                    if (s >> axis & 1) neighbour += octant >> axis & 1 ? stride : -stride;
                const int point =
                    octree::point_of_neighbour(octree::group_point(int(octant), int(c)), neighbour);
                table[octant][c][s] = std::uint8_t(std::max(point, 0));
            }
    return table;
}();

/// Corner values of the next finer level in an octant of an undivided cell. A corner is on the cell's boundary
/// along the axes where it is on the octant's side, and a grid point if a neighbour across some of these is
/// divided; there are no grid points elsewhere.
ITS_INLINE void refine(const LevelView& finer, const Around& around, unsigned octant, double (&value)[8]) {
    halve(octant, value);
    // Bit s of [outer]: s is a set of axes of which all are in outer.
    constexpr std::array<unsigned, 8> subsets = {0, 0x02, 0x04, 0x0e, 0x10, 0x32, 0x54, 0xfe};
    for (unsigned c = 0; c < 8; ++c) {
        const unsigned known = around.present & subsets[~(c ^ octant) & 7];
        const unsigned s = unsigned(std::countr_zero(known | 0x100)) & 7;
        const double either[2] = {value[c],
                                  finer.values[octree::group_points * around.group[s] + points[octant][c][s]]};
        value[c] = either[known != 0];
    }
}

/// The sides of leaves without M, which are those of the middles of their groups: corners of theirs that never
/// hang, with a distance that is not 0, since else M would be in all cells around.
void mark_inside(QueryIndex& index) {
    constexpr std::size_t middle = 13;
    const octree::Octree& octree = index.shell.octree;
    const bool by_value = index.shell.info.solver == Solver::direct;
    for (std::size_t k = 0; k < octree.levels.size(); ++k) {
        const octree::Level& level = octree.levels[k];
        std::vector<std::uint8_t>& inside = index.open_inside.emplace_back(level.groups());
        parallel_for(level.groups(), side_grain, [&](std::uint64_t group) {
            const unsigned divided = level.mask[group] | (level.leaf.empty() ? 0u : level.leaf[group]);
            if (divided == 0xff) return;
            bool in = index.levels[k].values[octree::group_points * group + middle] < 0;
            if (!by_value) {
                const octree::Cell parent = octree::morton_decode(level.parent[group]);
                std::array<std::int64_t, 3> at;
                for (std::size_t axis = 0; axis < 3; ++axis)
                    at[axis] = (std::int64_t{2} * parent[axis] + 1) << k;
                in = index.open->winding().above_half(index.shell.lattice.position(at)) > 0;
            }
            if (in) inside[group] = std::uint8_t(~divided);
        });
        index.levels[k].inside = inside.data();
    }
}

}  // namespace

QueryIndex::~QueryIndex() = default;

QueryIndex::QueryIndex(const shell::ShellData& data)
    : shell(data),
      origin(data.lattice.position({0, 0, 0})),
      width(data.lattice.width),
      cells(double(data.lattice.cells())),
      level(std::max(1, data.lattice.depth + 1 - top_bits)),
      side(data.lattice.cells() >> level) {
    adaptive = data.octree.adaptive();
    for (std::size_t k = 0; k < data.octree.levels.size(); ++k) {
        const octree::Level& from = data.octree.levels[k];
        levels[k] = {.mask = from.mask.data(),
                     .inside = data.sides.inside[k].data(),
                     .ranks = from.first.words(),
                     .values = data.field.values[k].data()};
        if (!adaptive || k == 0) continue;
        levels[k].leaf = from.leaf.data();
        levels[k].leaf_ranks = from.first_leaf.words();
        levels[k].first_cell = data.octree.surface_cells_below(int(k));
        levels[k].first_group = data.octree.surface_groups_below(int(k));
    }
    if (data.info.sign == SignRule::generalized) {
        open = std::make_unique<OpenSides>(*this);
        mark_inside(*this);
    }
    top = make_top(*this);
    if (open) open->settle(top);
    values = coarse_values(*this);
}

std::uint64_t QueryIndex::memory_bytes() const {
    std::uint64_t bytes = sizeof(*this) + top.size() * sizeof(top[0]) + values.size() * sizeof(values[0]);
    if (open) bytes += open->memory_bytes();
    for (const auto& level_sides : open_inside) bytes += level_sides.size();
    return bytes;
}

ITS_CLONES Patch find_patch(const QueryIndex& index, const octree::Cell& finest) {
    Patch patch;
    int level = index.level;
    unsigned octant = child_at(finest, level - 1);
    const std::uint32_t entry = index.top[index.top_index(finest)];
    const bool divided = entry & QueryIndex::subdivided;
    if (index.adaptive && (entry >> 29) == 1) {  // a surface cell that is no smaller than the grid's
        const Place at = descend(index.levels.data(), 0, index.shell.octree.depth, finest);
        corner_values(index.levels[std::size_t(at.level)], at.group, at.child, patch.value);
        patch.level = at.level;
        for (std::size_t axis = 0; axis < 3; ++axis) patch.cell[axis] = finest[axis] >> at.level;
        return patch;
    }
    if (divided && level == 1) {  // a finest cell: no finer hats, no need to look around
        corner_values(index.levels[0], entry & ~QueryIndex::subdivided, octant, patch.value);
        patch.level = 0;
        patch.cell = finest;
        return patch;
    }
    if (!divided) grid_corners(index, finest, patch.value);
    if (divided || entry >> octant & 1) {
        const double* group = nullptr;  // the values of the last group, while it is not known to be the last
        unsigned child = 0;
        Around around = around_grid_cell(index, finest, octant);
        while (around.present != 0) {
            const LevelView& finer = index.levels[std::size_t(--level)];
            if (around.present & 1) {
                group = finer.values + octree::group_points * around.group[0];
                child = octant;
                if (is_surface(finer, around.group[0], octant)) break;  // no finer hats reach into it
            } else {
                if (group) corner_values(group, child, patch.value);
                group = nullptr;
                refine(finer, around, octant, patch.value);
            }
            if (level == 0) break;
            const unsigned next = child_at(finest, level - 1);
            around = descend(finer, around, octant, next);
            octant = next;
        }
        if (group) corner_values(group, child, patch.value);
    }
    patch.level = level;
    for (std::size_t axis = 0; axis < 3; ++axis) patch.cell[axis] = finest[axis] >> level;
    return patch;
}

}  // namespace its::query
