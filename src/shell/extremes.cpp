#include "shell/extremes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/progress.h"
#include "base/rounding.h"
#include "geometry/bernstein.h"
#include "geometry/clip.h"
#include "geometry/fan_batch.h"
#include "shell/candidates.h"

namespace its::shell {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr geometry::Bounds nothing{infinity, -infinity, infinity, -infinity};
constexpr std::uint64_t group_grain = 256;
constexpr std::uint64_t cell_grain = 16384, paper_grain = 1024;
constexpr std::uint64_t refined_at_once = 64;  // cells refined between two updates of the attained extremes
constexpr std::size_t max_pieces = 1 << 17;    // of a cell; beyond it the bounds reached so far stand
constexpr int max_halvings = 48;               // likewise; edges are then 2⁻⁴⁸ cells, far below the gap

/// Roundings, of coordinates below 17/16 < 2, that the halvings add to a piece's vertices, in units of u.
constexpr double roundings_of_halvings = 2 * max_halvings;

/// A surface cell and the polygons that M leaves in it.
struct CellView {
    std::uint64_t cell;  // number of the surface cell
    Vec3 corner;
    double width;  // a power of two
    std::array<double, 8> value;
};

/// Surface cells, polygons and bounds of one mesh.
class Surface {
public:
    Surface(const octree::Lattice& lattice, const octree::Octree& octree, const field::Field& field,
            std::span<const Vec3> positions, std::span<const Triangle> triangles,
            std::span<const std::uint64_t> offset, std::span<const std::uint32_t> triangle)
        : octree_(octree),
          field_(field),
          positions_(positions),
          triangles_(triangles),
          offset_(offset),
          triangle_(triangle) {
        const double clipping = geometry::clipping_error(lattice.cells());
        margin_ = lattice.dilation() + clipping;
        displacement_ = lattice.point_error() + 2 * clipping;
    }

    /// Levels that have surface cells: those below this one.
    int levels() const { return octree_.adaptive() ? octree_.depth + 1 : 1; }
    std::uint64_t groups(int level) const { return octree_.levels[std::size_t(level)].groups(); }
    unsigned mask(int level, std::uint64_t group) const { return octree_.surface_mask(level, group); }
    std::uint64_t first(int level, std::uint64_t group) const {
        return octree_.first_surface_cell(level, group);
    }
    std::uint64_t cells() const { return octree_.surface_cells(); }

    /// A point of M and the point of a piece that stands for it, in a cell of this width, differ by this per
    /// axis.
    double displacement(double width) const {
        return displacement_ + roundings_of_halvings * unit_roundoff * width;
    }

    CellView view(const octree::CellPlace& place, std::uint64_t cell) const {
        CellView v{.cell = cell, .corner = {}, .width = std::ldexp(1.0, place.level), .value = {}};
        const octree::Level& level = octree_.levels[std::size_t(place.level)];
        const octree::Cell at =
            octree::morton_decode(level.parent[place.group] << 3 | std::uint64_t(place.child));
        v.corner = {v.width * at[0], v.width * at[1], v.width * at[2]};
        const double* const values =
            &field_.values[std::size_t(place.level)][octree::group_points * place.group];
        for (int c = 0; c < 8; ++c) v.value[std::size_t(c)] = values[octree::group_point(place.child, c)];
        return v;
    }

    CellView view(std::uint64_t cell) const { return view(octree_.surface_place(cell), cell); }

    /// fn(polygon) for each triangle's part in the cell, local coordinates.
    template <class F>
    void for_polygons(const CellView& v, F&& fn) const {
        for (std::uint64_t p = offset_[v.cell]; p < offset_[v.cell + 1]; ++p) {
            const Triangle& t = triangles_[triangle_[p]];
            geometry::Polygon polygon;
            const double scale = 1 / v.width;
            geometry::clip_to_cell(scale * (positions_[t[0]] - v.corner), scale * (positions_[t[1]] - v.corner),
                                   scale * (positions_[t[2]] - v.corner), scale * margin_, polygon);
            if (polygon.size > 0) fn(polygon);
        }
    }

private:
    const octree::Octree& octree_;
    const field::Field& field_;
    std::span<const Vec3> positions_;
    std::span<const Triangle> triangles_;
    std::span<const std::uint64_t> offset_;
    std::span<const std::uint32_t> triangle_;
    double margin_, displacement_;
};

/// The two numbers that γ needs: the most that f changes by the displacement along an edge of a cell, and the
/// largest corner value.
struct Steepness {
    double change = 0, value = 0;

