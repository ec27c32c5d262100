#include "surface/grid.h"

#include "base/rounding.h"

namespace its::surface {

std::optional<Grid> make_grid(const octree::Lattice& lattice, double step, std::uint32_t cells,
                              const Rounding& rounding) {
    Grid grid{.origin = lattice.position({0, 0, 0}), .step = step, .cells = cells, .rounding = rounding};
    const double largest = lattice.reach() * lattice.width, ulp = 2 * unit_roundoff * largest / step;
    grid.clearance = std::max(least_clearance, clearance_in_ulps * ulp);
    grid.unit = rounding.unit(largest) / step;
    if (!(grid.clearance <= most_clearance && grid.unit <= most_unit)) return {};
    return grid;
}

Rounding make_rounding(const octree::Lattice& lattice, Coordinates coordinates) {
    constexpr double far = 8;  // in scales
    if (coordinates == Coordinates::doubles) return {};
    if (coordinates == Coordinates::single || lattice.reach() * lattice.width <= far * lattice.scale())
        return {Rounding::Kind::single, {}, 0};
    const std::int64_t middle = lattice.cells() / 2;
    const Rounding rounding =
        Rounding::about(lattice.position({middle, middle, middle}), double(middle) * lattice.width);
    if (!rounding.has_room(lattice.reach() * lattice.width))
        throw OptionError(
            "the mesh is too far from the origin, or too small, for 32-bit numbers about a centre; use "
            "doubles");
    return rounding;
}

}  // namespace its::surface
