#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "geometry/far.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/query.h"
#include "query/access.h"
#include "query/decide.h"
#include "query/evaluate.h"
#include "query/open_sides.h"

// Batches go through blocks of points, stage by stage: a stage is a loop without calls whose iterations are
// independent, so that it becomes vector code or at least overlaps its cache misses; points that are not
// settled are compressed into a list for the next one.

namespace its {
using namespace query;

namespace {

constexpr int block_points = 1024;
constexpr std::uint64_t grain = 16 * block_points;  ///< points a task; fewer are not worth a second thread

/// What the stages of one block hand on; on the stack.
struct Block {
    double x[block_points], y[block_points], z[block_points];  ///< lattice coordinates
    std::uint32_t place[block_points];                         ///< in the grid
    std::uint32_t entry[block_points];                         ///< what is there
    std::uint8_t bad[block_points];                            ///< 1: not finite
};

/// Unsettled points: their numbers in the block, and the groups that hold them.
struct Survivors {
    int count = 0;
    std::uint32_t point[block_points];
    std::uint64_t group[block_points];
    std::int8_t level[block_points];  ///< of the surface cells of adaptive shells
};

ITS_INLINE octree::Cell cell_of(const Block& block, std::uint32_t i) {
    return finest_cell({block.x[i], block.y[i], block.z[i]});
}

/// Lattice coordinates and places in the grid. Points outside the root get the entry past the grid.
ITS_CLONES void map_points(const QueryIndex& index, const Vec3* points, int count, Block& block) {
    const double ox = index.origin.x, oy = index.origin.y, oz = index.origin.z;
    const double width = index.width, cells = index.cells;
    const int shift = index.level, side = int(index.side), outside = side * side * side;
    for (int i = 0; i < count; ++i) {
        const double px = points[i].x, py = points[i].y, pz = points[i].z;
        const double x = (px - ox) / width, y = (py - oy) / width, z = (pz - oz) / width;
        const bool in = (x >= 0) & (x < cells) & (y >= 0) & (y < cells) & (z >= 0) & (z < cells);
        const int cx = int(in ? x : 0.0), cy = int(in ? y : 0.0), cz = int(in ? z : 0.0);
        block.x[i] = x;
        block.y[i] = y;
        block.z[i] = z;
        block.place[i] =
            std::uint32_t(in ? ((cz >> shift) * side + (cy >> shift)) * side + (cx >> shift) : outside);
        block.bad[i] = !((px - px == 0) & (py - py == 0) & (pz - pz == 0));
    }
}

/// Looks the entries up; the codes are right for points of leaves, and for those outside.
ITS_CLONES void look_up(const std::uint32_t* ITS_RESTRICT top, int count, Block& ITS_RESTRICT block,
                        std::int8_t* ITS_RESTRICT out) {
    for (int i = 0; i < count; ++i) {
        const std::uint32_t entry = top[block.place[i]];
        block.entry[i] = entry;
        out[i] = std::int8_t(1 - 2 * int(entry >> 30 & 1) + block.bad[i]);
    }
}

/// Points in surface cells that are no smaller than the grid's, which look_up() marks as outside.
void keep_coarse(const QueryIndex& index, const Block& block, int count, Survivors& coarse) {
    int n = 0;
    for (int i = 0; i < count; ++i) {
        coarse.point[n] = std::uint32_t(i);
        n += int(block.entry[i] >> 29 & 1) & int(block.entry[i] >> 31 ^ 1);
    }
    coarse.count = n;
    for (int k = 0; k < n; ++k) {
        const Place at =
            descend(index.levels.data(), 0, index.shell.octree.depth, cell_of(block, coarse.point[k]));
        coarse.group[k] = at.group;
        coarse.level[k] = std::int8_t(at.level);
    }
}

void keep_subdivided(const Block& block, int count, Survivors& left) {
    int n = 0;
    for (int i = 0; i < count; ++i) {
        left.point[n] = std::uint32_t(i);
        left.group[n] = block.entry[i] & ~QueryIndex::subdivided;
        n += int(block.entry[i] >> 31);
    }
    left.count = n;
}

/// One level down: the codes are right for points in leaves of this level, the others stay.
ITS_CLONES void descend_level(const LevelView& view, int level, const Block& block, std::int8_t* out,
                              Survivors& left) {
    int n = 0;
    for (int k = 0; k < left.count; ++k) {
        const std::uint32_t i = left.point[k];
        const std::uint64_t group = left.group[k];
        const unsigned child = child_at(cell_of(block, i), level);
        out[i] = std::int8_t(1 - 2 * (view.inside[group] >> child & 1));
        left.point[n] = i;
        left.group[n] = level > 0 ? rank(view, group, child) : group;
        n += view.mask[group] >> child & 1;
    }
    left.count = n;
}

/// The same where surface cells may be of this level: their points go to `found`.
ITS_CLONES void descend_adaptive(const LevelView& view, int level, const Block& block, std::int8_t* out,
                                 Survivors& left, Survivors& found) {
    int n = 0, m = found.count;
    for (int k = 0; k < left.count; ++k) {
        const std::uint32_t i = left.point[k];
        const std::uint64_t group = left.group[k];
        const unsigned child = child_at(cell_of(block, i), level);
        out[i] = std::int8_t(1 - 2 * (view.inside[group] >> child & 1));
        found.point[m] = left.point[n] = i;
        found.group[m] = group;
        found.level[m] = std::int8_t(level);
        m += view.leaf[group] >> child & 1;
        left.group[n] = rank(view, group, child);
        n += view.mask[group] >> child & 1;
    }
    left.count = n;
    found.count = m;
}

/// Points in surface cells of an adaptive shell.
void decide_adaptive(const QueryIndex& index, const Vec3* points, const Block& block, const Survivors& found,
                     std::int8_t* out) {
    const bool by_side = index.shell.info.sign != SignRule::unsigned_rule;
    const shell::SurfaceCells& surface = index.shell.surface;
    for (int k = 0; k < found.count; ++k) {
        const std::uint32_t i = found.point[k];
        const octree::Cell finest = cell_of(block, i);
        const SurfacePoint at =
            surface_point({found.group[k], child_at(finest, found.level[k]), found.level[k], true}, finest,
                          {block.x[i], block.y[i], block.z[i]});
        int side = 0;
        if (by_side) {
            const std::uint64_t cell = surface_number(index.levels.data(), at.group, at.child, at.level);
            double value[8];
            const double f = surface_value(index, at, value);
            side = side_by_corners(f, value, corners_inside(index, at, cell), surface.lower[cell],
                                   surface.upper[cell]);
        }
        out[i] = side != 0 ? std::int8_t(side) : std::int8_t(decide(index, points[i], at));
    }
}

/// Points in cells that meet M.
void decide_survivors(const QueryIndex& index, const Vec3* points, const Block& block, const Survivors& left,
                      std::int8_t* out) {
    const ShellInfo& info = index.shell.info;
    const bool by_sign = info.sign != SignRule::unsigned_rule && info.solver == Solver::direct;
    for (int k = 0; k < left.count; ++k) {
        const std::uint32_t i = left.point[k];
        const octree::Cell finest = cell_of(block, i);
        const Vec3 u{block.x[i], block.y[i], block.z[i]};
        const SurfacePoint at{left.group[k], child_at(finest, 0), 0, finest, local_in(u, finest)};
        int side = 0;
        if (by_sign) {
            const std::uint64_t cell = rank(index.levels[0], at.group, at.child);
            double value[8];
            const double f = surface_value(index, at, value);
            side = side_by_bounds(f, index.shell.surface.lower[cell], index.shell.surface.upper[cell]);
        }
        out[i] = side != 0 ? std::int8_t(side) : std::int8_t(decide(index, points[i], at));
    }
}

void classify_steady(const QueryIndex& index, const Vec3* points, int count, Block& block, std::int8_t* out) {
    Survivors left;
    look_up(index.top.data(), count, block, out);
    keep_subdivided(block, count, left);
    if (!index.adaptive) {
        for (int level = index.level - 1; level >= 0; --level)
            descend_level(index.levels[std::size_t(level)], level, block, out, left);
        decide_survivors(index, points, block, left, out);
        return;
    }
    Survivors found;
    keep_coarse(index, block, count, found);
    for (int level = index.level - 1; level > 0; --level)
        descend_adaptive(index.levels[std::size_t(level)], level, block, out, left, found);
    descend_level(index.levels[0], 0, block, out, left);
    for (int k = 0; k < left.count; ++k) {
        found.point[found.count] = left.point[k];
        found.group[found.count] = left.group[k];
        found.level[found.count++] = 0;
    }
    decide_adaptive(index, points, block, found, out);
}

/// Points of cubes that are not steady.
struct Unsteady {
    int count = 0;
    std::uint32_t point[block_points], node[block_points];
};

/// Lists them, and places them outside of the grid.
void keep_unsteady(const QueryIndex& index, int count, Block& block, Unsteady& unsteady) {
    std::uint32_t cells[block_points];  // whose cell is not all steady
    int n = 0;
    for (int i = 0; i < count; ++i) {
        cells[n] = std::uint32_t(i);
        n += int(index.open->unsteady(block.place[i]));
    }
    for (int k = 0; k < n; ++k) {
        const std::uint32_t i = cells[k];
        const std::uint32_t node = index.open->resolve(index, {block.x[i], block.y[i], block.z[i]});
        unsteady.point[unsteady.count] = i;
        unsteady.node[unsteady.count] = node;
        unsteady.count += int(!OpenSides::is_steady(node));
    }
    for (int k = 0; k < unsteady.count; ++k)
        block.place[unsteady.point[k]] = index.side * index.side * index.side;
}

void classify_block(const QueryIndex& index, const Vec3* points, int count, std::int8_t* out) {
    Block block;
    map_points(index, points, count, block);
    Unsteady unsteady;
    if (index.open) keep_unsteady(index, count, block, unsteady);
    classify_steady(index, points, count, block, out);
    for (int k = 0; k < unsteady.count; ++k) {
        const std::uint32_t i = unsteady.point[k];
        out[i] = std::int8_t(
            index.open->side(index, unsteady.node[k], points[i], {block.x[i], block.y[i], block.z[i]}));
    }
}

/// What the stages of a block of values hand on.
struct ValueBlock {
    double x[block_points], y[block_points], z[block_points];  ///< in the grid's cell, [0, 1]
    double away[block_points];                                 ///< distance from the root; NaN for a bad point
    std::uint8_t octant[block_points];
    std::int32_t corner[block_points];  ///< lowest corner among the grid's values
    std::uint32_t entry[block_points];
};

ITS_CLONES void map_values(const QueryIndex& index, const Vec3* points, int count, ValueBlock& block) {
    const double ox = index.origin.x, oy = index.origin.y, oz = index.origin.z;
    const double width = index.width, cells = index.cells, scale = 1.0 / double(1 << index.level);
    const int last = int(index.side) - 1, side = int(index.side);
    for (int i = 0; i < count; ++i) {
        const double px = points[i].x, py = points[i].y, pz = points[i].z;
        const double x = (px - ox) / width, y = (py - oy) / width, z = (pz - oz) / width;
        const auto clamp = [cells](double v) { return v > 0 ? (v < cells ? v : cells) : 0.0; };  // NaN: 0
        const double ix = clamp(x), iy = clamp(y), iz = clamp(z);
        const double ax = x - ix, ay = y - iy, az = z - iz;
        const double never = (px - px) + (py - py) + (pz - pz);  // 0, or NaN where one is not finite
        block.away[i] = std::sqrt(ax * ax + ay * ay + az * az) + never;
        const auto cell = [last, scale](double v) { return int(scale * v) < last ? int(scale * v) : last; };
        const int cx = cell(ix), cy = cell(iy), cz = cell(iz);
        block.x[i] = scale * ix - cx;
        block.y[i] = scale * iy - cy;
        block.z[i] = scale * iz - cz;
        block.octant[i] = std::uint8_t((block.x[i] >= 0.5) + 2 * (block.y[i] >= 0.5) + 4 * (block.z[i] >= 0.5));
        block.corner[i] = (cz * (side + 1) + cy) * (side + 1) + cx;
        block.entry[i] = std::uint32_t((cz * side + cy) * side + cx);
    }
}

/// f on the grid's cells; not yet right where finer levels reach.
ITS_CLONES void grid_values(const double* ITS_RESTRICT values, double width, int side, int count,
                            const ValueBlock& block, double* ITS_RESTRICT out) {
    const int row = side + 1, slice = row * row;
    for (int i = 0; i < count; ++i) {
        const double* const v = values + block.corner[i];
        const double x = block.x[i], y = block.y[i];
        const auto mix = geometry::lerp_exact_at_zero;
        const double z0 = mix(mix(v[0], v[1], x), mix(v[row], v[row + 1], x), y);
        const double z1 = mix(mix(v[slice], v[slice + 1], x), mix(v[slice + row], v[slice + row + 1], x), y);
        out[i] = width * (mix(z0, z1, block.z[i]) + block.away[i]);
    }
}

/// The numbers of the points that finer levels reach; returns how many.
int finer_points(const std::uint32_t* top, int count, const ValueBlock& block, std::uint32_t* list) {
    int n = 0;
    for (int i = 0; i < count; ++i) {
        list[n] = std::uint32_t(i);
        const std::uint32_t entry = top[block.entry[i]];
        n += int(entry >> 31 | (entry >> block.octant[i] & 1));
    }
    return n;
}

void value_block(const QueryIndex& index, const Vec3* points, int count, double* out) {
    ValueBlock block;
    std::uint32_t list[block_points];
    map_values(index, points, count, block);
    grid_values(index.values.data(), index.width, int(index.side), count, block, out);
    // Squares overflow there. NaN is no distance, and stays.
    for (int i = 0; i < count; ++i)
        if (block.away[i] >= geometry::far_cells) out[i] = field_value(index, points[i]);
    const int finer = finer_points(index.top.data(), count, block, list);
    for (int k = 0; k < finer; ++k) out[list[k]] = field_value(index, points[list[k]]);
}

void check_sizes(std::size_t points, std::size_t out) {
    if (points != out)
        throw OptionError(fmt::format("batch of {} points: there is room for {} results", points, out));
}

/// answer(begin, count) for consecutive blocks.
template <class Answer>
void for_blocks(std::uint64_t count, const Run& run, const Answer& answer) {
    require_threads(run.threads);
    Stage stage(run.progress, "query", count);
    const auto all = [&] {
        for_chunks(count, grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t at = begin; at < end; at += block_points)
                answer(at, int(std::min<std::uint64_t>(block_points, end - at)));
            stage.advance(end - begin);
        });
    };
    if (count <= grain)
        all();  // one chunk: this thread
    else
        with_threads(run.threads, all);
}

}  // namespace

