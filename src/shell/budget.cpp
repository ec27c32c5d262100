#include "shell/budget.h"

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "its/memory.h"
#include "its/shell.h"
#include "mesh/arrays.h"
#include "octree/lattice.h"
#include "octree/voxelise.h"

namespace its::shell {

namespace {

// What is alive when most is: while the distances' search tree is made, at the distances, or at the bounds of
// f. Of groups: values, parent, mask, first, inside; nearest triangles, which only the quarter above the finest
// level has
constexpr std::uint64_t bytes_per_group = 27 * 8 + 8 + 1 + 2 + 1, nearest_per_group = 27 * 4 / 4;
// Of cells: offset, code; bounds twice, winding; and a quarter of two of these one level above
constexpr std::uint64_t voxel_bytes_per_cell = 2 * 8, bytes_per_cell = 2 * 8 + 2 * 8 + 2 * 4 + 4;
constexpr std::uint64_t bytes_per_pair = 4 + 2;  // the list, and a third of it one level above
// Of cells along holes: cubes and points that the signs keep, and what is left over from their lists; measured
constexpr std::uint64_t bytes_per_flip = 96;
// Of triangles: the shell's copy, positions and order; blocks and discs; corners
constexpr std::uint64_t bytes_per_triangle = 100, search_bytes_per_triangle = 200,
                        tree_bytes_per_triangle = 270;

constexpr std::uint64_t triangle_grain = 65536;

// The share of the expected growth that a mesh has at least, whatever its position: a sheet in a lattice plane
// meets two layers of cells at every level, or one.
constexpr double least_share = 0.5;

}  // namespace

std::uint64_t build_bytes(const BuildSize& size) {
    const std::uint64_t lists = voxel_bytes_per_cell * size.surface_cells + bytes_per_pair * size.pairs +
                                bytes_per_flip * size.flips,
                        groups = bytes_per_group * size.groups;
    const std::uint64_t tree = lists + tree_bytes_per_triangle * size.triangles;
    const std::uint64_t distances =
        lists + groups + nearest_per_group * size.groups + search_bytes_per_triangle * size.triangles;
    const std::uint64_t bounds = lists + groups + (bytes_per_cell - voxel_bytes_per_cell) * size.surface_cells +
                                 bytes_per_triangle * size.triangles;
    return std::max({tree, distances, bounds});
}

namespace {

double length_by_axes(const Vec3& v) {
    return std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
}

}  // namespace

namespace {

/// An equilateral triangle has A = 0.048 P².
bool is_needle(double area, double perimeter) {
    return area < 0.01 * perimeter * perimeter;
}

/// Sides and area of a triangle, in units of the lattice's scale.
struct Shape {
    Vec3 a, ab, ac, bc, normal;

    Shape(const mesh::Arrays& mesh, const Triangle& t, double scale)
        : a(mesh.vertices[t[0]]),
          ab((1 / scale) * (mesh.vertices[t[1]] - a)),
          ac((1 / scale) * (mesh.vertices[t[2]] - a)),
          bc(ac - ab),
          normal(cross(ab, ac)) {}

    bool needle() const { return is_needle(0.5 * norm(normal), norm(ab) + norm(ac) + norm(bc)); }
    double extent() const { return 0.5 * (length_by_axes(ab) + length_by_axes(ac) + length_by_axes(bc)); }
};

/// Cells at needle_depth that sides of needles pass, by points half a cell apart along them.
class NeedleCells {
public:
    NeedleCells(const Vec3& origin, double scale)
        : origin_(origin), scale_(scale), met_(side * side * side / 64) {}

    void add(const Shape& t) {
        const Vec3 at = (1 / scale_) * (t.a - origin_);
        add_side(at, t.ab);
        add_side(at, t.ac);
        add_side(at + t.ab, t.bc);
    }

    double count() const {
        std::uint64_t count = 0;
        for (const auto& word : met_)
            count += std::uint64_t(std::popcount(word.load(std::memory_order_relaxed)));
        return double(count);
    }

private:
    static constexpr std::uint64_t side = (std::uint64_t{1} << needle_depth) + 8;  // bounds, and rounding

