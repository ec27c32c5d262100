#include <algorithm>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "base/progress.h"
#include "base/rounding.h"
#include "geometry/clip.h"
#include "geometry/vec3.h"
#include "surface/box_walk.h"
#include "surface/cell_pieces.h"
#include "surface/lattice_points.h"
#include "surface/level_search.h"
#include "surface/level_source.h"
#include "surface/memory_guard.h"
#include "surface/polygonise.h"

namespace its::surface {

namespace {

constexpr std::uint64_t cell_grain = 1024;

/// Bounds f over the triangles of a patch on the boxes that they go through.
class TriangleBounder {
public:
    explicit TriangleBounder(const shell::ShellData& shell)
        : shell_(shell),
          clipping_((geometry::cuts * geometry::roundings_per_cut + geometry::roundings_of_vertices) *
                    unit_roundoff * shell.lattice.cells()),
          margin_(shell.lattice.mapping_error() + clipping_) {}

    /// In lattice coordinates, as rounded by to_lattice.
    struct Corners {
        Vec3 p, q, r;
    };

    void include(std::span<const Corners> triangles, Hull& hull, double& error) const {
        Visitor visitor{*this, triangles, hull, error};
        BoxWalk<Visitor>(shell_.octree, shell_.field, visitor).run();
    }

private:
    struct Visitor {
        const TriangleBounder& of;
        std::span<const Corners> triangles;
        Hull& hull;
        double& error;

        bool enter(int level, const octree::Cell& at) const {
            return std::any_of(triangles.begin(), triangles.end(),
                               [&](const Corners& t) { return of.may_meet(t, level, at); });
        }
        void leave(int) const {}
        bool wants(const double*) const { return true; }

        void box(int level, const octree::Cell& at, const double* points, int child) const {
            field::TrilinearCell cell;
            cell.width = double(std::uint64_t{1} << level);
            for (std::size_t axis = 0; axis < 3; ++axis) cell.corner[int(axis)] = double(at[axis] << level);
            for (int c = 0; c < 8; ++c) cell.value[c] = points[octree::group_point(child, c)];
            for (const Corners& t : triangles)
                if (of.may_meet(t, level, at)) of.include_in_box(t, cell, hull, error);
        }
    };

    /// By their bounds.
    bool may_meet(const Corners& t, int level, const octree::Cell& at) const {
        const double width = double(std::uint64_t{1} << level);
        for (int axis = 0; axis < 3; ++axis) {
            const double from = double(at[std::size_t(axis)] << level);
            if (std::max({t.p[axis], t.q[axis], t.r[axis]}) < from - margin_ ||
                std::min({t.p[axis], t.q[axis], t.r[axis]}) > from + width + margin_)
                return false;
        }
        return true;
    }

    void include_in_box(const Corners& t, const field::TrilinearCell& cell, Hull& hull, double& error) const {
        // As γ of the extremes, docs/design/extremes.md: the slope times the displacement of the point, and the
        // roundings of the control values and of the corner values.
        const auto [least, most] = std::minmax_element(cell.value, cell.value + 8);
        const double largest = std::max(std::abs(*least), std::abs(*most));
        const double displacement = margin_ + clipping_ + 2 * Hull::max_halvings * unit_roundoff;
        const double corner_roundings = value_roundings(shell_.lattice.depth);
        error = std::max(error, 4 * steepest(cell.value) * displacement +
                                    geometry::control_roundings * unit_roundoff * largest +
                                    corner_roundings * unit_roundoff * std::ldexp(4.0, shell_.lattice.depth));
        if (hull.include_if_within(*least, *most)) return;
        const auto local = [&](const Vec3& v) { return (1.0 / cell.width) * (v - cell.corner); };
        const geometry::Polygon polygon = geometry::clip_to_cell(local(t.p), local(t.q), local(t.r), margin_);
        if (polygon.size == 0) return;
        const geometry::Sample apex = geometry::sample(cell.value, polygon.vertex(0));
        geometry::Sample last = geometry::sample(cell.value, polygon.vertex(std::min(1, polygon.size - 1)));
        if (polygon.size < 3) hull.include(cell.value, apex, last, last);
        for (int i = 2; i < polygon.size; ++i) {
            const geometry::Sample next = geometry::sample(cell.value, polygon.vertex(i));
            hull.include(cell.value, apex, last, next);
            last = next;
        }
    }

