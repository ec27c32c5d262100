#include "shell/budget.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "base/memory.h"
#include "geometry/vec3.h"
#include "its/shell.h"
#include "octree/lattice.h"

namespace its {

namespace {

// Bytes a surface cell takes at the peak, all levels included: groups of 27 distances (a surface cell needs about
// 0.25 groups at level 0, and a third more above), its lists, bounds and codes. Measured: docs/design/build.md.
constexpr std::uint64_t bytes_per_cell = 160;
constexpr std::uint64_t bytes_per_pair = 10;       // the lists of two levels, and the children's bits
constexpr std::uint64_t bytes_per_triangle = 260;  // positions, records and spheres of the triangle tree
constexpr double triangles_per_cell = 4;           // what automatic_depth aims at
constexpr double children_on_surface = 4.2;        // a surface cell has about 4 children that meet the surface

std::uint64_t limit_of(std::uint64_t options_limit) {
    if (options_limit > 0) return options_limit;
    const std::uint64_t available = available_memory();
    return available > 0 ? available / 4 * 3 : ~std::uint64_t{0};
}

double estimated_bytes(const Mesh& mesh, int depth) {
    const CellEstimate e = estimate_cells(mesh, depth);
    return double(bytes_per_cell) * e.surface_cells + double(bytes_per_pair) * e.pairs +
           double(bytes_per_triangle) * double(mesh.triangles.size());
}

}  // namespace

std::uint64_t build_bytes(std::uint64_t triangles, std::uint64_t surface_cells, std::uint64_t pairs) {
    return bytes_per_cell * surface_cells + bytes_per_pair * pairs + bytes_per_triangle * triangles;
}

CellEstimate estimate_cells(const Mesh& mesh, int depth) {
    const double width = make_lattice(bounds(mesh), 0).width * std::ldexp(1.0, -depth);
    double area = 0, perimeter = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]], ab = mesh.vertices[t[1]] - a, ac = mesh.vertices[t[2]] - a;
        area += 0.5 * norm(cross(ab, ac));
        perimeter += norm(ab) + norm(ac) + norm(ac - ab);
    }
    area /= width * width;
    perimeter /= width;
    const double pairs = double(mesh.triangles.size()) + 0.75 * perimeter + 1.5 * area;
    return {std::min(pairs, 2 * area + 8), pairs};
}

MemoryBudget::MemoryBudget(const Mesh& mesh, int depth, std::uint64_t options_limit)
    : mesh_(mesh), depth_(depth), limit_(limit_of(options_limit)) {}

void MemoryBudget::check_estimate() const {
    const double bytes = estimated_bytes(mesh_, depth_);
    if (bytes > double(limit_)) refuse(bytes);
}

void MemoryBudget::check_level(int level, std::uint64_t cells, std::uint64_t pairs) const {
    // Pairs grow by 2 to 4 a level once triangles are larger than cells: take the growth of cells for both.
    const double growth = std::pow(children_on_surface, level + 1);
    const double bytes = growth * double(cells) * double(bytes_per_cell) / 4 +
                         double(pairs) * double(bytes_per_pair);
    if (bytes > double(limit_)) refuse(bytes);
}

void MemoryBudget::refuse(double bytes) const {
    int fits = depth_ - 1;
    while (fits >= 0 && estimated_bytes(mesh_, fits) > double(limit_)) --fits;
    const std::string advice = fits >= 0 ? fmt::format("the largest depth that fits is {}", fits)
                                         : std::string("no depth fits: simplify the mesh or raise the limit");
    throw MemoryError(fmt::format("depth {} needs about {} of memory, more than the {} allowed; {}", depth_,
                                  bytes_text(std::uint64_t(std::min(bytes, 1e18))), bytes_text(limit_), advice));
}

int automatic_depth(const Mesh& mesh, std::uint64_t options_limit) {
    const double limit = double(limit_of(options_limit));
    // Triangles per cell fall by 2 to 4 a level: take the last depth that still holds that many.
    int depth = 0;
    for (int next = 1; next <= max_depth; ++next) {
        const CellEstimate e = estimate_cells(mesh, next);
        if (e.pairs < triangles_per_cell * e.surface_cells || estimated_bytes(mesh, next) > limit) break;
        depth = next;
    }
    return depth;
}

}  // namespace its
