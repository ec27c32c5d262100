#include <fmt/format.h>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/vec3.h"
#include "its/surface.h"
#include "shell/shell_data.h"
#include "surface/polygonise.h"
#include "surface/surface_bounds.h"

namespace its {

std::string_view name(SurfaceSide side) {
    switch (side) {
        case SurfaceSide::outer:
            return "outer";
        case SurfaceSide::inner:
            return "inner";
        case SurfaceSide::zero:
            break;
    }
    return "zero";
}

namespace {

constexpr int max_resolution = 65536;

void check_options(const SurfaceOptions& options) {
    if (options.resolution < 0 || options.resolution > max_resolution)
        throw OptionError(fmt::format("resolution {}: must be 0 to {}", options.resolution, max_resolution));
    if (options.threads < 0) throw OptionError(fmt::format("threads {}: must be 0 or more", options.threads));
    if (options.level && !std::isfinite(*options.level)) throw OptionError("level: must be a finite number");
}

Grid finest_grid(const Lattice& lattice) {
    Grid grid{.origin = lattice.position({0, 0, 0}), .step = lattice.width, .cells = lattice.cells()};
    const double ulp = 2 * unit_roundoff * lattice.reach();  // in cells
    grid.clearance = std::max(least_clearance, clearance_in_ulps * ulp);
    if (grid.clearance > most_clearance)
        throw OptionError(
            "the mesh is too far from the origin for surfaces at this depth; move it nearer, or lower "
            "the depth");
    return grid;
}

/// Finds the level of one side that keeps the surface off M.
class LevelSearch {
public:
    LevelSearch(const ThinShell& shell, const SurfaceOptions& options, const Grid& grid)
        : data_(shell.data()), options_(options), frame_{grid, options.side, 0} {
        bound_ = options.side == SurfaceSide::outer ? data_.epsilon_outer : data_.epsilon_inner;
        outward_ = options.side == SurfaceSide::outer ? 1 : -1;
    }

    /// Moves the level away from M until f on the whole surface is beyond its bound on M; then back by halving
    /// while that stays true. Sets cells() to all that the level runs through.
    double run() {
        collect(first_reach);
        double refused = 0, needed = deficit(0);
        double move = needed;
        while ((needed = deficit(move)) >= move) {
            refused = move;
            move = needed * (1 + growth) + surface_gap;
        }
        while (move - refused > precision) {
            const double middle = 0.5 * (move + refused);
            (deficit(middle) < middle ? move : refused) = middle;
        }
        return level(move);
    }
    const std::vector<LevelCell>& cells() const { return cells_; }

private:
    static constexpr double first_reach = 0.25;  // cell widths; doubled as needed
    static constexpr double growth = 1.0 / 16;
    static constexpr double precision = 1.0 / 128;

    double level(double move) const { return bound_ + outward_ * move; }

    void collect(double reach) {
        reach_ = reach;
        const double far = level(reach);
        cells_ = find_level_cells(data_.octree, data_.field, std::min(bound_, far), std::max(bound_, far),
                                  options_.progress);
    }

    /// How far f comes back towards M from the level on the surface of the moved level; less than `move` if the
    /// surface is off M.
    double deficit(double move) {
        while (move > reach_) collect(2 * reach_);
        frame_.level = level(move);
        const bool outer = options_.side == SurfaceSide::outer;
        const SurfaceRange range =
            bound_surface(frame_, cells_, data_.lattice.depth, !outer, outer, options_.progress);
        return outer ? frame_.level - range.lower : range.upper - frame_.level;
    }

    const ShellData& data_;
    const SurfaceOptions& options_;
    SurfaceFrame frame_;
    double bound_, outward_, reach_ = 0;
    std::vector<LevelCell> cells_;
};

}  // namespace

Surface extract_surface(const ThinShell& shell, const SurfaceOptions& options) {
    check_options(options);
    return with_threads(options.threads, [&] {
        const Stopwatch total;
        const ShellData& data = shell.data();
        const double width = data.lattice.width;
        SurfaceFrame frame{finest_grid(data.lattice), options.side, 0};
        std::vector<LevelCell> cells;
        if (options.level || !options.certify || options.side == SurfaceSide::zero) {
            frame.level = options.level                        ? *options.level / width
                          : options.side == SurfaceSide::outer ? data.epsilon_outer
                          : options.side == SurfaceSide::inner ? data.epsilon_inner
                                                               : 0.0;
            cells = find_level_cells(data.octree, data.field, frame.level, frame.level, options.progress);
        } else {
            LevelSearch search(shell, options, frame.grid);
            frame.level = search.run();
            cells = search.cells();
        }
        Surface surface;
        surface.mesh = polygonise(frame, cells, options.progress);
        SurfaceReport& report = surface.report;
        report.side = options.side;
        report.level = width * frame.level;
        report.empty = surface.mesh.triangles.empty();
        report.cell_width = width;
        report.cells = cells.size();
        if (options.certify && !report.empty) {
            const SurfaceRange range =
                bound_surface(frame, cells, data.lattice.depth, false, false, options.progress);
            report.lowest = width * range.lower;
            report.highest = width * range.upper;
            const double margin = options.side == SurfaceSide::outer ? range.lower - data.epsilon_outer
                                                                     : data.epsilon_inner - range.upper;
            report.margin = width * margin;
            report.certified = options.side != SurfaceSide::zero && margin > 0;
        }
        report.seconds = total.seconds();
        return surface;
    });
}

}  // namespace its