    void include(const Surface& surface, const CellView& cell) {
        double slope = 0;  // times the cell's width
        const auto& v = cell.value;
        for (std::size_t c = 0; c < 8; ++c) {
            value = std::max(value, std::abs(v[c]));
            for (const std::size_t step : {1, 2, 4})
                if (!(c & step)) slope = std::max(slope, std::abs(v[c | step] - v[c]));
        }
        change = std::max(change, slope / cell.width * surface.displacement(cell.width));
    }
    void include(const Steepness& other) {
        change = std::max(change, other.change);
        value = std::max(value, other.value);
    }
};

/// γ: how far f̂, as shipped, at a point of M may lie outside the control values' range. The slope of a
/// trilinear function is a mean of those of its edges, so f moves by at most slope × displacement per axis;
/// outside the cell by `margin` ≪ 1/16 it grows by less than (9/8)² ≤ 4/3. Both evaluation and control values
/// round.
double rounding_error(const Steepness& s) {
    return 3 * (4.0 / 3.0) * s.change +
           (geometry::trilinear_roundings + geometry::control_roundings) * unit_roundoff * s.value;
}

}  // namespace

double rounding_error(const octree::Lattice& lattice, double slope, double width, double value) {
    const double clipping = geometry::clipping_error(lattice.cells());
    const double displacement =
        lattice.point_error() + 2 * clipping + roundings_of_halvings * unit_roundoff * width;
    return rounding_error(Steepness{slope * displacement, value});
}

