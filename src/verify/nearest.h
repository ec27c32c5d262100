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
    explicit Nearest(const Mesh& mesh);

    /// The distance from p to M if that is at most `limit`, else infinity. It errs as distance_to_triangle().
    double distance(const Vec3& p, double limit) const;

private:
    struct Node {
        Box box;
        /// A leaf's triangles in order_; of an inner node (end = 0) the second child, the first being the next
        /// node.
        std::uint32_t begin = 0, end = 0;
    };
    void split(std::vector<Vec3>& centre, std::uint32_t begin, std::uint32_t end);

    const Mesh& mesh_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace its::verifier
