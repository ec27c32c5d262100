#include "shell/target.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mesh/require.h"
#include "shell/extremes.h"

namespace its::shell {

namespace {

double longest_side(const Box& bounds) {
    double side = 0;
    for (int axis = 0; axis < 3; ++axis) side = std::max(side, bounds.max[axis] - bounds.min[axis]);
    return side > 0 ? side : octree::make_lattice(bounds, 0).width;  // of a mesh that is one point
}

}  // namespace

/// A cell with no coarser one beside it has |f| ≤ √3/2 of its width on M.
int depth_for(double thickness, const Box& bounds, const BuildOptions& options) {
    const double side = octree::make_lattice(bounds, 0).width;
    // γ takes less than a thousandth of the thickness, but far from the origin: there cells may be a level too
    // large, and the shell says so.
    constexpr double left = 0.999;
    const double cells = std::ceil(std::log2(std::numbers::sqrt3 * side / (left * thickness)));
    (void)octree::make_lattice(bounds, least_adaptive_depth);  // throws where the mesh is too far away
    const int most = std::min(options.deepest.value_or(max_adaptive_depth),
                              octree::deepest_lattice(bounds, max_adaptive_depth));
    return std::clamp(int(std::clamp(cells, 0.0, 100.0)), least_adaptive_depth, most);
}

namespace {

/// The default, or what roundings allow far from the origin.
double default_length(const Box& bounds, const BuildOptions& options) {
    const double wanted = default_thickness * longest_side(bounds);
    const octree::Lattice lattice =
        octree::make_nested_lattice(bounds, depth_for(wanted, bounds, options), least_adaptive_depth);
    constexpr double roundings = 8;
    return std::max(wanted, roundings * lattice.width * expected_rounding(lattice));
}

std::uint64_t default_cells(const mesh::Arrays& mesh) {
    return default_max_cells + default_cells_per_triangle * mesh.triangles.size();
}

}  // namespace

Target target_of(const mesh::Arrays& mesh, const BuildOptions& options) {
    if (options.depth) return {};
    mesh::require_usable(mesh);
    const Box bounds = octree::bounds(mesh);
    octree::require_size(bounds);
    const bool open = options.thickness == 0;
    const double thickness = open ? default_length(bounds, options) : options.thickness;
    return {.thickness = thickness,
            .max_cells = open && options.max_cells == 0 ? default_cells(mesh) : options.max_cells};
}

double expected_rounding(const octree::Lattice& lattice) {
    constexpr double steepest = 8;
    const double coarsest = std::ldexp(1.0, lattice.depth - least_adaptive_depth);
    return rounding_error(lattice, steepest, coarsest, 4 * coarsest);
}

}  // namespace its::shell