namespace {

float rounded_down(double x) {
    const float f = float(x);
    return double(f) <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
float rounded_up(double x) {
    return -rounded_down(-x);
}

/// fn(p, q, r) for each triangle of the polygon's fan; a polygon that is a point or a segment gives one.
template <class F>
void for_fan(const double* corners, const geometry::Polygon& polygon, F&& fn) {
    const geometry::Sample apex = geometry::sample(corners, polygon.vertex(0));
    geometry::Sample last = geometry::sample(corners, polygon.vertex(std::min(1, polygon.size - 1)));
    if (polygon.size < 3) fn(apex, last, last);
    for (int i = 2; i < polygon.size; ++i) {
        const geometry::Sample next = geometry::sample(corners, polygon.vertex(i));
        fn(apex, last, next);
        last = next;
    }
}

/// Branch and bound in one cell: subdivides the polygons where a bound exceeds the attained extremes by more
/// than the gap. Returns the cell's bounds, at least as tight as before.
geometry::Bounds refine(const Surface& surface, const CellView& view, double least, double most) {
    struct Piece {
        geometry::Sample p, q, r;
        int halvings;
    };
    std::vector<Piece> pieces;
    geometry::Bounds result = nothing;
    const auto place = [&](const geometry::Sample& p, const geometry::Sample& q, const geometry::Sample& r,
                           int halvings) {
        const geometry::Bounds b = geometry::bernstein_bounds(view.value.data(), p, q, r);
        least = std::min(least, b.least);
        most = std::max(most, b.most);
        const bool open = b.upper > most + extreme_gap || b.lower < least - extreme_gap;
        if (open && pieces.size() < max_pieces && halvings < max_halvings)
            pieces.push_back({p, q, r, halvings});
        else
            result.include(b);
        result.least = std::min(result.least, b.least);
        result.most = std::max(result.most, b.most);
    };
    surface.for_polygons(view, [&](const geometry::Polygon& polygon) {
        for_fan(view.value.data(), polygon,
                [&](const geometry::Sample& p, const geometry::Sample& q, const geometry::Sample& r) {
                    place(p, q, r, 0);
                });
    });
    for (std::size_t done = 0; done < pieces.size(); ++done) {
        const Piece t = pieces[done];
        const geometry::Sample pq = geometry::sample(view.value.data(), 0.5 * (t.p.at + t.q.at));
        const geometry::Sample qr = geometry::sample(view.value.data(), 0.5 * (t.q.at + t.r.at));
        const geometry::Sample rp = geometry::sample(view.value.data(), 0.5 * (t.r.at + t.p.at));
        place(t.p, pq, rp, t.halvings + 1);
        place(pq, t.q, qr, t.halvings + 1);
        place(rp, qr, t.r, t.halvings + 1);
        place(pq, qr, rp, t.halvings + 1);
    }
    return result;
}

/// Tightens the cells whose bounds exceed what is attained, the worst first.
void branch_and_bound(const Surface& surface, std::vector<double>& lower, std::vector<double>& upper,
                      double& least, double& most, const Progress& progress) {
    std::vector<std::pair<double, std::uint64_t>> open;
    for (std::uint64_t c = 0; c < lower.size(); ++c) {
        const double excess = std::max(upper[c] - most, least - lower[c]);
        if (excess > extreme_gap) open.emplace_back(-excess, c);
    }
    std::sort(open.begin(), open.end());
    Stage stage(progress, "extremes, refined", open.size());
    std::vector<geometry::Bounds> refined(refined_at_once);
    for (std::uint64_t begin = 0; begin < open.size(); begin += refined_at_once) {
        const std::uint64_t count = std::min<std::uint64_t>(refined_at_once, open.size() - begin);
        // The attained extremes are fixed during a batch: results do not depend on the threads.
        parallel_for(count, 1, [&](std::uint64_t i) {
            const std::uint64_t c = open[begin + i].second;
            const bool still_open = upper[c] > most + extreme_gap || lower[c] < least - extreme_gap;
            refined[i] = still_open ? refine(surface, surface.view(c), least, most) : nothing;
        });
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::uint64_t c = open[begin + i].second;
            least = std::min(least, refined[i].least);
            most = std::max(most, refined[i].most);
            if (refined[i].lower > refined[i].upper) continue;  // skipped
            lower[c] = std::max(lower[c], refined[i].lower);
            upper[c] = std::min(upper[c], refined[i].upper);
        }
        stage.advance(count);
    }
}

/// The paper's way: extremes attained at the candidate points of every polygon.
void paper_extremes(const Surface& surface, double& least, double& most, const Progress& progress) {
    const std::uint64_t cells = surface.cells();
    Stage stage(progress, "extremes", cells);
    std::vector<Range> found(chunk_count(cells, paper_grain), Range{infinity, -infinity, {}, {}});
    for_chunks(cells, paper_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t cell = begin; cell < end; ++cell) {
            const CellView view = surface.view(cell);
            surface.for_polygons(view, [&](const geometry::Polygon& polygon) {
                std::array<Vec3, geometry::Polygon::capacity> vertices;
                for (int i = 0; i < polygon.size; ++i) vertices[std::size_t(i)] = polygon.vertex(i);
                const Range r = candidate_extremes(view.value, {vertices.data(), std::size_t(polygon.size)});
                found[chunk].min = std::min(found[chunk].min, r.min);
                found[chunk].max = std::max(found[chunk].max, r.max);
            });
        }
        stage.advance(end - begin);
    });
    least = infinity;
    most = -infinity;
    for (const Range& r : found) {
        least = std::min(least, r.min);
        most = std::max(most, r.max);
    }
}

/// What one pass over all cells finds besides the cells' bounds.
struct Pass {
    double least = infinity, most = -infinity;  // attained
    Steepness steepness;

    void include(const Pass& other) {
        least = std::min(least, other.least);
        most = std::max(most, other.most);
        steepness.include(other.steepness);
    }
};

/// Collects the bounds of one chunk of cells, eight triangles at a time.
class ChunkBounds {
public:
    ChunkBounds(std::vector<double>& lower, std::vector<double>& upper, Pass& pass)
        : lower_(lower), upper_(upper), pass_(pass) {}

    void add(const CellView& view, const geometry::Polygon& polygon) {
        const Vec3 apex = polygon.vertex(0);
        Vec3 last = polygon.vertex(std::min(1, polygon.size - 1));
        if (polygon.size < 3) add(view, apex, last, last);
        for (int i = 2; i < polygon.size; ++i) {
            const Vec3 next = polygon.vertex(i);
            add(view, apex, last, next);
            last = next;
        }
    }

