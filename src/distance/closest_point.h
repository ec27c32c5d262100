#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "distance/triangle_block.h"
#include "its/mesh.h"

/// Closest points on M, from a wide bounding volume hierarchy.
namespace its::distance {

/// The point of M nearest to a query.
struct Nearest {
    std::uint32_t triangle = 0;  ///< index in the mesh; the lowest of those at the same computed distance
    std::uint32_t slot = 0;      ///< where the tree keeps that triangle
    double squared = 0;          ///< squared distance; infinity if nothing was within the bound
};

/// A tree whose nodes have up to eight boxes, and whose leaves are blocks of up to eight triangles. Built by
/// the surface area heuristic, level by level, so that it is the same for any number of threads.
class ClosestPointTree {
public:
    /// \param vertices  finite, of magnitude at most 1e75
    /// \param triangles at least one, indices in range
    ClosestPointTree(std::span<const Vec3> vertices, std::span<const Triangle> triangles);

    /// The nearest triangle among those nearer than `bound`, exact but for the error of a triangle's distance
    /// itself (docs/design/distance.md): pruning never cuts off the smallest computed distance. Takes no
    /// memory.
    /// \param p  finite
    Nearest find(const Vec3& p, double bound = no_bound) const;

    /// Barycentric coordinates of the point of the triangle found that is nearest to p: each in [0, 1], sum 1.
    std::array<double, 3> barycentric(const Nearest& nearest, const Vec3& p) const;

    std::uint64_t memory_bytes() const;

    static constexpr double no_bound = 1e300;

    static constexpr int arity = 8;

    /// Boxes relative to the tree's centre, in units of its scale, rounded outward. A lane without a child has
    /// an inverted box, farther than any distance.
    struct alignas(64) Node {
        float min[3][arity], max[3][arity];
        std::uint32_t child[arity];  ///< a node, or leaf_bit | a block
    };
    static constexpr std::uint32_t leaf_bit = 0x8000'0000;

    /// From mesh units to those of the boxes: (p − centre)·inverse_scale, a power of two.
    struct Frame {
        Vec3 centre;
        double inverse_scale = 1;
        double size = 0;  ///< of the coordinates, mesh units: sets the rounding errors
    };

    /// What a search reads, for others that search the same tree.
    struct View {
        std::span<const Node> nodes;  ///< the root first
        std::span<const TriangleBlock> blocks;
        std::span<const std::uint32_t> source;  ///< 8·block + lane → triangle of the mesh
        Frame frame;
    };
    View view() const { return {nodes_, blocks_, source_, frame_}; }

private:
    Frame frame_;
    std::vector<Node> nodes_;  ///< the root first
    std::vector<TriangleBlock> blocks_;
    std::vector<std::uint32_t> source_;  ///< 8·block + lane → triangle of the mesh
};

}  // namespace its::distance
