#include "shell/budget.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/vec3.h"
#include "its/shell.h"
#include "octree/lattice.h"

namespace its::shell {

namespace {

// What is alive at the peak, during the extremes or the distances:
// values, parent, mask, first, inside; nearest triangles, which only the quarter above the finest level has
constexpr std::uint64_t bytes_per_group = 27 * 8 + 8 + 1 + 2 + 1 + 27 * 4 / 4;
// offset, code, bounds twice, winding; and a quarter of two of these one level above
constexpr std::uint64_t bytes_per_cell = 2 * 8 + 2 * 8 + 2 * 4 + 4 + 4;
constexpr std::uint64_t bytes_per_pair = 4 + 2;    // the list, and a third of it one level above
constexpr std::uint64_t bytes_per_triangle = 240;  // block, discs, order, positions, the shell's copy

constexpr std::uint64_t triangle_grain = 65536;
constexpr double triangles_per_cell = 4;  // what automatic_depth aims at

// The share of the expected growth that a mesh has at least, whatever its position: a sheet in a lattice plane
// meets two layers of cells at every level, or one.
constexpr double least_share = 0.5;

}  // namespace

std::uint64_t build_bytes(const BuildSize& size) {
    return bytes_per_group * size.groups + bytes_per_cell * size.surface_cells + bytes_per_pair * size.pairs +
           bytes_per_triangle * size.triangles;
}

MeshMeasure measure(const Mesh& mesh) {
    const double scale = octree::make_lattice(octree::bounds(mesh), 0).width;
    std::vector<MeshMeasure> parts(chunk_count(mesh.triangles.size(), triangle_grain));
    for_chunks(mesh.triangles.size(), triangle_grain,
               [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                   MeshMeasure part;
                   for (std::uint64_t i = begin; i < end; ++i) {
                       const Triangle& t = mesh.triangles[i];
                       const Vec3 a = mesh.vertices[t[0]], ab = mesh.vertices[t[1]] - a,
                                  ac = mesh.vertices[t[2]] - a;
                       const double area = 0.5 * norm(cross(ab, ac)) / (scale * scale);
                       const double perimeter = (norm(ab) + norm(ac) + norm(ac - ab)) / scale;
                       part.area += area;
                       part.perimeter += perimeter;
                       // An equilateral triangle has A = 0.048 P².
                       if (area < 0.01 * perimeter * perimeter) part.needles += perimeter;
                   }
                   parts[chunk] = part;
               });
    MeshMeasure all{.triangles = mesh.triangles.size()};
    for (const MeshMeasure& part : parts) {
        all.area += part.area;
        all.perimeter += part.perimeter;
        all.needles += part.needles;
    }
    return all;
}

BuildSize estimate_size(const MeshMeasure& mesh, int depth) {
    const double cells = std::ldexp(1.0, depth), area = mesh.area * cells * cells;
    const double pairs = double(mesh.triangles) + 0.75 * mesh.perimeter * cells + 1.5 * area;
    const double sheet = std::min(pairs, 2 * area),
                 thread = std::min(pairs - sheet, 0.75 * mesh.needles * cells + 8);
    // A surface has 4 cells in a group and a third more groups above; a curve 2, and as many again above.
    const double groups = sheet / 3 + thread + 2 * depth + 2;
    const auto whole = [](double x) { return std::uint64_t(std::min(x, 1e15)); };
    return {mesh.triangles, whole(groups), whole(sheet + thread), whole(pairs)};
}

BuildSize estimate_size(const Mesh& mesh, int depth) {
    return estimate_size(measure(mesh), depth);
}

MemoryBudget::MemoryBudget(const Mesh& mesh, int depth, std::uint64_t options_limit)
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

int automatic_depth(const Mesh& mesh, std::uint64_t options_limit) {
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
