#include "surface/cell_pieces.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "surface/box_walk.h"

namespace its::surface {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// f on a box, in its own coordinates.
struct TrilinearBox {
    double value[8];
    Vec3 low;
    double scale;  ///< 1 / width, a power of two
};

/// A trilinear function at the corners of a box in local coordinates: with the roundings of
/// geometry::trilinear(), but along z first, where values lie side by side.
void at_corners(const double* v, const Vec3& from, const Vec3& to, std::array<double, 8>& out) {
    const auto mix = geometry::lerp_exact_at_zero;
    double z[8], y[8];  // at the box's planes along z, then y; points are x + 2y + 4z
    for (int i = 0; i < 4; ++i) {
        z[i] = mix(v[i], v[4 + i], from.z);
        z[4 + i] = mix(v[i], v[4 + i], to.z);
    }
    for (int i = 0; i < 8; i += 4)
        for (int x = 0; x < 2; ++x) {
            y[i + x] = mix(z[i + x], z[i + 2 + x], from.y);
            y[i + 2 + x] = mix(z[i + x], z[i + 2 + x], to.y);
        }
    for (std::size_t i = 0; i < 8; i += 2) {
        out[i] = mix(y[i], y[i + 1], from.x);
        out[i + 1] = mix(y[i], y[i + 1], to.x);
    }
}

struct Span {
    double least, most;
};

template <std::size_t count>
Span span_of(const double* values) {
    Span span{values[0], values[0]};
    for (std::size_t c = 1; c < count; ++c) {
        span.least = std::min(span.least, values[c]);
        span.most = std::max(span.most, values[c]);
    }
    return span;
}

/// From any thread, in any order.
void raise(std::atomic<double>& most, double value) {
    double seen = most.load(std::memory_order_relaxed);
    while (value > seen && !most.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
    }
}

/// CellPieces::reaches().
struct Reaches {
    double bound;
    int direction;
    std::span<const double> matters;
    std::vector<std::atomic<double>> most;

    bool wants(const Span& f, double error) const {
        return direction > 0 ? f.least - error <= bound && f.most + error >= bound
                             : f.most + error >= -bound && f.least - error <= -bound;
    }
    bool is_near(std::uint32_t cell, const Span& g, double error) const {
        return (direction > 0 ? g.most : -g.least) + error >= matters[cell];
    }
    void add(std::uint32_t cell, const Span& f, const Span& g, const Span& difference, double error) {
        const bool up = direction > 0;
        if ((up ? f.least : -f.most) - error > bound) return;
        // Where f = bound, g = f + (g − f) ≤ bound + max(g − f).
        raise(most[cell],
              std::min(up ? g.most : -g.least, bound + (up ? -difference.least : difference.most)) + error);
    }
};

/// CellPieces::ranges().
struct Ranges {
    double level;
    std::span<const double> band;
    std::vector<std::atomic<double>> below, above;  ///< how far f is from the level, at most

    bool wants(const Span&, double) const { return true; }
    bool is_near(std::uint32_t cell, const Span& g, double error) const {
        return g.least - error <= level + band[cell] && g.most + error >= level - band[cell];
    }
    void add(std::uint32_t cell, const Span& f, const Span& g, const Span& difference, double error) {
        const double low = level - band[cell], high = level + band[cell];
        const double upper = std::min(f.most, std::min(g.most, high) + difference.most) + error,
                     lower = std::max(f.least, std::max(g.least, low) + difference.least) - error;
        raise(above[cell], upper - level);
        raise(below[cell], level - lower);
    }
};

}  // namespace

/// The planes of a cell, as computed, err by a mapping error: each point of it is so near, along each axis,
/// to one of the box that is looked at. Values of f are distances in the root cube (extract_surface() sees to
/// it), hence no slope is larger than twice their most, a finest cell being the narrowest.
CellPieces::CellPieces(const shell::ShellData& shell, const Grid& grid)
    : shell_(shell),
      axes_{make_axis(shell, grid, 0), make_axis(shell, grid, 1), make_axis(shell, grid, 2)},
      plane_error_(3 * shell.lattice.mapping_error() * 2 * shell.lattice.largest_value()),
      value_error_(plane_error_ + value_roundings(shell.lattice.depth) * unit_roundoff *
                                      std::ldexp(4.0, shell.lattice.depth)) {}