    void add_side(const Vec3& from, const Vec3& along) {
        const int steps = int(std::ldexp(norm(along), needle_depth + 1)) + 1;
        for (int i = 0; i <= steps; ++i) {
            std::uint64_t cell = 0;
            for (int axis = 2; axis >= 0; --axis) {
                const double x = std::ldexp(from[axis] + double(i) / steps * along[axis], needle_depth);
                cell = cell * side + std::uint64_t(std::clamp(x, 0.0, double(side - 1)));
            }
            met_[cell / 64].fetch_or(std::uint64_t{1} << cell % 64, std::memory_order_relaxed);
        }
    }

    Vec3 origin_;
    double scale_;
    std::vector<std::atomic<std::uint64_t>> met_;
};

/// Needles are looked at where they could meet more than this part of the cells of the sheets.
constexpr double least_needles = 0.25;
/// By how much a line meets more cells than those that points half a cell apart on it are in, about.
constexpr double missed = 1.25;

double count_needle_cells(const mesh::Arrays& mesh, const Vec3& origin, double scale) {
    NeedleCells cells(origin, scale);
    for_chunks(mesh.triangles.size(), triangle_grain,
               [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
                   for (std::uint64_t i = begin; i < end; ++i) {
                       const Shape t(mesh, mesh.triangles[i], scale);
                       if (t.needle()) cells.add(t);
                   }
               });
    return missed * cells.count();
}

}  // namespace

MeshMeasure measure(const mesh::Arrays& mesh) {
    const Box bounds = octree::bounds(mesh);
    const double scale = octree::make_lattice(bounds, 0).width;
    std::vector<MeshMeasure> parts(chunk_count(mesh.triangles.size(), triangle_grain));
    for_chunks(mesh.triangles.size(), triangle_grain,
               [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                   MeshMeasure part;
                   for (std::uint64_t i = begin; i < end; ++i) {
                       const Shape t(mesh, mesh.triangles[i], scale);
                       const double extent = t.extent();
                       part.area += 0.5 * length_by_axes(t.normal);
                       part.extent += extent;
                       if (t.needle()) part.needles += extent;
                   }
                   parts[chunk] = part;
               });
    MeshMeasure all{.triangles = mesh.triangles.size()};
    for (const MeshMeasure& part : parts) {
        all.area += part.area;
        all.extent += part.extent;
        all.needles += part.needles;
    }
    const double side = std::ldexp(1.0, needle_depth);
    all.needle_cells = all.needles * side > least_needles * all.area * side * side
                           ? count_needle_cells(mesh, bounds.min, scale)
                           : all.needles * side;
    return all;
}

namespace {

double expected_pairs(const MeshMeasure& mesh, int depth) {
    const double cells = std::ldexp(1.0, depth);
    return double(mesh.triangles) + mesh.extent * cells + mesh.area * cells * cells;
}

double expected_cells(const MeshMeasure& mesh, int depth) {
    const double cells = std::ldexp(1.0, depth);
    const double sheet = mesh.area * cells * cells,
                 thread = std::min(mesh.needles * cells, std::ldexp(mesh.needle_cells, depth - needle_depth));
    return std::min(expected_pairs(mesh, depth), std::max(sheet, thread) + 8);
}

}  // namespace

BuildSize estimate_size(const MeshMeasure& mesh, int depth) {
    double groups = 1;
    for (int coarser = 0; coarser < std::max(depth, octree::least_levels); ++coarser)
        groups += expected_cells(mesh, coarser);
    const auto whole = [](double x) { return std::uint64_t(std::min(x, 1e15)); };
    return {mesh.triangles, whole(groups), whole(expected_cells(mesh, depth)),
            whole(expected_pairs(mesh, depth))};
}

BuildSize estimate_size(const mesh::Arrays& mesh, int depth) {
    return estimate_size(measure(mesh), depth);
}

namespace {

/// Pairs of a level that are counted, at least; of meshes of more triangles twice as many as these.
constexpr std::uint64_t counted_pairs = 4'000'000;

/// From a count to the level below, of numbers that are expected to grow from `from` to `to`.
double grown(double count, double before, double from, double to) {
    const double growth = to / from;
    return count * (before > 1 ? std::min(growth, std::max(1.0, count / before)) : growth);
}

}  // namespace

BuildSize count_size(const MeshMeasure& mesh, const octree::Lattice& lattice, std::span<const Vec3> positions,
                     std::span<const Triangle> triangles) {
    octree::Voxels voxels{.cell = {0}, .offset = {0, triangles.size()}, .triangle = {}};
    voxels.triangle.resize(triangles.size());
    std::iota(voxels.triangle.begin(), voxels.triangle.end(), std::uint32_t{0});
    const std::uint64_t most = std::max(counted_pairs, 2 * triangles.size());
    double groups = 0, before = 1, pairs_before = double(triangles.size());
    int level = lattice.depth + 1;
    for (; level > 1 && voxels.triangle.size() <= most; --level) {
        before = double(voxels.cell.size());
        pairs_before = double(voxels.triangle.size());
        groups += before;  // each is the parent of a group
        voxels = octree::halve(voxels, positions, triangles, level - 1, lattice.depth, lattice.dilation());
    }
    double cells = double(voxels.cell.size()), pairs = double(voxels.triangle.size());
    for (; level > 0; --level) {
        groups += cells;
        const int depth = lattice.resolution_depth() - level;
        if (depth < 0) continue;  // wider than M
        const double last = cells, last_pairs = pairs;
        cells = grown(cells, before, expected_cells(mesh, depth), expected_cells(mesh, depth + 1));
        pairs = grown(pairs, pairs_before, expected_pairs(mesh, depth), expected_pairs(mesh, depth + 1));
        before = last;
        pairs_before = last_pairs;
    }
    const auto whole = [](double x) { return std::uint64_t(std::min(x, 1e15)); };
    return {mesh.triangles, whole(groups), whole(cells), whole(std::max(pairs, cells))};
}

MemoryBudget::MemoryBudget(const mesh::Arrays& mesh, int depth, std::uint64_t options_limit)
    : mesh_(measure(mesh)), depth_(depth), limit_(memory_limit(options_limit)) {}

void MemoryBudget::check(const BuildSize& least, const BuildSize& expected) const {
    if (build_bytes(least) <= limit_) return;
    const std::uint64_t bytes = build_bytes(expected);
    // By how much less is expected of it than of this depth.
    const double here = double(build_bytes(estimate_size(mesh_, depth_)));
    int fits = depth_ - 1;
    while (fits >= 0 && double(bytes) * double(build_bytes(estimate_size(mesh_, fits))) > here * double(limit_))
        --fits;
    const std::string advice = fits >= 0 ? fmt::format("the largest depth that fits is {}", fits)
                                         : std::string("no depth fits: simplify the mesh or raise the limit");
    throw MemoryError(fmt::format("depth {} needs about {} of memory, more than the {} allowed; {}", depth_,
                                  bytes_text(bytes), bytes_text(limit_), advice));
}

void MemoryBudget::check_level(int level, std::uint64_t cells, std::uint64_t pairs) const {
    if (depth_ - level - 1 < 0) return;  // in cells wider than the mesh nothing is to be seen of it
    // Expected of cells and pairs from level + 1 to level 0: 4 a level for a surface, 2 for a curve, 1 for
    // points.
    const BuildSize here = estimate_size(mesh_, depth_ - level - 1), below = estimate_size(mesh_, depth_);
    const auto size = [&](double share, double groups_per_cell) {
        const auto grown = [&](std::uint64_t found, std::uint64_t from, std::uint64_t to) {
            const double growth = std::max(1.0, share * double(to) / double(std::max<std::uint64_t>(from, 1)));
            return std::uint64_t(std::min(double(found) * growth, 1e15));
        };
        const std::uint64_t finest = grown(cells, here.surface_cells, below.surface_cells);
        return BuildSize{mesh_.triangles, std::uint64_t(groups_per_cell * double(finest)), finest,
                         std::max(grown(pairs, here.pairs, below.pairs), finest)};
    };
    check(size(least_share, 1.0 / 8), size(1, 1.0 / 3));  // a quarter of the cells, and so on up
}

}  // namespace its::shell
