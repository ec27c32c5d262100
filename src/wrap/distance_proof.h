#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "distance/closest_point.h"
#include "its/mesh.h"
#include "mesh/arrays.h"

/// Proven bounds of the distance to M over whole triangles. See docs/design/wrap.md.
namespace its::wrapper {

/// A closed interval of distances.
struct DistanceRange {
    double lower, upper;
};

/// The boxes of M's triangles, halved at the middle of their centres.
class SeparationTree {
public:
    explicit SeparationTree(const mesh::Arrays& mesh);

    /// A lower bound of the distance between M and a triangle: `wanted` or more if that is found out, else less
    /// than wanted, and −infinity where they may meet.
    /// \param rounding  what a bound errs by, at most
    double bound(const std::array<Vec3, 3>& triangle, double wanted, double rounding) const;

private:
    struct Node {
        Vec3 centre, half;                 ///< of a box around its triangles, rounded outward
        std::uint32_t begin = 0, end = 0;  ///< triangles in order_, of a leaf
        std::uint32_t second = 0;          ///< child, the first being the next node; 0: a leaf
    };
    static constexpr std::uint32_t leaf_size = 2;
    void make_node(const std::vector<Box>& boxes, std::uint32_t begin, std::uint32_t end);

    mesh::Arrays mesh_;
    std::vector<std::uint32_t> order_;
    std::vector<std::array<Vec3, 3>> corner_;  ///< of triangles in order_
    std::vector<Node> nodes_;
};

/// A point of a surface and the triangle of M nearest to it.
struct Located {
    Vec3 at;
    std::uint32_t nearest = 0;
};

class DistanceProof {
public:
    /// \param mesh   must outlive this, and so must the tree
    /// \param reach  the largest coordinate of M and of all triangles that are asked about
    DistanceProof(const mesh::Arrays& mesh, const distance::ClosestPointTree& tree, double reach);

    /// Bounds of d(x, M) over the points x of a triangle. A bound within the limits is proven; one beyond them
    /// says that none within was found.
    DistanceRange range(const std::array<Located, 3>& triangle, const DistanceRange& limits) const;

private:
    double upper(const std::array<Located, 3>& triangle, double limit) const;

    mesh::Arrays mesh_;
    const distance::ClosestPointTree& tree_;
    SeparationTree separation_;
    double rounding_;
};

}  // namespace its::wrapper