    const shell::ShellData& shell_;
    double clipping_, margin_;
};

/// Levels for which some point of a cell's triangles may be on M's side of the bound, with the sign of the
/// direction away from M: from `low`, where the level enters the cell, to `high`.
struct Blocked {
    double low, high;
};

/// A cell that the level runs through, and bounds of f on its triangles that cost little.
struct Quick {
    std::uint32_t cell;
    bool star;
    SurfaceRange range;
};

/// Cells from the values at lattice points.
class Assembler {
public:
    /// \param reach  cells whose lowest corner is farther from the levels are met across faces only
    Assembler(std::span<const LatticePoint> points, std::uint32_t side, const SurfaceRange& levels,
              double reach)
        : points_(points), side_(side), low_(levels.lower), high_(levels.upper), reach_(reach) {}

    /// \param value    f at a lattice point that is not among the points
    /// \param cells    with lowest corners among points begin to end − 1, that a level runs through
    /// \param missing  cells beyond crossed faces whose lowest corner is not among the points, or too far
    template <class Value>
    void run(std::uint64_t begin, std::uint64_t end, Value&& value, std::vector<LevelCell>& cells,
             std::vector<std::uint64_t>& missing) const {
        constexpr std::uint64_t step[3] = {1, std::uint64_t{1} << 21, std::uint64_t{1} << 42};
        std::array<Cursor, 8> corners;
        std::array<Cursor, 3> before;
        const std::uint64_t first = points_[begin].key;
        for (std::uint64_t c = 0; c < 8; ++c)
            corners[c] = cursor(first + (c & 1) * step[0] + (c >> 1 & 1) * step[1] + (c >> 2) * step[2]);
        for (std::size_t axis = 0; axis < 3; ++axis)
            before[axis] = cursor(first < step[axis] ? 0 : first - step[axis]);
        for (std::uint64_t i = begin; i < end; ++i) {
            if (!is_within_reach(points_[i].value)) continue;
            const std::uint64_t key = points_[i].key;
            LevelCell cell{cell_of(key), {}};
            if (std::max({cell.at[0], cell.at[1], cell.at[2]}) >= side_) continue;
            unsigned known = 0;
            for (std::uint64_t c = 0; c < 8; ++c) {
                const double* const v =
                    find(corners[c], key + (c & 1) * step[0] + (c >> 1 & 1) * step[1] + (c >> 2) * step[2]);
                if (v == nullptr) continue;
                known |= 1u << c;
                cell.value[c] = *v;
            }
            if (!complete(cell, known, value)) continue;
            cells.push_back(cell);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (cell.at[axis] + 1 < side_ && crossed(cell, axis, 1) &&
                    (known != 0xff || !is_within_reach(cell.value[std::size_t{1} << axis])))
                    missing.push_back(key + step[axis]);
                if (cell.at[axis] == 0 || !crossed(cell, axis, 0)) continue;
                const double* const v = known == 0xff ? find(before[axis], key - step[axis]) : nullptr;
                if (v == nullptr || !is_within_reach(*v)) missing.push_back(key - step[axis]);
            }
        }
    }