    void flush() {
        geometry::bound(batch_);  // lanes past the end hold earlier triangles, or nothing yet
        for (int i = 0; i < batch_.size; ++i) {
            const std::uint64_t c = batch_.tag[i];
            lower_[c] = std::min(lower_[c], batch_.lower[i]);
            upper_[c] = std::max(upper_[c], batch_.upper[i]);
            pass_.least = std::min(pass_.least, batch_.least[i]);
            pass_.most = std::max(pass_.most, batch_.most[i]);
        }
        batch_.size = 0;
    }

private:
    void add(const CellView& view, const Vec3& a, const Vec3& b, const Vec3& c) {
        batch_.add(view.value.data(), a, b, c, view.cell);
        if (batch_.full()) flush();
    }

    std::vector<double>& lower_;
    std::vector<double>& upper_;
    Pass& pass_;
    geometry::FanBatch batch_{};
};

/// Bounds every surface cell by the Bernstein hull of f on M in it. Empty (lower > upper) where voxelisation
/// took a cell to be on the safe side and M does not come near it.
Pass bound_cells(const Surface& surface, std::vector<double>& lower, std::vector<double>& upper,
                 const Progress& progress) {
    std::uint64_t groups = 0;
    for (int k = 0; k < surface.levels(); ++k) groups += surface.groups(k);
    Stage stage(progress, "extremes", groups);
    std::vector<Pass> parts;
    for (int level = 0; level < surface.levels(); ++level) {
        const std::size_t before = parts.size();
        parts.resize(before + chunk_count(surface.groups(level), group_grain));
        for_chunks(surface.groups(level), group_grain,
                   [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                       Pass& pass = parts[before + chunk];
                       ChunkBounds bounds(lower, upper, pass);
                       std::uint64_t cell = surface.first(level, begin);
                       for (std::uint64_t group = begin; group < end; ++group)
                           for (unsigned left = surface.mask(level, group); left != 0;
                                left &= left - 1, ++cell) {
                               const CellView view = surface.view({group, std::countr_zero(left), level}, cell);
                               lower[cell] = infinity;
                               upper[cell] = -infinity;
                               pass.steepness.include(surface, view);
                               surface.for_polygons(
                                   view, [&](const geometry::Polygon& polygon) { bounds.add(view, polygon); });
                           }
                       bounds.flush();
                       stage.advance(end - begin);
                   });
    }
    Pass all;
    for (const Pass& part : parts) all.include(part);
    return all;
}

}  // namespace

Extremes find_extremes(const octree::Lattice& lattice, const octree::Octree& octree, const field::Field& field,
                       std::span<const Vec3> positions, std::span<const Triangle> triangles,
                       std::span<const std::uint64_t> offset, std::span<const std::uint32_t> triangle,
                       Extrema method, const Progress& progress) {
    const Surface surface(lattice, octree, field, positions, triangles, offset, triangle);
    std::vector<double> lower(surface.cells()), upper(surface.cells());
    Parts parts(progress);
    Pass pass = bound_cells(surface, lower, upper, parts.until(method == Extrema::certified ? 0.8 : 0.1));

    Extremes result{.lower = infinity, .upper = -infinity, .rounding = 0, .cell_lower = {}, .cell_upper = {}};
    result.rounding = rounding_error(pass.steepness);
    if (method == Extrema::certified) {
        branch_and_bound(surface, lower, upper, pass.least, pass.most, parts.until(1));
        for (std::uint64_t c = 0; c < lower.size(); ++c) {
            result.lower = std::min(result.lower, lower[c]);
            result.upper = std::max(result.upper, upper[c]);
        }
    } else {
        paper_extremes(surface, result.lower, result.upper, parts.until(1));
    }
    result.lower -= result.rounding;
    result.upper += result.rounding;

    result.cell_lower.resize(lower.size());
    result.cell_upper.resize(upper.size());
    parallel_for(lower.size(), cell_grain, [&](std::uint64_t c) {
        const bool empty = lower[c] > upper[c];
        result.cell_lower[c] = empty ? 0.0f : rounded_down(lower[c] - result.rounding);
        result.cell_upper[c] = empty ? 0.0f : rounded_up(upper[c] + result.rounding);
    });
    return result;
}

}  // namespace its::shell
