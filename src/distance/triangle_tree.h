#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "distance/triangle_block.h"
#include "its/mesh.h"

/// Triangles in Morton order under an implicit tree of bounding discs: eight nodes of a level, in order, are
/// the children of one node of the next.
namespace its::distance {

struct TriangleTree {
    static constexpr std::uint64_t arity = TriangleBlock::lanes;

    /// Discs are widened by this many u × the size of the coordinates: far more than a distance's own error
    /// (docs/design/distance.md), so that no comparison of rounded distances cuts off a triangle whose computed
    /// distance is the smallest; and far less than any disc that matters.
    static constexpr double widening = 4096;

    /// Eight nodes. Each is a disc: the points within `radius` of the axis through the centre and within
    /// `thickness` of the plane normal to it. The axis is the triangles' mean normal: on a smooth surface the
    /// thickness is of second order, and so is what the disc loses against the triangles. The axis may be zero;
    /// the disc is then a ball. Lanes past the last node are discs that nothing is near to.
    struct alignas(64) Nodes {
        double x[arity], y[arity], z[arity];
        double axis_x[arity], axis_y[arity], axis_z[arity];
        double radius[arity], thickness[arity];
    };

    std::vector<TriangleBlock> block;        ///< triangles in Morton order; lanes past the last one repeat it
    std::vector<std::uint32_t> source;       ///< index in the mesh of each triangle in Morton order
    std::vector<std::vector<Nodes>> levels;  ///< of level k at k − 1: a node of level 1 is a block; the last
                                             ///< level has one element

    std::uint32_t top() const { return std::uint32_t(levels.size()); }
    const Nodes& nodes(std::uint32_t level, std::uint32_t index) const {
        return levels[level - 1][index / arity];
    }
    /// Of a level: ⌈triangles / 8^level⌉.
    std::uint64_t count(std::uint32_t level) const {
        return (source.size() + (std::uint64_t{1} << 3 * level) - 1) >> 3 * level;
    }
};

/// The square of a vector's part at right angles to a disc's axis is taken as |v|² − (v·axis)². Both terms and
/// the axis' length are rounded: this much of |v|² (2⁻⁴⁷ = 64u) outweighs it on either side.
inline constexpr double disc_safety = 0x1p-47;

/// Lower bound on the squared distance from p to what is in node `lane`.
ITS_INLINE double squared_gap(const TriangleTree::Nodes& n, std::uint64_t lane, double px, double py,
                              double pz) {
    const double x = px - n.x[lane], y = py - n.y[lane], z = pz - n.z[lane];
    const auto positive = [](double v) { return v < 0.0 ? 0.0 : v; };
    const double along = x * n.axis_x[lane] + y * n.axis_y[lane] + z * n.axis_z[lane];
    const double squared = (1 - disc_safety) * (x * x + y * y + z * z);
    const double above = positive((along < 0.0 ? -along : along) - n.thickness[lane]);
    const double beside = positive(std::sqrt(positive(squared - along * along)) - n.radius[lane]);
    return above * above + beside * beside;
}

/// \param size  bound on all coordinates
TriangleTree make_triangle_tree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                double size);

}  // namespace its::distance
