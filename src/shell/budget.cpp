#include "shell/budget.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/memory.h"
#include "geometry/vec3.h"
#include "its/shell.h"
#include "octree/lattice.h"

namespace its {

namespace {

// What is alive at the peak, during the extremes or the distances:
constexpr std::uint64_t bytes_per_group = 27 * 8 + 8 + 1 + 8;  // values, parent, mask, first
constexpr std::uint64_t bytes_per_cell =
    2 * 8 + 2 * 8 + 2 * 4 + 8;                     // offset, code, bounds twice, one level above
constexpr std::uint64_t bytes_per_pair = 4 + 2;    // the list, and a third of it one level above
constexpr std::uint64_t bytes_per_triangle = 360;  // block, spheres, sort keys, positions, the shell's copy

constexpr double triangles_per_cell = 4;  // what automatic_depth aims at
constexpr double least_growth = 2;        // of cells from level to level: a curve's; a surface has 4

std::uint64_t limit_of(std::uint64_t options_limit) {
    if (options_limit > 0) return options_limit;
    const std::uint64_t available = available_memory();
    return available > 0 ? available / 4 * 3 : ~std::uint64_t{0};
}

std::uint64_t estimated_bytes(const Mesh& mesh, int depth) {
    return build_bytes(estimate_size(mesh, depth));
}

}  // namespace

std::uint64_t build_bytes(const BuildSize& size) {
    return bytes_per_group * size.groups + bytes_per_cell * size.surface_cells + bytes_per_pair * size.pairs +
           bytes_per_triangle * size.triangles;
}

BuildSize estimate_size(const Mesh& mesh, int depth) {
    const double width = std::ldexp(make_lattice(bounds(mesh), 0).width, -depth);
    double area = 0, perimeter = 0, needles = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]], ab = mesh.vertices[t[1]] - a, ac = mesh.vertices[t[2]] - a;
        const double own_area = 0.5 * norm(cross(ab, ac)) / (width * width);
        const double own_perimeter = (norm(ab) + norm(ac) + norm(ac - ab)) / width;
        area += own_area;
        perimeter += own_perimeter;
        // An equilateral triangle has A = 0.048 P².
        if (own_area < 0.01 * own_perimeter * own_perimeter) needles += own_perimeter;
    }
    const double triangles = double(mesh.triangles.size());
    const double pairs = triangles + 0.75 * perimeter + 1.5 * area;
    const double sheet = std::min(pairs, 2 * area), thread = std::min(pairs - sheet, 0.75 * needles + 8);
    // A surface has 4 cells in a group and a third more groups above; a curve 2, and as many again above.
    const double groups = sheet / 3 + thread + 2 * depth + 2;
    const auto whole = [](double x) { return std::uint64_t(std::min(x, 1e15)); };
    return {mesh.triangles.size(), whole(groups), whole(sheet + thread), whole(pairs)};
}

MemoryBudget::MemoryBudget(const Mesh& mesh, int depth, std::uint64_t options_limit)
    : mesh_(mesh), depth_(depth), limit_(limit_of(options_limit)) {}

void MemoryBudget::check(const BuildSize& size) const {
    const std::uint64_t bytes = build_bytes(size);
    if (bytes <= limit_) return;
    int fits = depth_ - 1;
    while (fits >= 0 && estimated_bytes(mesh_, fits) > limit_) --fits;
    const std::string advice = fits >= 0 ? fmt::format("the largest depth that fits is {}", fits)
                                         : std::string("no depth fits: simplify the mesh or raise the limit");
    throw MemoryError(fmt::format("depth {} needs about {} of memory, more than the {} allowed; {}", depth_,
                                  bytes_text(bytes), bytes_text(limit_), advice));
}

void MemoryBudget::check_level(int level, std::uint64_t cells, std::uint64_t pairs) const {
    const auto finest = std::uint64_t(double(cells) * std::pow(least_growth, level));
    check({mesh_.triangles.size(), finest / 4, finest, std::max(pairs, finest)});
}

int automatic_depth(const Mesh& mesh, std::uint64_t options_limit) {
    const std::uint64_t limit = limit_of(options_limit);
    // Triangles per cell fall by 2 to 4 a level: take the last depth that still holds that many.
    int depth = 0;
    for (int next = 1; next <= max_depth; ++next) {
        const BuildSize size = estimate_size(mesh, next);
        if (double(size.pairs) < triangles_per_cell * double(size.surface_cells) || build_bytes(size) > limit)
            break;
        depth = next;
    }
    return depth;
}

}  // namespace its
