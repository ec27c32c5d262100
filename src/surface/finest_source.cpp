#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/rounding.h"
#include "surface/level_search.h"
#include "surface/level_source.h"

namespace its::surface {

LevelSource::LevelSource(const octree::Lattice& lattice, double step, std::uint32_t cells,
                         const Rounding& rounding) {
    const std::optional<Grid> grid = make_grid(lattice, step, cells, rounding);
    if (grid) {
        grid_ = *grid;
        return;
    }
    const double unit = rounding.unit(lattice.reach() * lattice.width);
    if (unit <= most_unit * step)
        throw OptionError(
            "the mesh is too far from the origin for surfaces with cells this small; move it "
            "nearer, or lower the depth or resolution");
    throw OptionError(
        fmt::format("32-bit numbers are {:.3g} apart at this distance from the origin, too far for a surface "
                    "with cells of {:.3g}; write .ply, .obj or .off, which keep doubles, move the mesh "
                    "nearer, or lower the depth or resolution",
                    unit, step));
}

namespace {

constexpr std::uint64_t cell_grain = 1024;

/// Adds the surface in one cell.
void include_cell(const SurfaceFrame& frame, const LevelCell& cell, CellSurface& surface, Hull& hull) {
    std::array<double, 8> value;
    const Crossing crossing = crossing_of(cell, frame.level, value);
    if (crossing.below == 0 || crossing.below == 0xff) return;
    // A vertex on an edge is on the level, or no farther from it than clearance and rounding move it.
    if (!crossing.star) {
        const double away = curvature(value.data()) + frame.grid.displacement() * steepest(value.data());
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

/// The largest value, and the steepest slope along an edge.
struct Extent {
    double value = 0, slope = 0;
};

Extent extent(std::span<const LevelCell> cells) {
    std::vector<Extent> parts(chunk_count(cells.size(), cell_grain));
    for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) {
            for (const double v : cells[i].value)
                parts[chunk].value = std::max(parts[chunk].value, std::abs(v));
            parts[chunk].slope = std::max(parts[chunk].slope, steepest(cells[i].value.data()));
        }
    });
    Extent all;
    for (const Extent& part : parts) all = {std::max(all.value, part.value), std::max(all.slope, part.slope)};
    return all;
}

class FinestSource : public LevelSource {
public:
    FinestSource(const shell::ShellData& shell, const Rounding& rounding)
        : LevelSource(shell.lattice, shell.lattice.width, shell.lattice.cells(), rounding), shell_(shell) {}

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

    CertifiedLevel certified_level(SurfaceSide side, double bound, double least_move,
                                   const Progress& progress) const override {
        return find_certified_level(*this, shell_, side, bound, least_move, progress);
    }

private:
    /// f moves by at most the slope times the error of each local coordinate, and a slope is at most 2V;
    /// midpoints of halvings round once more each. Then the control values; and, away from the finest cells,
    /// the corner values, which are means of distances in a root cube with a diagonal below 4·2ᴷ.
    ///
    /// Local coordinates are those in the cell whose planes are rounded to 32 bits: each point of it is half a
    /// unit along each axis, at most, from that with the same coordinates in the cell itself. On the three
    /// steps between the two f changes by the steepest slope of the cells that they go through; these are among
    /// the given cells as long as f stays between the levels that the cells were found for.
    double rounding(std::span<const LevelCell> cells) const {
        const double local = 3 * 2 * (local_roundings + Hull::max_halvings);
        const int depth = shell_.lattice.depth;
        const Extent most = extent(cells);
        return unit_roundoff * ((geometry::control_roundings + local) * most.value +
                                value_roundings(depth) * std::ldexp(4.0, depth)) +
               3 * (0.5 * grid().unit) * (1 + 8 * unit_roundoff) * most.slope;
    }

    const shell::ShellData& shell_;
};

}  // namespace

std::unique_ptr<LevelSource> finest_source(const shell::ShellData& shell, const Rounding& rounding) {
    return std::make_unique<FinestSource>(shell, rounding);
}

}  // namespace its::surface