    /// Whether the level runs through a face, on this side along the axis.
    bool crossed(const LevelCell& cell, std::size_t axis, unsigned side) const {
        double least = 1e300, most = -1e300;
        for (unsigned c = 0; c < 8; ++c)
            if ((c >> axis & 1) == side) {
                least = std::min(least, cell.value[c]);
                most = std::max(most, cell.value[c]);
            }
        return least < high_ && most >= low_;
    }
    bool crossed(const LevelCell& cell) const {
        const auto [least, most] = std::minmax_element(cell.value.begin(), cell.value.end());
        return *least < high_ && *most >= low_;
    }

private:
    bool is_within_reach(double value) const { return value >= low_ - reach_ && value <= high_ + reach_; }

    /// Goes up with the keys that are looked for.
    struct Cursor {
        std::uint64_t at = 0;
    };

    Cursor cursor(std::uint64_t key) const {
        return {
            std::uint64_t(std::lower_bound(points_.begin(), points_.end(), key,
                                           [](const LatticePoint& p, std::uint64_t k) { return p.key < k; }) -
                          points_.begin())};
    }
    const double* find(Cursor& cursor, std::uint64_t key) const {
        while (cursor.at < points_.size() && points_[cursor.at].key < key) ++cursor.at;
        return cursor.at < points_.size() && points_[cursor.at].key == key ? &points_[cursor.at].value
                                                                           : nullptr;
    }

    /// Whether the level runs through the cell; if so, all values are filled in. Corners that are not known
    /// have values beyond those of the points: where all that are known are on one side, so is the cell, or
    /// it is met across a face.
    template <class Value>
    bool complete(LevelCell& cell, unsigned known, Value&& value) const {
        double least = 1e300, most = -1e300;
        for (unsigned c = 0; c < 8; ++c)
            if (known >> c & 1) {
                least = std::min(least, cell.value[c]);
                most = std::max(most, cell.value[c]);
            }
        if (!(least < high_ && most >= low_)) return false;
        for (std::uint32_t c = 0; c < 8; ++c)
            if (!(known >> c & 1))
                cell.value[c] = value({cell.at[0] + (c & 1), cell.at[1] + (c >> 1 & 1), cell.at[2] + (c >> 2)});
        return true;
    }

    std::span<const LatticePoint> points_;
    std::uint32_t side_;
    double low_, high_, reach_;
};

class ResampledSource : public LevelSource {
public:
    ResampledSource(const shell::ShellData& shell, int resolution, const Rounding& rounding, MemoryGuard& guard)
        : LevelSource(shell.lattice, shell.lattice.scale() / resolution,
                      std::uint32_t(resolution) << (1 + shell.lattice.room), rounding),
          shell_(shell),
          ratio_(double(shell.lattice.scale_cells()) / resolution),
          guard_(guard),
          pieces_(shell, grid()),
          bounder_(shell) {}

    std::vector<LevelCell> cells(double low, double high, const Progress& progress) const override {
        const Points points = points_for({low, high}, progress);
        return cells_of(points, {low, high}, 1);
    }

    /// Most cells are bounded by how far f is from their trilinear function; the rest by their triangles, those
    /// that may be worst first.
    SurfaceRange bound(const SurfaceFrame& frame, std::span<const LevelCell> cells, RangeEnds ends,
                       const Progress& progress) const override {
        const std::vector<Quick> quick = quick_bounds(frame, cells, ends, progress);
        Hull hull(frame.level, ends);
        double error = 0;
        std::uint64_t refined = 0;
        const std::uint64_t most = most_refined();
        for (const Quick& q : quick) {
            if (!q.star && (refined >= most || hull.include_if_within(q.range.lower, q.range.upper))) {
                hull.include_bounds(q.range.lower, q.range.upper);
                continue;
            }
            refined += !q.star;
            include_triangles(frame, cells[q.cell], hull, error);
        }
        return {hull.range().lower - error, hull.range().upper + error};
    }

