#include <algorithm>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "base/progress.h"
#include "base/rounding.h"
#include "geometry/clip.h"
#include "geometry/vec3.h"
#include "surface/cell_pieces.h"
#include "surface/coarse_cells.h"
#include "surface/level_search.h"
#include "surface/level_source.h"
#include "surface/memory_guard.h"
#include "surface/polygonise.h"

namespace its::surface {

namespace {

constexpr std::uint64_t cell_grain = 1024, fine_grain = 8;

/// Cells of a lattice whose cells are `ratio` finest cells wide, as index ranges [low, high].
struct CellRange {
    std::array<std::uint32_t, 3> low, high;
};

/// Keys of the cells of the coarser or finer lattice in which one finest cell may take a level.
class Overlap {
public:
    Overlap(const LevelCell& cell, double ratio, std::uint32_t side, double low, double high,
            std::vector<std::uint64_t>& keys)
        : cell_(cell), ratio_(ratio), low_(low), high_(high), keys_(keys) {
        CellRange all;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            all.low[axis] = index(std::floor((cell.at[axis] - slack) / ratio), side);
            all.high[axis] = index(std::floor((cell.at[axis] + 1 + slack) / ratio), side);
        }
        visit(all);
    }

private:
    /// In finest cells, and relative to values: far more than the rounding of any position or value here; cells
    /// too many do no harm, and what should still be missed is found from its neighbours.
    static constexpr double slack = 0x1p-20;

    static std::uint32_t index(double i, std::uint32_t side) {
        return std::uint32_t(std::clamp(i, 0.0, double(side - 1)));
    }

    void visit(const CellRange& range) {
        if (!crossed(range)) return;
        std::size_t longest = 0;
        for (std::size_t axis = 1; axis < 3; ++axis)
            if (range.high[axis] - range.low[axis] > range.high[longest] - range.low[longest]) longest = axis;
        if (range.high[longest] == range.low[longest]) return keys_.push_back(key_of(range.low));
        const std::uint32_t middle = range.low[longest] + (range.high[longest] - range.low[longest]) / 2;
        CellRange half = range;
        half.high[longest] = middle;
        visit(half);
        half = range;
        half.low[longest] = middle + 1;
        visit(half);
    }

    /// Whether f, trilinear in the finest cell, may take a level in its part in the range.
    bool crossed(const CellRange& range) const {
        Vec3 from, to;
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = std::size_t(axis);
            from[axis] = std::clamp(range.low[a] * ratio_ - cell_.at[a] - slack, 0.0, 1.0);
            to[axis] = std::clamp((range.high[a] + 1.0) * ratio_ - cell_.at[a] + slack, 0.0, 1.0);
        }
        double least = geometry::trilinear(cell_.value.data(), from), most = least;
        for (int c = 1; c < 8; ++c) {
            const Vec3 p{c & 1 ? to.x : from.x, c & 2 ? to.y : from.y, c & 4 ? to.z : from.z};
            const double value = geometry::trilinear(cell_.value.data(), p);
            least = std::min(least, value);
            most = std::max(most, value);
        }
        return least - slack < high_ && most + slack >= low_;
    }

    const LevelCell& cell_;
    double ratio_, low_, high_;
    std::vector<std::uint64_t>& keys_;
};

/// Bounds f over one triangle by descending to the cells on which f is trilinear.
class TriangleBounder {
public:
    explicit TriangleBounder(const shell::ShellData& shell)
        : shell_(shell),
          clipping_((geometry::cuts * geometry::roundings_per_cut + geometry::roundings_of_vertices) *
                    unit_roundoff * shell.lattice.cells()),
          margin_(shell.lattice.mapping_error() + clipping_) {}

    /// \param p, q, r  in lattice coordinates, as rounded by to_lattice
    void include(const Vec3& p, const Vec3& q, const Vec3& r, Hull& hull, double& error) const {
        // The smallest octree box that has the triangle's dilated bounds: where the indices of its ends differ.
        std::array<std::uint32_t, 3> low;
        std::uint32_t differing = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double least = std::min({p[axis], q[axis], r[axis]}) - margin_,
                         most = std::max({p[axis], q[axis], r[axis]}) + margin_;
            const double last = shell_.lattice.cells() - 1.0;
            low[std::size_t(axis)] = std::uint32_t(std::clamp(std::floor(least), 0.0, last));
            differing |= low[std::size_t(axis)] ^ std::uint32_t(std::clamp(std::floor(most), 0.0, last));
        }
        const int level = std::bit_width(differing);
        std::array<double, 3> corner;
        for (std::size_t axis = 0; axis < 3; ++axis) corner[axis] = double(low[axis] >> level << level);
        visit({p, q, r}, corner, level, hull, error);
    }

