#include "octree/lattice.h"
#include "geometry/box.h"
#include "mesh/arrays.h"

#include <fmt/format.h>

namespace its::octree {

namespace {

constexpr int significand_bits = 53;
constexpr int scale_bits = 24;     // of s when the mesh is near the origin
constexpr int min_scale_bits = 8;  // s then exceeds the longest side by less than 2⁻⁷ of it
constexpr double min_size = 1e-75, max_size = 1e75;

/// The smallest number of `bits` significant bits that is ≥ x > 0.
double round_up(double x, int bits) {
    int exponent = 0;
    const double fraction = std::frexp(x, &exponent);
    return std::ldexp(std::ceil(std::ldexp(fraction, bits)), exponent - bits);
}

double largest_coordinate(const Box& box) {
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis)
        largest = std::max({largest, std::abs(box.min[axis]), std::abs(box.max[axis])});
    return largest;
}

}  // namespace

ITS_API Box bounds(const mesh::Arrays& mesh) {
    return geometry::bounds(mesh.vertices, mesh.triangles);
}

namespace {

/// What a lattice depends on of a mesh's bounds.
struct Extent {
    double far = 0, side = 0;

    explicit Extent(const Box& box) : far(largest_coordinate(box)) {
        for (int axis = 0; axis < 3; ++axis) side = std::max(side, box.max[axis] - box.min[axis]);
        if (side == 0) side = far > 0 ? far : 1.0;  // a mesh that is one point: any scale will do
    }

    /// Of s: |base + 4i| ≤ 4(far/w + 2^(levels + 2)) must leave them for w.
    int scale_bits_at(int depth) const {
        const double index =
            4 * (std::ldexp(far / side, depth) + std::ldexp(4.0, std::max(depth, least_levels)));
        return std::min(scale_bits, significand_bits - (std::ilogb(index) + 1));
    }
};

}  // namespace

int deepest_lattice(const Box& box, int most) {
    const Extent extent(box);
    while (most > 0 && extent.scale_bits_at(most) < min_scale_bits) --most;
    return most;
}

void require_size(const Box& box) {
    const Extent extent(box);
    if (!(extent.side >= min_size && extent.far <= max_size))
        throw InputError(
            fmt::format("mesh: size {:.3g} and largest coordinate {:.3g} must lie in [{:g}, {:g}]; scale the "
                        "mesh, by a power of two to lose no digit",
                        extent.side, extent.far, min_size, max_size));
}

Lattice make_lattice(const Box& box, int depth) {
    require_size(box);
    const Extent extent(box);
    const int levels = std::max(depth, least_levels), bits = extent.scale_bits_at(depth);
    if (bits < min_scale_bits)
        throw InputError(
            fmt::format("mesh: {:.3g} away from the origin, which is too far for its size {:.3g} at depth {}; "
                        "move it nearer to the origin, or ask for larger cells",
                        extent.far, extent.side, depth));
    Lattice lattice{.depth = levels,
                    .room = levels - depth,
                    .width = std::ldexp(round_up(extent.side, bits), -depth),
                    .base = {}};
    for (int axis = 0; axis < 3; ++axis) {
        const double centre = box.min[axis] + 0.5 * (box.max[axis] - box.min[axis]);
        const double quarter = 0.25 * lattice.width;
        lattice.base[axis] = std::llround(centre / quarter) - 2 * std::int64_t{lattice.cells()};
    }
    return lattice;
}

Lattice make_nested_lattice(const Box& box, int depth, int coarsest) {
    Lattice lattice = make_lattice(box, depth);  // s has the bits that this depth leaves it
    const int finer = depth - coarsest;
    if (finer == 0) return lattice;
    const double quarter = std::ldexp(0.25 * lattice.width, finer);
    for (int axis = 0; axis < 3; ++axis) {
        const double centre = box.min[axis] + 0.5 * (box.max[axis] - box.min[axis]);
        const std::int64_t base = std::llround(centre / quarter) - 2 * (std::int64_t{2} << coarsest);
        lattice.base[std::size_t(axis)] = base * (std::int64_t{1} << finer);
    }
    return lattice;
}

Lattice coarser(const Lattice& lattice, int levels) {
    Lattice result = lattice;
    result.depth -= levels;
    result.width = std::ldexp(lattice.width, levels);
    for (std::int64_t& base : result.base) base /= std::int64_t{1} << levels;
    return result;
}

}  // namespace its::octree