    /// No search: each cell says which levels it cannot have, docs/design/surface.md. Points are collected for
    /// a window of levels; a sample of their cells moves the level, so that all cells are needed for few
    /// levels.
    CertifiedLevel certified_level(SurfaceSide side, double bound, double least_move,
                                   const Progress& progress) const override {
        Parts parts(progress);
        const int away = side == SurfaceSide::outer ? 1 : -1;
        const double from = away * bound, off = from + 2 * surface_gap;
        // All levels before it are blocked.
        double level = from + std::max(least_move, surface_gap);
        for (const double most = most_level(shell_, side);;) {
            if (!(level <= most)) refuse_open_level();
            const double end = level + window * ratio_;
            const Points points = points_for(between(away * level, away * end), parts.next(0.4));
            level = first_free_of_sample(points, between(away * level, away * end), off, away, level);
            while (level <= end) {
                const double far = std::min(end, level + step * ratio_);
                const SurfaceRange levels = between(away * level, away * far);
                CertifiedLevel found{0, cells_of(points, levels, 1), levels, {}};
                if (find_free(side, off, far, found, level, parts)) return found;
            }
        }
    }

    double enclosing_move(SurfaceSide side, double bound, const Vec3& p) const override {
        octree::Cell at;
        for (int axis = 0; axis < 3; ++axis) {
            auto& i = at[std::size_t(axis)];
            i = std::uint32_t(
                std::clamp((p[axis] - grid().origin[axis]) / grid().step, 0.0, grid().cells - 1.0));
            while (i > 0 && grid().position(axis, i) > p[axis]) --i;
            while (i + 1 < grid().cells && grid().position(axis, i + 1) < p[axis]) ++i;
        }
        const int away = side == SurfaceSide::outer ? 1 : -1;
        double move = 0;
        for (std::uint32_t c = 0; c < 8; ++c)
            move = std::max(move,
                            away * (value({at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)}) - bound));
        return move + surface_gap;
    }

private:
    static constexpr double window = 1.5, step = 0.25;  // cells of this lattice
    static constexpr std::uint64_t chunk_stride = 16;   // of a sample of chunks of points
    static constexpr std::size_t stride = 64;           // of a sample of cells

    /// What is counted as long as it is kept.
    struct Points {
        std::vector<LatticePoint> points;
        Taken taken;
    };

    /// f changes by about the distance, and corners of a cell are √3 widths apart at most: what is farther off
    /// is looked at only where a level seems to run to it.
    double reach() const { return 1.75 * ratio_; }

    static SurfaceRange between(double a, double b) { return {std::min(a, b), std::max(a, b)}; }

    /// For the cells of these levels.
    Points points_for(const SurfaceRange& levels, const Progress& progress) const {
        std::vector<LatticePoint> points =
            find_lattice_points(shell_.octree, shell_.field, ratio_, grid().cells, levels.lower - reach(),
                                levels.upper + reach(), guard_, progress);
        const std::uint64_t bytes = sizeof(LatticePoint) * points.size();
        return {std::move(points), Taken(guard_, bytes)};
    }