private:
    struct Corners {
        Vec3 p, q, r;
    };

    void visit(const Corners& t, const std::array<double, 3>& corner, int level, Hull& hull,
               double& error) const {
        const double width = std::ldexp(1.0, level);
        for (int axis = 0; axis < 3; ++axis) {
            const double low = std::min({t.p[axis], t.q[axis], t.r[axis]}),
                         high = std::max({t.p[axis], t.q[axis], t.r[axis]});
            if (high < corner[std::size_t(axis)] - margin_ || low > corner[std::size_t(axis)] + width + margin_)
                return;
        }
        const Vec3 centre{corner[0] + 0.5 * width, corner[1] + 0.5 * width, corner[2] + 0.5 * width};
        const field::TrilinearCell cell = field::locate(shell_.octree, shell_.field, centre);
        if (cell.width >= width) return include_in_cell(t, cell, hull, error);
        for (int child = 0; child < 8; ++child) {
            std::array<double, 3> at = corner;
            for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += child >> axis & 1 ? 0.5 * width : 0.0;
            visit(t, at, level - 1, hull, error);
        }
    }

    void include_in_cell(const Corners& t, const field::TrilinearCell& cell, Hull& hull, double& error) const {
        const auto local = [&](const Vec3& v) { return (1.0 / cell.width) * (v - cell.corner); };
        const geometry::Polygon polygon = geometry::clip_to_cell(local(t.p), local(t.q), local(t.r), margin_);
        if (polygon.size == 0) return;
        // As γ of the extremes, docs/design/extremes.md: the slope times the displacement of the point, and the
        // roundings of the control values and of the corner values.
        double largest = 0;
        for (const double v : cell.value) largest = std::max(largest, std::abs(v));
        const double displacement = margin_ + clipping_ + 2 * Hull::max_halvings * unit_roundoff;
        const double corner_roundings = geometry::trilinear_roundings * (shell_.lattice.depth + 1);
        error = std::max(error, 4 * steepest(cell.value) * displacement +
                                    geometry::control_roundings * unit_roundoff * largest +
                                    corner_roundings * unit_roundoff * std::ldexp(4.0, shell_.lattice.depth));
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

class ResampledSource : public LevelSource {
public:
    ResampledSource(const shell::ShellData& shell, int resolution, const Rounding& rounding, MemoryGuard& guard)
        : LevelSource(shell.lattice, shell.lattice.scale() / resolution,
                      std::uint32_t(resolution) << (1 + shell.lattice.room), rounding),
          shell_(shell),
          ratio_(double(shell.lattice.scale_cells()) / resolution),
          guard_(guard),
          pieces_(shell, grid()),
          bounder_(shell) {
        if (ratio_ > 1) coarse_.emplace(shell.octree, shell.field, ratio_, grid().cells);
    }

    std::vector<LevelCell> cells(double low, double high, const Progress& progress) const override {
        Parts parts(progress);
        std::vector<std::uint64_t> keys =
            coarse_ ? coarse_->find(low, high) : candidates(low, high, parts.until(0.4));
        std::vector<LevelCell> all;
        // A level that a rounded value meets on one side only would leave a gap: cells beyond a crossed face
        // that are not candidates join, until there are none.
        for (std::vector<std::uint64_t> fresh = keys; !fresh.empty();) {
            const std::vector<LevelCell> found = evaluate(fresh, low, high, parts.next(0.8));
            const Taken taken(guard_, sizeof(LevelCell) * (all.size() + found.size()) + 16 * keys.size());
            all.insert(all.end(), found.begin(), found.end());
            fresh = missing_neighbours(found, keys, low, high);
            const auto middle = std::ptrdiff_t(keys.size());
            keys.insert(keys.end(), fresh.begin(), fresh.end());
            std::inplace_merge(keys.begin(), keys.begin() + middle, keys.end());
        }
        return all;
    }

    /// Most cells are bounded by how far f is from their trilinear function; the rest by their triangles, those
    /// that may be worst first.
    SurfaceRange bound(const SurfaceFrame& frame, std::span<const LevelCell> cells, RangeEnds ends,
                       const Progress& progress) const override {
        Stage stage(progress, "surface bounds", cells.size());
        const std::uint64_t chunks = chunk_count(cells.size(), cell_grain);
        std::vector<Hull> parts(chunks, Hull(frame.level, ends));
        std::vector<double> errors(chunks, 0.0);
        for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            bound_cells(frame, cells.subspan(begin, end - begin), parts[chunk], errors[chunk]);
            stage.advance(end - begin);
        });
        SurfaceRange range{frame.level, frame.level};
        double error = 0;
        for (std::uint64_t chunk = 0; chunk < chunks; ++chunk) {
            range.lower = std::min(range.lower, parts[chunk].range().lower);
            range.upper = std::max(range.upper, parts[chunk].range().upper);
            error = std::max(error, errors[chunk]);
        }
        return {range.lower - error, range.upper + error};
    }

    /// No search: each cell says which levels it cannot have, docs/design/surface.md.
    CertifiedLevel certified_level(SurfaceSide side, double bound, double least_move,
                                   const Progress& progress) const override {
        Parts parts(progress);
        const int away = side == SurfaceSide::outer ? 1 : -1;
        const double from = away * bound, most = most_level(shell_, side);
        double level = from + std::max(least_move, surface_gap);
        for (double reach = std::max(first_reach * ratio_, level - from);; reach *= 2) {
            const double far = from + reach;
            const SurfaceRange levels{std::min(away * from, away * far), std::max(away * from, away * far)};
            CertifiedLevel found{0, cells(levels.lower, levels.upper, parts.next(0.4)), levels, {}};
            const std::vector<Blocked> blocked =
                blocked_levels(found.cells, from + 2 * surface_gap, away, parts.next(0.4));
            while (level <= far) {
                level = first_free(blocked, level);
                if (!(level <= most)) refuse_open_level();
                if (level > far) break;
                const SurfaceFrame frame{grid(), side, away * level};
                if (stars_are_beyond(frame, found.cells, bound)) {
                    found.level = frame.level;
                    found.range = this->bound(frame, found.cells,
                                              side == SurfaceSide::outer ? RangeEnds::lower : RangeEnds::upper,
                                              parts.next(0.4));
                    return found;
                }
                level += ratio_ / 32;
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
    static constexpr double first_reach = 0.75;  // cells of this lattice

    std::vector<Blocked> blocked_levels(std::span<const LevelCell> cells, double bound, int away,
                                        const Progress& progress) const {
        Stage stage(progress, "surface levels", cells.size());
        std::vector<Blocked> all(cells.size());
        for_chunks(cells.size(), cell_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t i = begin; i < end; ++i) {
                const LevelCell& cell = cells[i];
                double low = away * cell.value[0], high = low;
                for (const double v : cell.value) {
                    low = std::min(low, away * v);
                    high = std::max(high, away * v);
                }
                // Triangles are where g ≥ level − bend(cell).
                const double reach = pieces_.reach(cell, bound, away) + bend(cell);
                all[i] = {low, std::min(high, reach)};
            }
            stage.advance(end - begin);
        });
        std::sort(all.begin(), all.end(), [](const Blocked& a, const Blocked& b) { return a.low < b.low; });
        return all;
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
        for (int t = 0; t < surface.patch.size; ++t) {
            const auto& c = surface.patch.triangle[std::size_t(t)];
            bounder_.include(at[c[0]], at[c[1]], at[c[2]], hull, error);
        }
    }

    /// A cell that the level runs through, and bounds of f on its triangles that cost little.
    struct Quick {
        std::uint32_t cell;
        bool star;
        double lower, upper;
    };

    void bound_cells(const SurfaceFrame& frame, std::span<const LevelCell> cells, Hull& hull,
                     double& error) const {
        std::vector<Quick> quick;
        std::array<double, 8> value;
        for (std::size_t i = 0; i < cells.size(); ++i) {
            const Crossing crossing = crossing_of(cells[i], frame.level, value);
            if (crossing.below == 0 || crossing.below == 0xff) continue;
            const double away = bend(cells[i]), infinity = std::numeric_limits<double>::infinity();
            Quick q{std::uint32_t(i), crossing.star, -infinity, infinity};
            if (!q.star) {
                const auto [below, above] =
                    pieces_.difference(cells[i], frame.level - away, frame.level + away);
                q.lower = frame.level - away + below;
                q.upper = frame.level + away + above;
            }
            quick.push_back(q);
        }
        const auto badness = [&](const Quick& q) {
            return std::max(frame.level - q.lower, q.upper - frame.level);
        };
        std::stable_sort(quick.begin(), quick.end(),
                         [&](const Quick& a, const Quick& b) { return badness(a) > badness(b); });
        for (const Quick& q : quick)
            if (q.star || !hull.include_if_within(q.lower, q.upper))
                include_triangles(frame, cells[q.cell], hull, error);
    }

    /// Every edge on which f passes a level goes through a finest cell that the level runs through.
    std::vector<std::uint64_t> candidates(double low, double high, const Progress& progress) const {
        const std::vector<LevelCell> finest =
            find_level_cells(shell_.octree, shell_.field, low, high, progress);
        // A finest cell may have many: few at a time, so that they can be counted in time.
        Taken taken(guard_, sizeof(LevelCell) * finest.size());
        std::vector<std::vector<std::uint64_t>> parts(chunk_count(finest.size(), fine_grain));
        for_chunks(finest.size(), fine_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t i = begin; i < end; ++i)
                Overlap(finest[i], ratio_, grid().cells, low, high, parts[chunk]);
            taken.add(2 * sizeof(std::uint64_t) * parts[chunk].size());  // and once more when they are joined
        });
        std::vector<std::uint64_t> keys;
        for (const auto& part : parts) keys.insert(keys.end(), part.begin(), part.end());
        parallel_sort(keys);
        keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
        return keys;
    }

    /// f at a lattice point.
    double value(const octree::Cell& point) const {
        const double side = shell_.lattice.cells();
        Vec3 u;
        for (int axis = 0; axis < 3; ++axis) u[axis] = std::min(point[std::size_t(axis)] * ratio_, side);
        const field::TrilinearCell cell = field::locate(shell_.octree, shell_.field, u);
        return geometry::trilinear(cell.value, (1.0 / cell.width) * (u - cell.corner));
    }

    /// The cells with these keys that a level in [low, high] runs through.
    std::vector<LevelCell> evaluate(const std::vector<std::uint64_t>& keys, double low, double high,
                                    const Progress& progress) const {
        Stage stage(progress, "surface values", keys.size());
        Taken taken(guard_, 0);
        std::vector<std::vector<LevelCell>> parts(chunk_count(keys.size(), cell_grain));
        for_chunks(keys.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t i = begin; i < end; ++i) {
                LevelCell cell{cell_of(keys[i]), {}};
                for (std::uint32_t c = 0; c < 8; ++c)
                    cell.value[c] =
                        value({cell.at[0] + (c & 1), cell.at[1] + (c >> 1 & 1), cell.at[2] + (c >> 2)});
                const auto [least, most] = std::minmax_element(cell.value.begin(), cell.value.end());
                if (*least < high && *most >= low) parts[chunk].push_back(cell);
            }
            taken.add(sizeof(LevelCell) * parts[chunk].size());
            stage.advance(end - begin);
        });
        taken.add(sizeof(LevelCell) * (taken.bytes() / sizeof(LevelCell)));
        std::vector<LevelCell> cells;
        for (const auto& part : parts) cells.insert(cells.end(), part.begin(), part.end());
        return cells;
    }

    std::vector<std::uint64_t> missing_neighbours(const std::vector<LevelCell>& cells,
                                                  const std::vector<std::uint64_t>& known, double low,
                                                  double high) const {
        std::vector<std::uint64_t> missing;
        for (const LevelCell& cell : cells)
            for (unsigned face = 0; face < 6; ++face) {
                const unsigned axis = face / 2, side = face % 2;
                double least = 1e300, most = -1e300;
                for (unsigned c = 0; c < 8; ++c)
                    if ((c >> axis & 1) == side) {
                        least = std::min(least, cell.value[c]);
                        most = std::max(most, cell.value[c]);
                    }
                if (!(least < high && most >= low)) continue;
                octree::Cell at = cell.at;
                at[axis] += side == 1 ? 1 : ~std::uint32_t{0};
                if (at[axis] >= grid().cells) continue;
                const std::uint64_t key = key_of(at);
                if (!std::binary_search(known.begin(), known.end(), key)) missing.push_back(key);
            }
        std::sort(missing.begin(), missing.end());
        missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
        return missing;
    }

    const shell::ShellData& shell_;
    double ratio_;  // width of a cell in finest cells
    MemoryGuard& guard_;
    CellPieces pieces_;
    TriangleBounder bounder_;
    std::optional<CoarseCells> coarse_;
};

}  // namespace

std::unique_ptr<LevelSource> resampled_source(const shell::ShellData& shell, int resolution,
                                              const Rounding& rounding, MemoryGuard& guard) {
    return std::make_unique<ResampledSource>(shell, resolution, rounding, guard);
}

}  // namespace its::surface