/// What is only touched has the values of its neighbour there.
CellPieces::Axis CellPieces::make_axis(const shell::ShellData& shell, const Grid& grid, int axis) {
    Axis result;
    for (std::uint32_t i = 0; i <= grid.cells; ++i) {
        Vec3 p = grid.origin;
        p[axis] = grid.position(axis, i);
        result.plane.push_back(shell.lattice.to_lattice(p)[axis]);
        if (i > 0) result.scale.push_back(1 / (result.plane[i] - result.plane[i - 1]));
    }
    std::uint32_t first = 0, last = 0;
    for (std::uint32_t x = 0; x <= shell.lattice.cells(); ++x) {
        while (first + 1 < grid.cells && !(result.plane[first + 1] > x)) ++first;
        while (last + 1 < grid.cells && result.plane[last + 1] < x) ++last;
        result.first.push_back(first);
        result.last.push_back(last);
    }
    return result;
}

/// Goes through the boxes in a region with the cells that meet them in hand: a list for each level.
template <class Pass>
class CellPieces::Join {
public:
    struct Entry {
        std::uint32_t cell;
        octree::Cell at;
    };

    Join(const CellPieces& of, std::span<const LevelCell> cells, const Region& region, std::vector<Entry> all,
         Pass& pass)
        : of_(of), cells_(cells), region_(region), pass_(pass) {
        const std::size_t count = all.size();
        lists_.push_back({std::move(all), count});
    }

    bool enter(int level, const octree::Cell& at) {
        if (level >= region_.level) return region_.meets(level, at);
        if (depth_ + 1 == lists_.size()) lists_.emplace_back();
        const List& all = lists_[depth_];
        List& some = lists_[depth_ + 1];
        if (some.entries.size() < all.count) some.entries.resize(all.count);
        some.count = 0;
        const Range range = range_of(level, at);
        for (std::size_t i = 0; i < all.count; ++i) {
            some.entries[some.count] = all.entries[i];
            some.count += range.has(all.entries[i].at);
        }
        if (some.count == 0) return false;
        ++depth_;
        return true;
    }
    void leave(int level) { depth_ -= level < region_.level; }

    bool wants(const double* points) const {
        const Span span = span_of<octree::group_points>(points);
        return pass_.wants(span, error_of(span));
    }

    void box(int level, const octree::Cell& at, const double* points, int child) {
        if (level >= region_.level && !region_.meets(level, at)) return;
        TrilinearBox box;
        for (int c = 0; c < 8; ++c) box.value[c] = points[octree::group_point(child, c)];
        const Span span = span_of<8>(box.value);
        const double error = error_of(span);
        if (!pass_.wants(span, error)) return;
        const Range range = range_of(level, at);
        box.scale = 1 / double(std::uint64_t{1} << level);
        for (std::size_t axis = 0; axis < 3; ++axis) box.low[int(axis)] = double(at[axis] << level);
        const List& list = lists_[depth_];
        for (std::size_t i = 0; i < list.count; ++i)
            if (range.has(list.entries[i].at)) add(box, list.entries[i], level, at, error);
    }

private:
    /// `count` entries; those behind are left from before.
    struct List {
        std::vector<Entry> entries;
        std::size_t count;
    };

    /// Cells, from `low` to `high`.
    struct Range {
        octree::Cell low, high;

        /// Without branches: numbers below `low` wrap around.
        bool has(const octree::Cell& at) const {
            return (unsigned(at[0] - low[0] <= high[0] - low[0]) &
                    unsigned(at[1] - low[1] <= high[1] - low[1]) &
                    unsigned(at[2] - low[2] <= high[2] - low[2])) != 0;
        }
    };

    /// Of f in a box, as it is computed: the evaluation, local coordinates that err by 2u each and a slope of
    /// at most 2V; and the values, which are means of distances in a root cube with a diagonal below 4·2ᴷ.
    double error_of(const Span& span) const {
        const double largest = std::max(std::abs(span.least), std::abs(span.most));
        return (geometry::trilinear_roundings + 12) * unit_roundoff * largest + of_.value_error_;
    }

