#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/names.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "distance/mesh_distance.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/surface.h"
#include "shell/access.h"
#include "surface/level_search.h"
#include "surface/polygonise.h"

namespace its {
using namespace surface;

namespace {

constexpr Named<SurfaceSide> sides[] = {
    {SurfaceSide::outer, "outer"}, {SurfaceSide::inner, "inner"}, {SurfaceSide::zero, "zero"}};

constexpr int max_resolution = 65536;
constexpr std::uint64_t samples = 200'000;  // of measured distances, each way

void check_options(const SurfaceOptions& options) {
    if (options.resolution < 0 || options.resolution > max_resolution)
        throw OptionError(fmt::format("resolution {}: must be 0 to {}", options.resolution, max_resolution));
    require_threads(options.run.threads);
    if (options.level && !std::isfinite(*options.level)) throw OptionError("level: must be a finite number");
}

std::unique_ptr<LevelSource> make_source(const shell::ShellData& shell, int resolution) {
    const bool finest = resolution == 0 || std::uint32_t(resolution) == shell.lattice.scale_cells();
    return finest ? finest_source(shell) : resampled_source(shell, resolution);
}

/// The bound of f on M that a side has to do with, in finest cell widths.
double own_level(const shell::ShellData& shell, SurfaceSide side) {
    switch (side) {
        case SurfaceSide::outer:
            return shell.epsilon_outer;
        case SurfaceSide::inner:
            return shell.epsilon_inner;
        case SurfaceSide::zero:
            break;
    }
    return 0;
}

/// The root cube's corners are the farthest from M; the level set is closed within the cube if they are above
/// the level and no cell at the cube's boundary has a corner below it (which polygonise() sees to).
void check_inside_root(const shell::ShellData& shell, double level) {
    const Array<double>& values = shell.field.values[std::size_t(shell.lattice.depth)];
    for (int c = 0; c < 8; ++c)
        if (values[std::size_t(octree::group_point(c, c))] < level) refuse_open_level();
}

/// The largest depth below M that f reaches at a grid point, in mesh units.
double deepest_value(const shell::ShellData& shell) {
    double least = 0;
    for (const auto& values : shell.field.values)
        for (std::size_t i = 0; i < values.size(); ++i) least = std::min(least, values[i]);
    return -shell.lattice.width * least;
}

/// A radius that balls inside M have: that of a plate or, too small, of a ball with M's volume and area.
double typical_radius(const shell::MeshArrays& mesh) {
    double area = 0, volume = 0;
    const Vec3 origin = mesh.vertices[mesh.triangles[0][0]];
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
                   c = mesh.vertices[t[2]] - origin;
        area += 0.5 * norm(cross(b - a, c - a));
        volume += dot(a, cross(b, c)) / 6;
    }
    return area > 0 ? std::max(volume / area, 0.0) : 0.0;
}

/// Where a ball of radius ρ lies inside M, some lattice point is at least ρ − (√3/2)w deep, and the level is at
/// most (√3/2)w below 0, as f on M is a mean of distances to corners of its cell, plus the certificate's move,
/// seldom more than w/4: a depth with 2w ≤ ρ has an inner surface.
void explain_empty_inner(const shell::ShellData& shell, SurfaceReport& report) {
    const double radius = std::max(deepest_value(shell), typical_radius(shell.mesh));
    if (shell.info.sign == SignRule::unsigned_rule) {
        report.reason = "the shell has no inside: its sign rule is unsigned";
        return;
    }
    if (radius == 0) {
        report.reason = "f is nowhere negative: the mesh has no inside at this depth, or is inside out";
        return;
    }
    const int needed = int(std::ceil(std::log2(2 * shell.lattice.scale() / radius)));
    const int depth = std::max(needed, shell.info.depth + 1);
    report.depth_wanted = depth <= max_depth ? depth : 0;
    report.reason = fmt::format("no lattice point lies deeper inside than the level {:.3g}; {}", report.level,
                                report.depth_wanted > 0
                                    ? fmt::format("depth {} should give an inner surface", depth)
                                    : fmt::format("the inside is too thin for any depth up to {}", max_depth));
}

void explain(const shell::ShellData& shell, const SurfaceOptions& options, SurfaceReport& report) {
    if (report.empty && options.side == SurfaceSide::inner && !options.level)
        explain_empty_inner(shell, report);
    else if (report.empty && shell.info.sign == SignRule::unsigned_rule)
        report.reason = "the shell has no inside, so that f is nowhere negative: its sign rule is unsigned";
    else if (report.empty)
        report.reason = "f is below this level nowhere";
    else if (!options.certify)
        report.reason = "no certificate was asked for";
    else if (options.side == SurfaceSide::zero)
        report.reason = "a zero surface runs along M and is never certified";
    else if (!report.certified)
        report.reason = "at this level the surface is not proven to be off M";
}

/// Fills in what is proven of f on the surface.
void certify(const shell::ShellData& shell, const SurfaceRange& range, SurfaceReport& report) {
    report.lowest = shell.lattice.width * range.lower;
    report.highest = shell.lattice.width * range.upper;
    if (report.side == SurfaceSide::zero) return;
    const double margin = report.side == SurfaceSide::outer ? range.lower - shell.epsilon_outer
                                                            : shell.epsilon_inner - range.upper;
    report.margin = shell.lattice.width * margin;
    report.certified = margin > 0;
}

void measure(const shell::ShellData& shell, const Progress& progress, Surface& surface) {
    Parts parts(progress);
    const Stopwatch watch;
    const mesh::Arrays a{surface.mesh.vertices, surface.mesh.triangles},
        b{shell.mesh.vertices, shell.mesh.triangles};
    surface.report.to_mesh = distance::mesh_distance(a, b, samples, parts.until(0.5)).max;
    surface.report.from_mesh = distance::mesh_distance(b, a, samples, parts.until(1)).max;
    surface.report.seconds.measure = watch.seconds();
}

Surface extract(const shell::ShellData& shell, const SurfaceOptions& options, const Progress& progress) {
    Parts all(progress);
    Parts parts(all.until(options.measure ? 0.5 : 1));
    const Stopwatch watch;
    const std::unique_ptr<LevelSource> source = make_source(shell, options.resolution);
    const double own = own_level(shell, options.side);
    SurfaceFrame frame{source->grid(), options.side,
                       options.level ? *options.level / shell.lattice.width : own};
    std::vector<LevelCell> cells;
    SurfaceRange near_end{0, 0};
    const bool search = options.certify && !options.level && options.side != SurfaceSide::zero;
    if (search) {
        CertifiedLevel found = find_certified_level(*source, options.side, own, parts.until(0.7));
        frame.level = found.level;
        near_end = found.range;
        cells = std::move(found.cells);
    } else {
        cells = source->cells(frame.level, frame.level, parts.until(0.4));
    }
    check_inside_root(shell, frame.level);

    Surface surface;
    surface.mesh = polygonise(frame, cells, parts.until(0.8));
    SurfaceReport& report = surface.report;
    report.side = options.side;
    report.level = shell.lattice.width * frame.level;
    report.empty = surface.mesh.triangles.empty();
    report.cell_width = source->grid().step;
    report.cells = std::uint64_t(std::count_if(cells.begin(), cells.end(), [&](const LevelCell& cell) {
        const auto [least, most] = std::minmax_element(cell.value.begin(), cell.value.end());
        return *least < frame.level && *most >= frame.level;
    }));
    if (options.certify && !report.empty) {
        SurfaceRange range = source->bound(frame, cells,
                                           !search                              ? RangeEnds::both
                                           : options.side == SurfaceSide::outer ? RangeEnds::upper
                                                                                : RangeEnds::lower,
                                           parts.until(1));
        if (search)
            (options.side == SurfaceSide::outer ? range.lower = near_end.lower : range.upper = near_end.upper);
        certify(shell, range, report);
    }
    explain(shell, options, report);
    report.seconds.extract = watch.seconds();
    if (options.measure && !report.empty) measure(shell, all.until(1), surface);
    report.seconds.total = watch.seconds();
    return surface;
}

}  // namespace

std::string_view name(SurfaceSide side) {
    return name_in(sides, side);
}

std::optional<SurfaceSide> parse_surface_side(std::string_view name) {
    return value_in(sides, name);
}

Surface extract_surface(const ThinShell& shell, const SurfaceOptions& options) {
    check_options(options);
    return run_call(options.run, "surface", [&](const Progress& progress) {
        return extract(shell::Access::data(shell), options, progress);
    });
}

}  // namespace its
