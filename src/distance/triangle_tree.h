#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "distance/triangle_block.h"
#include "its/mesh.h"

/// Triangles in Morton order under an implicit tree of bounding spheres: eight nodes of a level, in order, are
/// the children of one node of the next.
namespace its {

struct TriangleTree {
    static constexpr std::uint64_t arity = TriangleBlock::lanes;

    /// Radii are widened by this many u × the size of the coordinates: far more than a distance's own error of
    /// 8u·size (docs/design/distance.md), so that no comparison of rounded distances cuts off a triangle whose
    /// computed distance is the smallest; and far less than any sphere that matters.
    static constexpr double widening = 4096;

    /// Spheres of one level, padded to a multiple of `arity` with spheres that nothing is near to.
    struct Spheres {
        std::vector<double> x, y, z, radius;
        std::uint64_t size() const { return x.size(); }
    };

    std::vector<TriangleBlock> block;   ///< triangles in Morton order
    std::vector<std::uint32_t> source;  ///< index in the mesh of each triangle in Morton order
    std::vector<Spheres> levels;        ///< level 0: one sphere a triangle; the last level: at most `arity`
};

/// \param size  bound on all coordinates
TriangleTree make_triangle_tree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                double size);

}  // namespace its