    /// Those that meet a cell's part in the region.
    Range range_of(int level, const octree::Cell& at) const {
        Range range;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            range.low[axis] = of_.axes_[axis].first[region_.from(level, at, axis)];
            range.high[axis] = of_.axes_[axis].last[region_.to(level, at, axis)];
        }
        return range;
    }

    /// The part of a cell in a box.
    void add(const TrilinearBox& box, const Entry& entry, int level, const octree::Cell& at, double error) {
        Vec3 f_from, f_to, g_from, g_to;
        double steepest = 0;  // cell widths per finest cell width
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = std::size_t(axis);
            const Axis& along = of_.axes_[a];
            const double cell_low = along.plane[entry.at[a]], cell_high = along.plane[entry.at[a] + 1];
            const double from = std::max(double(region_.from(level, at, a)), cell_low),
                         to = std::min(double(region_.to(level, at, a)), cell_high),
                         scale = along.scale[entry.at[a]];
            f_from[axis] = (from - box.low[axis]) * box.scale;
            f_to[axis] = (to - box.low[axis]) * box.scale;
            g_from[axis] = (from - cell_low) * scale;
            g_to[axis] = (to - cell_low) * scale;
            steepest = std::max(steepest, scale);
        }
        const std::array<double, 8>& value = cells_[entry.cell].value;
        const Span span = span_of<8>(value.data());
        // Of g: the evaluation, local coordinates that err by 3u each and a slope of at most 2V; the planes err
        // by a mapping error each, and so does the size by two: four in all, in cells, along each axis.
        const double largest = std::max(std::abs(span.least), std::abs(span.most));
        error += (geometry::trilinear_roundings + 18) * unit_roundoff * largest +
                 3 * 2 * largest * 4 * of_.shell_.lattice.mapping_error() * steepest;
        std::array<double, 8> f, g;
        at_corners(value.data(), g_from, g_to, g);
        const Span g_span = span_of<8>(g.data());
        if (!pass_.is_near(entry.cell, g_span, error)) return;
        at_corners(box.value, f_from, f_to, f);
        const Span f_span = span_of<8>(f.data());
        for (std::size_t c = 0; c < 8; ++c) f[c] -= g[c];
        pass_.add(entry.cell, f_span, g_span, span_of<8>(f.data()), error);
    }

    const CellPieces& of_;
    std::span<const LevelCell> cells_;
    const Region region_;
    std::vector<List> lists_;
    std::size_t depth_ = 0;
    Pass& pass_;
};

template <class Pass>
void CellPieces::join(std::span<const LevelCell> cells, Pass& pass, const Progress& progress) const {
    using Entry = typename Join<Pass>::Entry;
    const int level = Region::level_of(shell_.octree.depth);
    const std::uint32_t regions = 1u << (shell_.octree.depth + 1 - level);
    std::vector<std::vector<Entry>> lists(std::uint64_t{regions} * regions * regions);
    const double scale = 1 / double(std::uint64_t{1} << level);
    const auto region_of = [&](double x) { return std::uint32_t(std::clamp(x * scale, 0.0, regions - 1.0)); };
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
        const octree::Cell& at = cells[i].at;
        octree::Cell from, to;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            from[axis] = region_of(axes_[axis].plane[at[axis]]);
            to[axis] = region_of(axes_[axis].plane[at[axis] + 1]);
        }
        for (std::uint32_t z = from[2]; z <= to[2]; ++z)
            for (std::uint32_t y = from[1]; y <= to[1]; ++y)
                for (std::uint32_t x = from[0]; x <= to[0]; ++x)
                    lists[x + std::uint64_t{regions} * (y + std::uint64_t{regions} * z)].push_back({i, at});
    }
    Stage stage(progress, "surface pieces", lists.size());
    parallel_for(lists.size(), 1, [&](std::uint64_t i) {
        const octree::Cell at{std::uint32_t(i % regions), std::uint32_t(i / regions % regions),
                              std::uint32_t(i / regions / regions)};
        if (!lists[i].empty()) {
            Join<Pass> visitor(*this, cells, {level, at}, std::move(lists[i]), pass);
            BoxWalk<Join<Pass>>(shell_.octree, shell_.field, visitor).run();
        }
        stage.advance(1);
    });
}

std::vector<double> CellPieces::reaches(std::span<const LevelCell> cells, double bound, int direction,
                                        std::span<const double> matters, const Progress& progress) const {
    Reaches pass{bound, direction, matters, std::vector<std::atomic<double>>(cells.size())};
    for (std::size_t i = 0; i < cells.size(); ++i) {
        // From any point with f < bound walk along x, then y, then z so that g does not fall: f = bound is met
        // on the way, or a corner is its end.
        double most = -infinity;
        for (const double v : cells[i].value)
            if (v * direction <= bound + value_error_) most = std::max(most, v * direction);
        pass.most[i] = most;
    }
    join(cells, pass, progress);
    return {pass.most.begin(), pass.most.end()};
}

std::vector<SurfaceRange> CellPieces::ranges(std::span<const LevelCell> cells, double level,
                                             std::span<const double> band, const Progress& progress) const {
    Ranges pass{level, band, std::vector<std::atomic<double>>(cells.size()),
                std::vector<std::atomic<double>>(cells.size())};
    join(cells, pass, progress);
    std::vector<SurfaceRange> ranges(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i)
        ranges[i] = {level - pass.below[i].load(), level + pass.above[i].load()};
    return ranges;
}

}  // namespace its::surface
