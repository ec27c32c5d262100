#include "surface/surface_bounds.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/bernstein.h"

namespace its {

namespace {

constexpr std::uint64_t cell_grain = 1024;
constexpr int max_halvings = 12;  // 4⁻¹² of the first gap, which is below 8, is far less than surface_gap

/// What is attained so far in a chunk of cells, and the bounds proven for them.
struct Hull {
    double least, most, lower, upper;

    explicit Hull(double level) : least(level), most(level), lower(level), upper(level) {}
    void attain(const Bounds& b) {
        least = std::min(least, b.least);
        most = std::max(most, b.most);
    }
    bool open(const Bounds& b) const { return b.lower < least - surface_gap || b.upper > most + surface_gap; }
    void settle(const Bounds& b) {
        lower = std::min(lower, b.lower);
        upper = std::max(upper, b.upper);
    }
};

/// How far the function can be from its linear interpolation over points of the cell, at most. In coordinates
/// from the cell's centre f = a + linear + Σ β yz + τ xyz; over points p = Σ λᵢpᵢ the mean of yz and the
/// product of the means of y and z differ by at most 1/4 (a covariance), those of xyz by at most 1/8 + 1/8.
double curvature(const double* v) {
    const double xy = (v[0] - v[1] - v[2] + v[3]) + (v[4] - v[5] - v[6] + v[7]);
    const double xz = (v[0] - v[1] - v[4] + v[5]) + (v[2] - v[3] - v[6] + v[7]);
    const double yz = (v[0] - v[2] - v[4] + v[6]) + (v[1] - v[3] - v[5] + v[7]);
    const double xyz = (v[7] - v[6] - v[5] + v[4]) - (v[3] - v[2] - v[1] + v[0]);
    return 0.25 * (0.5 * (std::abs(xy) + std::abs(xz) + std::abs(yz)) + std::abs(xyz));
}

double steepest(const double* v) {
    double slope = 0;
    for (int c = 0; c < 8; ++c)
        for (const int step : {1, 2, 4})
            if (!(c & step)) slope = std::max(slope, std::abs(v[c | step] - v[c]));
    return slope;
}

class SurfaceBounder {
public:
    SurfaceBounder(const SurfaceFrame& frame, bool ignore_below, bool ignore_above)
        : frame_(frame), ignore_below_(ignore_below), ignore_above_(ignore_above) {}

    void include(const LevelCell& cell, Hull& hull, CellSurface& surface) const {
        std::array<double, 8> value;
        const Crossing crossing = crossing_of(cell, frame_.level, value);
        if (crossing.below == 0 || crossing.below == 0xff) return;
        // A vertex on an edge is on the level, or no farther than the clearance moves it.
        if (!crossing.star) {
            const double away = curvature(value.data()) + frame_.grid.clearance * steepest(value.data());
            const Bounds quick{frame_.level - away, frame_.level + away, frame_.level, frame_.level};
            if (!hull.open(masked(quick))) return hull.settle(quick);
        }
        make_cell_surface(frame_, cell, surface);
        std::array<Sample, patch_vertices> samples;
        sample_vertices(cell, surface, samples);
        for (int t = 0; t < surface.patch.size; ++t) {
            const auto& corner = surface.patch.triangle[std::size_t(t)];
            bound(cell.value.data(), samples[corner[0]], samples[corner[1]], samples[corner[2]], 0, hull);
        }
    }

private:
    static void sample_vertices(const LevelCell& cell, const CellSurface& surface,
                                std::array<Sample, patch_vertices>& samples) {
        const unsigned inner = surface.crossing.inner();
        for (int v = 0; v < patch_vertices; ++v) {
            const bool exists = v < first_inner ? surface.crossing.crossed(v) : inner >> (v - first_inner) & 1;
            if (exists) samples[std::size_t(v)] = sample(cell.value.data(), surface.at[std::size_t(v)]);
        }
    }

    Bounds masked(Bounds b) const {
        if (ignore_below_) b.lower = b.least = frame_.level;
        if (ignore_above_) b.upper = b.most = frame_.level;
        return b;
    }

    void bound(const double* value, const Sample& p, const Sample& q, const Sample& r, int halvings,
               Hull& hull) const {
        const Bounds b = masked(bernstein_bounds(value, p, q, r));
        hull.attain(b);
        if (!hull.open(b) || halvings == max_halvings) return hull.settle(b);
        const Sample pq = sample(value, 0.5 * (p.at + q.at)), qr = sample(value, 0.5 * (q.at + r.at)),
                     rp = sample(value, 0.5 * (r.at + p.at));
        bound(value, p, pq, rp, halvings + 1, hull);
        bound(value, pq, q, qr, halvings + 1, hull);
        bound(value, rp, qr, r, halvings + 1, hull);
        bound(value, pq, qr, rp, halvings + 1, hull);
    }

    const SurfaceFrame& frame_;
    bool ignore_below_, ignore_above_;
};

double largest_value(std::span<const LevelCell> cells) {
    std::vector<double> parts(chunk_count(cells.size(), cell_grain), 0.0);
    for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i)
            for (const double v : cells[i].value) parts[chunk] = std::max(parts[chunk], std::abs(v));
    });
    return parts.empty() ? 0.0 : *std::max_element(parts.begin(), parts.end());
}

}  // namespace

SurfaceRange bound_surface(const SurfaceFrame& frame, std::span<const LevelCell> cells, int depth,
                           bool ignore_below, bool ignore_above, const Progress& progress) {
    Stage stage(progress, "surface bounds", cells.size());
    std::vector<Hull> parts(chunk_count(cells.size(), cell_grain), Hull(frame.level));
    const SurfaceBounder bounder(frame, ignore_below, ignore_above);
    for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        CellSurface surface;
        for (std::uint64_t i = begin; i < end; ++i) bounder.include(cells[i], parts[chunk], surface);
        stage.advance(end - begin);
    });
    SurfaceRange range{frame.level, frame.level};
    for (const Hull& hull : parts) {
        range.lower = std::min(range.lower, hull.lower);
        range.upper = std::max(range.upper, hull.upper);
    }
    // f moves by at most the slope times the error of each local coordinate, and a slope is at most 2V;
    // midpoints of halvings round once more each; then control values and, away from the finest cells, the
    // corner values, which are means of distances in a root cube of diagonal below 4·2ᴷ.
    const double value = largest_value(cells);
    const double local = 3 * 2 * (local_roundings + max_halvings);
    const double rounding =
        unit_roundoff * ((control_roundings + local) * value + value_roundings(depth) * std::ldexp(4.0, depth));
    range.lower -= rounding;
    range.upper += rounding;
    return range;
}

}  // namespace its