void Query::classify(std::span<const Vec3> points, std::span<std::int8_t> out, const Run& run) const {
    check_sizes(points.size(), out.size());
    for_blocks(points.size(), run, [&](std::uint64_t begin, int count) {
        classify_block(data_->index, points.data() + begin, count, out.data() + begin);
    });
}

void Query::contains(std::span<const Vec3> points, std::span<std::uint8_t> out,
                     std::optional<bool> when_uncertain, const Run& run) const {
    check_sizes(points.size(), out.size());
    for_blocks(points.size(), run, [&](std::uint64_t begin, int count) {
        std::int8_t code[block_points];
        classify_block(data_->index, points.data() + begin, count, code);
        for (int i = 0; i < count; ++i)
            out[begin + std::uint64_t(i)] =
                code[i] != not_finite && contained(Side(code[i]), when_uncertain) ? 1 : 0;
    });
}

void Query::winding_number(std::span<const Vec3> points, std::span<WindingNumber> out, const Run& run) const {
    check_sizes(points.size(), out.size());
    const winding::MeshWinding& mesh = data_->winding();
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                     infinity = std::numeric_limits<double>::infinity();
    for_blocks(points.size(), run, [&](std::uint64_t begin, int count) {
        for (std::uint64_t i = begin; i < begin + std::uint64_t(count); ++i)
            out[i] = finite(points[i]) ? winding_off_surface(data_->index, mesh, points[i])
                                       : WindingNumber{nan, infinity};
    });
}

