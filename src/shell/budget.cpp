#include "shell/budget.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "its/memory.h"
#include "its/shell.h"
#include "mesh/arrays.h"
#include "octree/lattice.h"

namespace its::shell {

namespace {

// What is alive when most is: while the distances' search tree is made, at the distances, or at the bounds of
// f. Of groups: values, parent, mask, first, inside; nearest triangles, which only the quarter above the finest
// level has
constexpr std::uint64_t bytes_per_group = 27 * 8 + 8 + 1 + 2 + 1, nearest_per_group = 27 * 4 / 4;
// Of cells: offset, code; bounds twice, winding; and a quarter of two of these one level above
constexpr std::uint64_t voxel_bytes_per_cell = 2 * 8, bytes_per_cell = 2 * 8 + 2 * 8 + 2 * 4 + 4;
constexpr std::uint64_t bytes_per_pair = 4 + 2;  // the list, and a third of it one level above
// Of triangles: the shell's copy, positions and order; blocks and discs; corners
constexpr std::uint64_t bytes_per_triangle = 100, search_bytes_per_triangle = 200,
                        tree_bytes_per_triangle = 270;

constexpr std::uint64_t triangle_grain = 65536;
constexpr double triangles_per_cell = 4;  // what automatic_depth aims at

// The share of the expected growth that a mesh has at least, whatever its position: a sheet in a lattice plane
// meets two layers of cells at every level, or one.
constexpr double least_share = 0.5;

}  // namespace

std::uint64_t build_bytes(const BuildSize& size) {
    const std::uint64_t lists = voxel_bytes_per_cell * size.surface_cells + bytes_per_pair * size.pairs,
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

MeshMeasure measure(const mesh::Arrays& mesh) {
    const double scale = octree::make_lattice(octree::bounds(mesh), 0).width;
    std::vector<MeshMeasure> parts(chunk_count(mesh.triangles.size(), triangle_grain));
    for_chunks(mesh.triangles.size(), triangle_grain,
               [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                   MeshMeasure part;
                   for (std::uint64_t i = begin; i < end; ++i) {
                       const Triangle& t = mesh.triangles[i];
                       const Vec3 a = mesh.vertices[t[0]], ab = mesh.vertices[t[1]] - a,
                                  ac = mesh.vertices[t[2]] - a;
                       const Vec3 normal = cross(ab, ac), bc = ac - ab;
                       const double area = 0.5 * norm(normal) / (scale * scale);
                       const double perimeter = (norm(ab) + norm(ac) + norm(bc)) / scale;
                       const double extent =
                           0.5 * (length_by_axes(ab) + length_by_axes(ac) + length_by_axes(bc)) / scale;
                       part.area += 0.5 * length_by_axes(normal) / (scale * scale);
                       part.extent += extent;
                       // An equilateral triangle has A = 0.048 P².
                       if (area < 0.01 * perimeter * perimeter) part.needles += extent;
                   }
                   parts[chunk] = part;
               });
    MeshMeasure all{.triangles = mesh.triangles.size()};
    for (const MeshMeasure& part : parts) {
        all.area += part.area;
        all.extent += part.extent;
        all.needles += part.needles;
    }
    return all;
}

namespace {

double expected_pairs(const MeshMeasure& mesh, int depth) {
    const double cells = std::ldexp(1.0, depth);
    return double(mesh.triangles) + mesh.extent * cells + mesh.area * cells * cells;
}

double expected_cells(const MeshMeasure& mesh, int depth) {
    const double cells = std::ldexp(1.0, depth);
    const double sheet = mesh.area * cells * cells, thread = mesh.needles * cells;
    return std::min(expected_pairs(mesh, depth), std::max(sheet, thread) + 8);
}

}  // namespace

BuildSize estimate_size(const MeshMeasure& mesh, int depth) {
    double groups = 1;
    for (int coarser = 0; coarser < depth; ++coarser) groups += expected_cells(mesh, coarser);
    const auto whole = [](double x) { return std::uint64_t(std::min(x, 1e15)); };
    return {mesh.triangles, whole(groups), whole(expected_cells(mesh, depth)),
            whole(expected_pairs(mesh, depth))};
}

BuildSize estimate_size(const mesh::Arrays& mesh, int depth) {
    return estimate_size(measure(mesh), depth);
}

MemoryBudget::MemoryBudget(const mesh::Arrays& mesh, int depth, std::uint64_t options_limit)
    : mesh_(measure(mesh)), depth_(depth), limit_(memory_limit(options_limit)) {}

void MemoryBudget::check(const BuildSize& size) const {
    const std::uint64_t bytes = build_bytes(size);
    if (bytes <= limit_) return;
    int fits = depth_ - 1;
    while (fits >= 0 && build_bytes(estimate_size(mesh_, fits)) > limit_) --fits;
    const std::string advice = fits >= 0 ? fmt::format("the largest depth that fits is {}", fits)
                                         : std::string("no depth fits: simplify the mesh or raise the limit");
    throw MemoryError(fmt::format("depth {} needs about {} of memory, more than the {} allowed; {}", depth_,
                                  bytes_text(bytes), bytes_text(limit_), advice));
}

void MemoryBudget::check_level(int level, std::uint64_t cells, std::uint64_t pairs) const {
    // Expected of cells and pairs from level + 1 to level 0: 4 a level for a surface, 2 for a curve, 1 for
    // points.
    const BuildSize here = estimate_size(mesh_, depth_ - level - 1), below = estimate_size(mesh_, depth_);
    const auto grown = [](std::uint64_t found, std::uint64_t from, std::uint64_t to) {
        const double growth =
            std::max(1.0, least_share * double(to) / double(std::max<std::uint64_t>(from, 1)));
        return std::uint64_t(std::min(double(found) * growth, 1e15));
    };
    const std::uint64_t finest = grown(cells, here.surface_cells, below.surface_cells);
    check({mesh_.triangles, finest / 8, finest, std::max(grown(pairs, here.pairs, below.pairs), finest)});
}

int automatic_depth(const mesh::Arrays& mesh, std::uint64_t options_limit) {
    const std::uint64_t limit = memory_limit(options_limit);
    // Triangles per cell fall by 2 to 4 a level: take the last depth that still holds that many.
    const MeshMeasure measured = measure(mesh);
    int depth = 0;
    for (int next = 1; next <= max_depth; ++next) {
        const BuildSize size = estimate_size(measured, next);
        if (double(size.pairs) < triangles_per_cell * double(size.surface_cells) || build_bytes(size) > limit)
            break;
        depth = next;
    }
    return depth;
}

}  // namespace its::shell