    /// All cells that these levels run through; or some, of every so many chunks of points.
    std::vector<LevelCell> cells_of(const Points& of, const SurfaceRange& levels, std::uint64_t every) const {
        const std::vector<LatticePoint>& points = of.points;
        const Assembler assembler(points, grid().cells, levels, reach());
        Taken taken(guard_, 0);
        const std::uint64_t chunks = chunk_count(points.size(), cell_grain);
        std::vector<std::vector<LevelCell>> found(chunks);
        std::vector<std::vector<std::uint64_t>> missing(chunks);
        for_chunks(points.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            if (chunk % every != 0) return;
            assembler.run(
                begin, end, [&](const octree::Cell& p) { return value(p); }, found[chunk], missing[chunk]);
            taken.add(sizeof(LevelCell) * found[chunk].size());  // and given back as they are joined
        });
        std::vector<LevelCell> all = joined(found);
        if (every > 1) return all;
        std::vector<std::uint64_t> fresh = joined(missing);
        if (!fresh.empty()) add_missing(assembler, fresh, all);
        return all;
    }

    /// A level from `level` on; the levels before it are blocked.
    double first_free_of_sample(const Points& points, const SurfaceRange& levels, double off, int away,
                                double level) const {
        std::vector<Blocked> blocked =
            blocked_levels(cells_of(points, levels, chunk_stride), off, away, level, {});
        sort_by_low(blocked);
        return first_free(blocked, level);
    }

    /// Whether a level up to `far` is free, with the cells that it runs through; else it is the next to look
    /// at.
    bool find_free(SurfaceSide side, double off, double far, CertifiedLevel& found, double& level,
                   Parts& parts) const {
        const int away = side == SurfaceSide::outer ? 1 : -1;
        const double most = most_level(shell_, side);
        std::vector<Blocked> blocked = blocked_levels(found.cells, off, away, level, parts.next(0.4));
        keep_decisive(blocked, level);
        for (; level <= far; level += ratio_ / 32) {
            level = first_free(blocked, level);
            if (!(level <= most)) refuse_open_level();
            if (level > far) return false;
            const SurfaceFrame frame{grid(), side, away * level};
            if (!stars_are_beyond(frame, found.cells, away * off)) continue;
            found.level = frame.level;
            found.range = {away * off, away * off};
            std::erase_if(found.cells, [&](const LevelCell& cell) { return !is_crossed(cell, frame.level); });
            return true;
        }
        return false;
    }

    static bool is_crossed(const LevelCell& cell, double level) {
        const auto [least, most] = std::minmax_element(cell.value.begin(), cell.value.end());
        return *least < level && *most >= level;
    }

    /// Of each cell: the result twice, what matters, and where it is, in one region or more.
    static constexpr std::uint64_t bytes_per_reach = 24 + 20;
    /// Of each cell: bounds by its pieces twice, by both, bend, and where it is, in one region or more.
    static constexpr std::uint64_t bytes_per_quick = sizeof(Quick) + 2 * 16 + 8 + 20;

    /// Cells whose triangles are bounded at most: each goes through as many finest cells as its square.
    std::uint64_t most_refined() const {
        return std::uint64_t(std::clamp(4096 / (ratio_ * ratio_), 64.0, 4096.0));
    }

    template <class T>
    static std::vector<T> joined(std::vector<std::vector<T>>& parts) {
        std::uint64_t size = 0;
        for (const auto& part : parts) size += part.size();
        std::vector<T> all;
        all.reserve(size);
        for (auto& part : parts) {
            all.insert(all.end(), part.begin(), part.end());
            std::vector<T>().swap(part);
        }
        return all;
    }

    /// Of each cell; of levels before `level` nothing is said.
    std::vector<Blocked> blocked_levels(std::span<const LevelCell> cells, double bound, int away, double level,
                                        const Progress& progress) const {
        const Taken taken(guard_, (sizeof(Blocked) + bytes_per_reach) * cells.size());
        std::vector<double> matters(cells.size());
        parallel_for(cells.size(), cell_grain,
                     [&](std::uint64_t i) { matters[i] = level - bend(cells[i]) - surface_gap; });
        const std::vector<double> reaches = pieces_.reaches(cells, bound, away, matters, progress);
        std::vector<Blocked> all(cells.size());
        parallel_for(cells.size(), cell_grain, [&](std::uint64_t i) {
            double low = away * cells[i].value[0], high = low;
            for (const double v : cells[i].value) {
                low = std::min(low, away * v);
                high = std::max(high, away * v);
            }
            // Triangles are where g ≥ level − bend(cell).
            all[i] = {low, std::min(high, reaches[i] + bend(cells[i]))};
        });
        return all;
    }

    static void sort_by_low(std::vector<Blocked>& blocked) {
        std::sort(blocked.begin(), blocked.end(),
                  [](const Blocked& a, const Blocked& b) { return a.low < b.low; });
    }

    /// A sample blocks some levels from `level` on, which moves to the first that it does not; then those
    /// remain, in order, that block later ones: few.
    static void keep_decisive(std::vector<Blocked>& blocked, double& level) {
        std::vector<Blocked> sample;
        for (std::size_t i = 0; i < blocked.size(); i += stride) sample.push_back(blocked[i]);
        sort_by_low(sample);
        level = first_free(sample, level);
        std::erase_if(blocked, [&](const Blocked& b) { return b.high < level; });
        sort_by_low(blocked);
    }

    /// The least level from `level` on that no cell blocks.
    static double first_free(const std::vector<Blocked>& blocked, double level) {
        for (const Blocked& b : blocked) {
            if (b.low > level) break;
            if (b.high >= level) level = b.high + surface_gap;
        }
        return level;
    }

    /// How far g on the cell's triangles, if it is no star, may be from the level.
    double bend(const LevelCell& cell) const {
        double largest = 0;
        for (const double v : cell.value) largest = std::max(largest, std::abs(v));
        const double slope = steepest(cell.value.data());
        // Differences of values, and local coordinates of vertices, which err by local_roundings·u.
        const double error =
            unit_roundoff * (geometry::control_roundings * largest + 3 * local_roundings * slope);
        return curvature(cell.value.data()) + grid().displacement() * slope + error;
    }

    bool stars_are_beyond(const SurfaceFrame& frame, std::span<const LevelCell> cells, double bound) const {
        std::vector<std::uint8_t> beyond(chunk_count(cells.size(), cell_grain), 1);
        const bool outer = frame.side == SurfaceSide::outer;
        for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            std::array<double, 8> value;
            for (std::uint64_t i = begin; i < end && beyond[chunk]; ++i) {
                if (!crossing_of(cells[i], frame.level, value).star) continue;
                Hull hull(frame.level, outer ? RangeEnds::lower : RangeEnds::upper);
                double error = 0;
                include_triangles(frame, cells[i], hull, error);
                beyond[chunk] = outer ? hull.range().lower - error > bound : hull.range().upper + error < bound;
            }
        });
        return std::find(beyond.begin(), beyond.end(), 0) == beyond.end();
    }

    void include_triangles(const SurfaceFrame& frame, const LevelCell& cell, Hull& hull, double& error) const {
        CellSurface surface;
        make_cell_surface(frame, cell, surface);
        std::array<Vec3, patch_vertices> at;
        for (int v = 0; v < patch_vertices; ++v)
            if (surface.crossing.has(v))
                at[std::size_t(v)] = shell_.lattice.to_lattice(
                    vertex_position(frame.grid, cell.at, surface.value, surface.crossing, frame.side, v));
        std::array<TriangleBounder::Corners, Patch::capacity> triangles;
        const auto size = std::size_t(surface.patch.size);
        for (std::size_t t = 0; t < size; ++t) {
            const auto& c = surface.patch.triangle[t];
            triangles[t] = {at[c[0]], at[c[1]], at[c[2]]};
        }
        bounder_.include(std::span(triangles).first(size), hull, error);
    }

    /// Of the cells that the level runs through: stars, of which nothing is known, then some of the worst in
    /// order, and the rest.
    std::vector<Quick> quick_bounds(const SurfaceFrame& frame, std::span<const LevelCell> cells, RangeEnds ends,
                                    const Progress& progress) const {
        const Taken taken(guard_, bytes_per_quick * cells.size());
        std::vector<double> bends(cells.size());
        parallel_for(cells.size(), cell_grain, [&](std::uint64_t i) { bends[i] = bend(cells[i]); });
        const std::vector<SurfaceRange> ranges = pieces_.ranges(cells, frame.level, bends, progress);
        std::vector<Quick> quick;
        quick.reserve(cells.size());
        std::array<double, 8> value;
        for (std::uint32_t i = 0; i < cells.size(); ++i)
            if (is_crossed(cells[i], frame.level))
                quick.push_back({i, crossing_of(cells[i], frame.level, value).star, ranges[i]});
        const auto badness = [&](const Quick& q) {
            constexpr double infinity = std::numeric_limits<double>::infinity();
            const double below = frame.level - q.range.lower, above = q.range.upper - frame.level;
            if (q.star) return infinity;
            return ends == RangeEnds::both ? std::max(below, above) : ends == RangeEnds::lower ? below : above;
        };
        const auto is_worse = [&](const Quick& a, const Quick& b) {
            const double x = badness(a), y = badness(b);
            return x != y ? x > y : a.cell < b.cell;
        };
        const auto ordinary = std::partition(quick.begin(), quick.end(), [](const Quick& q) { return q.star; });
        const auto some = std::min<std::ptrdiff_t>(quick.end() - ordinary, std::ptrdiff_t(most_refined()));
        std::partial_sort(ordinary, ordinary + some, quick.end(), is_worse);
        return quick;
    }

    /// f at a lattice point.
    double value(const octree::Cell& point) const {
        const double side = shell_.lattice.cells();
        Vec3 u;
        for (int axis = 0; axis < 3; ++axis) u[axis] = std::min(point[std::size_t(axis)] * ratio_, side);
        const field::TrilinearCell cell = field::locate(shell_.octree, shell_.field, u);
        return geometry::trilinear(cell.value, (1.0 / cell.width) * (u - cell.corner));
    }

    /// Cells that a level runs through, beyond crossed faces of others, until there are no more.
    /// \param all  in the order of keys; the others follow
    void add_missing(const Assembler& assembler, std::vector<std::uint64_t> fresh,
                     std::vector<LevelCell>& all) const {
        std::vector<std::uint64_t> known;
        known.reserve(all.size());
        for (const LevelCell& cell : all) known.push_back(key_of(cell.at));
        while (!fresh.empty()) {
            parallel_sort(fresh);
            fresh.erase(std::unique(fresh.begin(), fresh.end()), fresh.end());
            std::erase_if(
                fresh, [&](std::uint64_t key) { return std::binary_search(known.begin(), known.end(), key); });
            const auto middle = std::ptrdiff_t(known.size());
            known.insert(known.end(), fresh.begin(), fresh.end());
            std::inplace_merge(known.begin(), known.begin() + middle, known.end());
            fresh = add_crossed(assembler, fresh, all);
        }
    }

    /// Of the cells with these keys those that a level runs through; returns those beyond their crossed faces.
    std::vector<std::uint64_t> add_crossed(const Assembler& assembler, std::span<const std::uint64_t> keys,
                                           std::vector<LevelCell>& all) const {
        std::vector<std::uint64_t> beyond;
        for (const std::uint64_t key : keys) {
            LevelCell cell{cell_of(key), {}};
            for (std::uint32_t c = 0; c < 8; ++c)
                cell.value[c] = value({cell.at[0] + (c & 1), cell.at[1] + (c >> 1 & 1), cell.at[2] + (c >> 2)});
            if (!assembler.crossed(cell)) continue;
            all.push_back(cell);
            for (std::size_t axis = 0; axis < 3; ++axis)
                for (unsigned side = 0; side < 2; ++side) {
                    octree::Cell at = cell.at;
                    at[axis] += side == 1 ? 1 : ~std::uint32_t{0};
                    if (at[axis] < grid().cells && assembler.crossed(cell, axis, side))
                        beyond.push_back(key_of(at));
                }
        }
        return beyond;
    }

    const shell::ShellData& shell_;
    double ratio_;  // width of a cell in finest cells
    MemoryGuard& guard_;
    CellPieces pieces_;
    TriangleBounder bounder_;
};

}  // namespace

std::unique_ptr<LevelSource> resampled_source(const shell::ShellData& shell, int resolution,
                                              const Rounding& rounding, MemoryGuard& guard) {
    return std::make_unique<ResampledSource>(shell, resolution, rounding, guard);
}

}  // namespace its::surface