void Query::classify_shell(std::span<const Vec3> points, std::span<std::int8_t> out, const Run& run) const {
    check_sizes(points.size(), out.size());
    const ShellInfo& info = data_->shell.info();
    for_blocks(points.size(), run, [&](std::uint64_t begin, int count) {
        double f[block_points];
        value_block(data_->index, points.data() + begin, count, f);
        for (int i = 0; i < count; ++i)
            out[begin + std::uint64_t(i)] = std::isnan(f[i]) ? not_finite : std::int8_t(shell_side(info, f[i]));
    });
}

void Query::classify_shell(std::span<const Vec3> points, std::span<std::int8_t> out,
                           const ClosestSides& closest, const Run& run) const {
    check_sizes(points.size(), out.size());
    const ShellInfo& info = data_->shell.info();
    for_blocks(points.size(), run, [&](std::uint64_t begin, int count) {
        double f[block_points];
        value_block(data_->index, points.data() + begin, count, f);
        for (int i = 0; i < count; ++i) {
            std::int8_t& code = out[begin + std::uint64_t(i)];
            code = std::isnan(f[i]) ? not_finite : std::int8_t(shell_side(info, f[i]));
            if (code == std::int8_t(ShellSide::on_shell))
                code = std::int8_t(closest.side(points[begin + std::uint64_t(i)]));
        }
    });
}

