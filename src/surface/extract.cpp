#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/names.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "distance/mesh_distance.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/stopwatch.h"
#include "its/surface.h"
#include "shell/access.h"
#include "surface/enclosure.h"
#include "surface/leaf_surface.h"
#include "surface/level_search.h"
#include "surface/polygonise.h"

namespace its {
using namespace surface;

namespace {

constexpr Named<SurfaceSide> sides[] = {
    {SurfaceSide::outer, "outer"}, {SurfaceSide::inner, "inner"}, {SurfaceSide::zero, "zero"}};

constexpr int max_resolution = 65536;
constexpr std::uint64_t samples = 200'000;  // of measured distances, each way
constexpr std::uint64_t value_grain = 65536;

void check_options(const SurfaceOptions& options) {
    if (options.resolution < 0 || options.resolution > max_resolution)
        throw OptionError(fmt::format("resolution {}: must be 0 to {}", options.resolution, max_resolution));
    require_threads(options.run.threads);
    if (options.level && !std::isfinite(*options.level)) throw OptionError("level: must be a finite number");
}

bool is_own_lattice(const shell::ShellData& shell, int resolution) {
    return resolution == 0 || std::uint32_t(resolution) == shell.lattice.scale_cells();
}

/// At the peak, for each cell that the surface runs through. On the shell's own lattice: 1.2 cells collected
/// for a range of levels (80 bytes), each with its crossing, first vertex and place in an index (24); a vertex
/// and two triangles, twice while they are joined (24 + 2·2·12).
constexpr double own_bytes = 200;
/// On others: points of a window of levels (5 of 16 bytes), cells of a few levels (1.3 times 80), bounds of f
/// on one side, by pieces and as sorted (90).
constexpr double other_bytes = 270, other_base = 4e6;
/// On the cells of an adaptive shell, for each that the level runs through: four of the range of levels, halved
/// ones among them (88 bytes each), of which two are crossed (160 each, src/surface/leaf_surface.cpp).
constexpr double leaf_bytes = 4 * 88 + 2 * 160;

/// Where distances are measured: the search tree of the surface, two triangles for each cell, and of M's.
constexpr double measured_bytes = 1060, measured_bytes_per_triangle = 500;

/// How far from its bound an outer or inner surface is expected, in cells of its lattice.
constexpr double own_move = 0.15, other_move = 0.6;

/// The leaves that a level runs through, each as often as `weight(level)` says. Hats that reach into a leaf
/// from finer cells beside it are left out.
template <class Weight>
double crossed_leaves(const shell::ShellData& shell, double level, Weight&& weight) {
    double sum = 0;
    for (std::size_t l = 0; l < shell.octree.levels.size(); ++l) {
        const Array<double>& values = shell.field.values[l];
        const octree::Level& cells = shell.octree.levels[l];
        std::vector<std::uint64_t> counts(chunk_count(cells.groups(), value_grain));
        for_chunks(cells.groups(), value_grain,
                   [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                       for (std::uint64_t group = begin; group < end; ++group)
                           for (int child = 0; child < 8; ++child) {
                               if (l > 0 && cells.mask[group] >> child & 1) continue;
                               int below = 0;
                               for (int c = 0; c < 8; ++c)
                                   below += values[octree::group_points * group +
                                                   std::uint64_t(octree::group_point(child, c))] < level;
                               counts[chunk] += below != 0 && below != 8;
                           }
                   });
        for (const std::uint64_t count : counts) sum += weight(int(l)) * double(count);
    }
    return sum;
}

/// Expected of the cells of another lattice, or of the finest, that the surface runs through.
double expected_cells(const shell::ShellData& shell, const SurfaceOptions& options, double own) {
    const double ratio = options.resolution > 0 ? double(shell.lattice.scale_cells()) / options.resolution : 1;
    double level = own;
    if (options.level)
        level = *options.level / shell.lattice.width;
    else if (options.side != SurfaceSide::zero)
        level += (options.side == SurfaceSide::outer ? 1 : -1) *
                 (options.resolution > 0 ? other_move : own_move) * ratio;
    // Surfaces of a side's own level are near M, where leaves are small. Signs at corners say more often that a
    // larger leaf is crossed than it is, as finer hats reach into it.
    const auto area = [&](int l) {
        if (l > 2 && !options.level) return 0.0;
        return l == 0 ? 1.0 : std::ldexp(0.75, 2 * l);
    };
    return crossed_leaves(shell, level, area) / (ratio * ratio);
}

/// Of adaptive shells: leaves.
double expected_leaves(const shell::ShellData& shell, double level) {
    return crossed_leaves(shell, level, [](int) { return 1.0; });
}

double with_measuring(const shell::ShellData& shell, const SurfaceOptions& options, double bytes,
                      double cells) {
    if (!options.measure) return bytes;
    return std::max(bytes,
                    measured_bytes * cells + measured_bytes_per_triangle * double(shell.mesh.triangles.size()));
}

std::unique_ptr<LevelSource> make_source(const shell::ShellData& shell, const SurfaceOptions& options,
                                         MemoryGuard& guard) {
    const Rounding rounding = make_rounding(shell.lattice, options.coordinates);
    return is_own_lattice(shell, options.resolution)
               ? finest_source(shell, rounding)
               : resampled_source(shell, options.resolution, rounding, guard);
}

/// A file may hold any numbers; with those of a build every search ends.
void check_values(const shell::ShellData& shell) {
    const double most = shell.lattice.largest_value();
    const auto possible = [&](double v) { return std::abs(v) <= most; };
    bool good = possible(shell.epsilon_inner) && possible(shell.epsilon_outer);
    for (const auto& values : shell.field.values) {
        std::vector<std::uint8_t> parts(chunk_count(values.size(), value_grain), 1);
        for_chunks(values.size(), value_grain,
                   [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                       bool all = true;
                       for (std::uint64_t i = begin; i < end; ++i) all &= possible(values[i]);
                       parts[chunk] = all;
                   });
        good = good && std::find(parts.begin(), parts.end(), 0) == parts.end();
    }
    if (!good) throw InputError("damaged shell: values of f are larger than distances in its root cube can be");
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

/// Points where f is within the bounds are at most four thicknesses from M, as measured: where a ball of this
/// radius lies inside M, a fifth of it is expected to do. Two digits, rounded down.
double thickness_for(double radius, double thickness) {
    const double wanted = std::min(radius / 5, thickness / 2);
    const double digit = std::pow(10, std::floor(std::log10(wanted)) - 1);
    return std::floor(wanted / digit) * digit;
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
    if (shell.info.thickness_asked > 0) {
        report.thickness_wanted = thickness_for(radius, shell.info.thickness());
        report.reason = fmt::format(
            "f is nowhere below the level {:.3g}; a thickness of {:.2g} should give an "
            "inner surface",
            report.level, report.thickness_wanted);
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

void explain_uncertified(const SurfaceOptions& options, SurfaceReport& report) {
    const bool touches = !(report.margin > 0);
    if (touches) report.reason = "at this level the surface is not proven to be off M";
    if (report.components_enclosed == report.components) return;
    report.reason +=
        fmt::format("{}{} of {} parts of M are {} the surface{}", touches ? "; " : "",
                    report.components - report.components_enclosed, report.components,
                    options.side == SurfaceSide::outer ? "outside of" : "within",
                    touches ? "" : ", being small for its cells; a larger resolution would tell them apart");
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
        explain_uncertified(options, report);
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

/// What extraction works on, and what it has found.
struct Extraction {
    Extraction(const shell::ShellData& of, const SurfaceOptions& with, const Progress& progress)
        : shell(of),
          options(with),
          parts(progress),
          guard(with.max_memory),
          source(make_source(of, with, guard)),
          frame{source->grid(), with.side, 0} {
        const bool own = is_own_lattice(of, with.resolution);
        const double expected = expected_cells(of, with, own_level(of, with.side));
        const double bytes = own ? own_bytes * expected : other_base + other_bytes * expected;
        guard.check_expected(with_measuring(of, with, bytes, expected),
                             own ? double(of.lattice.scale_cells()) : with.resolution);
    }

    const shell::ShellData& shell;
    const SurfaceOptions& options;
    Parts parts;  ///< each step takes a share of what is left, as it may come again
    MemoryGuard guard;
    std::unique_ptr<LevelSource> source;
    SurfaceFrame frame;
    std::vector<LevelCell> cells;
    Mesh mesh;
    Enclosure enclosed;
    SurfaceRange covered{0, 0};   ///< levels that the cells are all those of
    SurfaceRange near_end{0, 0};  ///< of a level that was searched for, at the end that faces M
    bool searched = false;
};

/// Whether the surface has each part of M on the right side. On the shell's own lattice that follows from the
/// margin.
void count_enclosed(Extraction& e, bool off_mesh) {
    if (off_mesh && is_own_lattice(e.shell, e.options.resolution)) {
        e.enclosed = {count_parts(e.shell.mesh), {}};
        return;
    }
    const int wanted = e.options.side == SurfaceSide::outer ? 1 : 0;
    e.enclosed = enclosure(e.shell.mesh, e.mesh, wanted, e.parts.next(0.2));
}

std::uint64_t crossed_cells(const Extraction& e) {
    return std::uint64_t(std::count_if(e.cells.begin(), e.cells.end(), [&](const LevelCell& cell) {
        const auto [least, most] = std::minmax_element(cell.value.begin(), cell.value.end());
        return *least < e.frame.level && *most >= e.frame.level;
    }));
}

void make_mesh(Extraction& e) {
    // Of each cell itself, its crossing, number and index; of those crossed a vertex and two triangles, joined.
    const Taken taken(e.guard, e.cells.size() * (sizeof(LevelCell) + 24) +
                                   crossed_cells(e) * (sizeof(Vec3) + 2 * 2 * sizeof(Triangle)));
    e.mesh = polygonise(e.frame, e.cells, e.parts.next(0.4));
}

/// The level nearest to the side's own that keeps the surface off M, has every part of M on the right side, and
/// whose patches 32-bit numbers do not fold.
void search(Extraction& e) {
    constexpr double unfold = 1.0 / 64;  // finest cells
    constexpr int attempts = 64;
    const double own = own_level(e.shell, e.options.side);
    e.searched = true;
    double least_move = 0;
    for (int attempt = 0; attempt < attempts; ++attempt) {
        CertifiedLevel found = e.source->certified_level(e.options.side, own, least_move, e.parts.next(0.7));
        e.frame.level = found.level;
        e.near_end = found.range;
        e.covered = found.covered;
        e.cells = std::move(found.cells);
        check_inside_root(e.shell, e.frame.level);
        if (e.source->grid().unit > 0 && !stars_are_embedded(e.frame, e.cells)) {
            least_move = std::abs(e.frame.level - own) + unfold;
            continue;
        }
        make_mesh(e);
        count_enclosed(e, true);
        double move = least_move;
        for (const Vec3& p : e.enclosed.wrong)
            move = std::max(move, e.source->enclosing_move(e.options.side, own, p));
        if (!(move > least_move)) return;
        least_move = move;
    }
    refuse_folded();
}

void extract_given_level(Extraction& e, double level) {
    e.frame.level = level;
    e.covered = {level, level};
    e.cells = e.source->cells(level, level, e.parts.next(0.4));
    check_inside_root(e.shell, level);
    if (e.source->grid().unit > 0 && !stars_are_embedded(e.frame, e.cells)) refuse_folded();
    make_mesh(e);
}

/// Bounds of f on the surface. With 32-bit numbers on the shell's own lattice they hold as far as the cells are
/// those of all levels between them: where they reach farther, cells are collected again, with room.
SurfaceRange range_of(Extraction& e) {
    constexpr int attempts = 8;
    const bool outer = e.options.side == SurfaceSide::outer,
               own = is_own_lattice(e.shell, e.options.resolution);
    const RangeEnds ends = !e.searched || !own ? RangeEnds::both : outer ? RangeEnds::upper : RangeEnds::lower;
    SurfaceRange range = e.source->bound(e.frame, e.cells, ends, e.parts.next(0.4));
    const bool limited = own && e.source->grid().unit > 0;
    const auto reaches_beyond = [&] {
        return limited && (range.lower < e.covered.lower || range.upper > e.covered.upper);
    };
    for (int i = 0; reaches_beyond(); ++i) {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        if (i == attempts) return {-infinity, infinity};
        e.covered = {2 * range.lower - e.frame.level, 2 * range.upper - e.frame.level};
        e.cells = e.source->cells(e.covered.lower, e.covered.upper, e.parts.next(0.3));
        range = e.source->bound(e.frame, e.cells, ends, e.parts.next(0.3));
    }
    if (!e.searched) return range;
    if (outer) range.lower = own ? e.near_end.lower : std::max(range.lower, e.near_end.lower);
    if (!outer) range.upper = own ? e.near_end.upper : std::min(range.upper, e.near_end.upper);
    return range;
}

/// Fills in what is proven of f on the surface, and of its winding numbers.
void certify(Extraction& e, SurfaceReport& report) {
    const SurfaceRange range = range_of(e);
    const double width = e.shell.lattice.width;
    report.lowest = width * range.lower;
    report.highest = width * range.upper;
    if (report.side == SurfaceSide::zero) return;
    const double margin = report.side == SurfaceSide::outer ? range.lower - e.shell.epsilon_outer
                                                            : e.shell.epsilon_inner - range.upper;
    if (!e.searched) count_enclosed(e, margin > 0);
    report.margin = width * margin;
    report.components = e.enclosed.components;
    report.components_enclosed = e.enclosed.components - e.enclosed.wrong.size();
    report.certified = margin > 0 && e.enclosed.wrong.empty();
}

/// On the cells of an adaptive shell themselves.
Surface extract_from_leaves(const shell::ShellData& shell, const SurfaceOptions& options,
                            const Progress& progress) {
    const Stopwatch watch;
    Parts all(progress);
    check_values(shell);
    MemoryGuard guard(options.max_memory);
    const Grid grid = finest_source(shell, make_rounding(shell.lattice, options.coordinates))->grid();
    const double own = own_level(shell, options.side), width = shell.lattice.width;
    std::optional<double> given;
    if (options.level) given = *options.level / width;
    if (!given && (options.side == SurfaceSide::zero || !options.certify)) given = own;
    const double leaves = expected_leaves(shell, given.value_or(own));
    guard.check_expected(with_measuring(shell, options, leaf_bytes * leaves, leaves),
                         double(shell.lattice.scale_cells()));
    LeafSurface found = extract_leaf_surface(shell, grid, options.side, given, own, options.certify, guard,
                                             all.until(options.measure ? 0.45 : 0.95));
    check_inside_root(shell, found.level);
    Surface surface;
    surface.mesh = std::move(found.mesh);
    SurfaceReport& report = surface.report;
    report.side = options.side;
    report.level = width * found.level;
    report.empty = surface.mesh.triangles.empty();
    report.cell_width = grid.step;
    report.origin = grid.rounding.origin;
    report.cells = found.cells;
    if (options.certify && !report.empty) {
        report.lowest = width * found.range.lower;
        report.highest = width * found.range.upper;
    }
    if (options.certify && !report.empty && options.side != SurfaceSide::zero) {
        const bool outer = options.side == SurfaceSide::outer;
        const double margin = outer ? found.range.lower - own : own - found.range.upper;
        report.margin = width * margin;
        report.certified = margin > 0;
        const Enclosure enclosed = margin > 0 ? Enclosure{count_parts(shell.mesh), {}}
                                              : enclosure(shell.mesh, surface.mesh, outer ? 1 : 0,
                                                          all.until(options.measure ? 0.5 : 1));
        report.components = enclosed.components;
        report.components_enclosed = enclosed.components - enclosed.wrong.size();
    }
    explain(shell, options, report);
    report.seconds.extract = watch.seconds();
    if (options.measure && !report.empty) measure(shell, all.until(1), surface);
    report.seconds.total = watch.seconds();
    return surface;
}

Surface extract(const shell::ShellData& shell, const SurfaceOptions& options, const Progress& progress) {
    if (shell.octree.adaptive() && options.resolution == 0)
        return extract_from_leaves(shell, options, progress);
    const Stopwatch watch;
    Parts all(progress);
    check_values(shell);
    Extraction e(shell, options, all.until(options.measure ? 0.5 : 1));
    if (options.certify && !options.level && options.side != SurfaceSide::zero)
        search(e);
    else
        extract_given_level(
            e, options.level ? *options.level / shell.lattice.width : own_level(shell, options.side));
    Surface surface;
    SurfaceReport& report = surface.report;
    report.side = options.side;
    report.level = shell.lattice.width * e.frame.level;
    report.empty = e.mesh.triangles.empty();
    report.cell_width = e.source->grid().step;
    report.origin = e.source->grid().rounding.origin;
    report.cells = crossed_cells(e);
    if (options.certify && !report.empty) certify(e, report);
    surface.mesh = std::move(e.mesh);
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
