#pragma once

#include <cstdint>
#include <vector>

#include "its/mesh.h"

/// The verifier's own distances from M.
namespace its::verifier {

/// Distance of the origin from the triangle abc, whatever its shape, but for 64 · 2⁻⁵³ of the farthest corner's
/// distance. Where it is more than `limit` the result is more, too, and need not be the distance.
double distance_to_triangle(const Vec3& a, const Vec3& b, const Vec3& c, double limit);

/// The triangles in boxes in boxes: each box is halved at the middle of its triangles' centres.
class Nearest {
public:
    /// \param mesh  is not copied unless it is so small or large that products of six lengths need scaling
    explicit Nearest(const Mesh& mesh);
    Nearest(const Nearest&) = delete;
    Nearest& operator=(const Nearest&) = delete;

    /// The distance from p to M if that is at most `limit`, else infinity. It errs as distance_to_triangle().
    double distance(const Vec3& p, double limit) const;

private:
    struct Node {
        Box box;
        /// A leaf's triangles in order_; of an inner node (end = 0) the second child, the first being the next
        /// node.
        std::uint32_t begin = 0, end = 0;
    };
    double scaled_distance(const Vec3& p, double limit) const;
    void split(std::vector<Vec3>& centre, std::uint32_t begin, std::uint32_t end);

    int exponent_ = 0;  ///< lengths here are 2^exponent_ in mesh units
    Mesh scaled_;
    const Mesh& mesh_;  ///< that one, or the caller's
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace its::verifier