void Query::value(std::span<const Vec3> points, std::span<double> out, const Run& run) const {
    check_sizes(points.size(), out.size());
    for_blocks(points.size(), run, [&](std::uint64_t begin, int count) {
        value_block(data_->index, points.data() + begin, count, out.data() + begin);
    });
}

void Query::gradient(std::span<const Vec3> points, std::span<Vec3> out, const Run& run) const {
    check_sizes(points.size(), out.size());
    for_blocks(points.size(), run, [&](std::uint64_t begin, int count) {
        for (std::uint64_t i = begin; i < begin + std::uint64_t(count); ++i)
            out[i] = field_gradient(data_->index, points[i]);
    });
}

void Query::signed_distance_bound(std::span<const Vec3> points, std::span<Interval> out, const Run& run) const {
    check_sizes(points.size(), out.size());
    require_distances(data_->shell.info());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for_blocks(points.size(), run, [&](std::uint64_t begin, int count) {
        std::int8_t code[block_points];
        classify_block(data_->index, points.data() + begin, count, code);
        for (int i = 0; i < count; ++i) {
            const Vec3& p = points[begin + std::uint64_t(i)];
            out[begin + std::uint64_t(i)] =
                code[i] == not_finite
                    ? Interval{nan, nan}
                    : with_side(distance_bound(data_->index, p), Side(code[i]), data_->shell.info().sign);
        }
    });
}

}  // namespace its
