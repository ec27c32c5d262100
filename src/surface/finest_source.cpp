#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/rounding.h"
#include "surface/level_source.h"

namespace its::surface {

LevelSource::LevelSource(const octree::Lattice& lattice, double step, std::uint32_t cells)
    : grid_{.origin = lattice.position({0, 0, 0}), .step = step, .cells = cells} {
    const double ulp = 2 * unit_roundoff * lattice.reach() * lattice.width / step;  // in cells
    grid_.clearance = std::max(least_clearance, clearance_in_ulps * ulp);
    if (grid_.clearance > most_clearance)
        throw OptionError(
            "the mesh is too far from the origin for surfaces with cells this small; move it nearer, or lower "
            "the "
            "depth or resolution");
}

namespace {

constexpr std::uint64_t cell_grain = 1024;

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

/// Adds the surface in one cell.
void include_cell(const SurfaceFrame& frame, const LevelCell& cell, CellSurface& surface, Hull& hull) {
    std::array<double, 8> value;
    const Crossing crossing = crossing_of(cell, frame.level, value);
    if (crossing.below == 0 || crossing.below == 0xff) return;
    // A vertex on an edge is on the level, or no farther from it than the clearance moves it.
    if (!crossing.star) {
        const double away = curvature(value.data()) + frame.grid.clearance * steepest(value.data());
        if (hull.include_if_within(frame.level - away, frame.level + away)) return;
    }
    make_cell_surface(frame, cell, surface);
    std::array<geometry::Sample, patch_vertices> samples;
    for (int v = 0; v < patch_vertices; ++v)
        if (crossing.has(v))
            samples[std::size_t(v)] = geometry::sample(cell.value.data(), surface.at[std::size_t(v)]);
    for (int t = 0; t < surface.patch.size; ++t) {
        const auto& corner = surface.patch.triangle[std::size_t(t)];
        hull.include(cell.value.data(), samples[corner[0]], samples[corner[1]], samples[corner[2]]);
    }
}

double largest_value(std::span<const LevelCell> cells) {
    std::vector<double> parts(chunk_count(cells.size(), cell_grain), 0.0);
    for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i)
            for (const double v : cells[i].value) parts[chunk] = std::max(parts[chunk], std::abs(v));
    });
    return parts.empty() ? 0.0 : *std::max_element(parts.begin(), parts.end());
}

class FinestSource : public LevelSource {
public:
    explicit FinestSource(const shell::ShellData& shell)
        : LevelSource(shell.lattice, shell.lattice.width, shell.lattice.cells()), shell_(shell) {}

    std::vector<LevelCell> cells(double low, double high, const Progress& progress) const override {
        return find_level_cells(shell_.octree, shell_.field, low, high, progress);
    }

    SurfaceRange bound(const SurfaceFrame& frame, std::span<const LevelCell> cells, RangeEnds ends,
                       const Progress& progress) const override {
        Stage stage(progress, "surface bounds", cells.size());
        std::vector<Hull> parts(chunk_count(cells.size(), cell_grain), Hull(frame.level, ends));
        for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            CellSurface surface;
            for (std::uint64_t i = begin; i < end; ++i) include_cell(frame, cells[i], surface, parts[chunk]);
            stage.advance(end - begin);
        });
        SurfaceRange range{frame.level, frame.level};
        for (const Hull& hull : parts) {
            range.lower = std::min(range.lower, hull.range().lower);
            range.upper = std::max(range.upper, hull.range().upper);
        }
        const double error = rounding(cells);
        return {range.lower - error, range.upper + error};
    }

private:
    /// f moves by at most the slope times the error of each local coordinate, and a slope is at most 2V;
    /// midpoints of halvings round once more each. Then the control values; and, away from the finest cells,
    /// the corner values, which are means of distances in a root cube with a diagonal below 4·2ᴷ.
    double rounding(std::span<const LevelCell> cells) const {
        const double local = 3 * 2 * (local_roundings + Hull::max_halvings);
        const int depth = shell_.lattice.depth;
        return unit_roundoff * ((geometry::control_roundings + local) * largest_value(cells) +
                                value_roundings(depth) * std::ldexp(4.0, depth));
    }

    const shell::ShellData& shell_;
};

}  // namespace

std::unique_ptr<LevelSource> finest_source(const shell::ShellData& shell) {
    return std::make_unique<FinestSource>(shell);
}

}  // namespace its::surface
