#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "its/mesh.h"

/// The verifier's own triangles in boxes, and what two triangles have in common, exactly.
namespace its::verifier {

using Corners = std::array<Vec3, 3>;

bool overlap(const Box& a, const Box& b);

/// Boxes in boxes, each halved at the middle of its parts' centres.
class Boxes {
public:
    struct Node {
        Box box;
        std::uint32_t begin = 0, end = 0;  ///< triangles in order()
        std::uint32_t second = 0;          ///< child, the first being the next node; 0: a leaf
    };

    explicit Boxes(const Mesh& mesh);

    const std::vector<Node>& nodes() const { return nodes_; }
    const std::vector<std::uint32_t>& order() const { return order_; }

    /// fn(triangle) for all whose leaf's box meets the box.
    template <class F>
    void for_near(const Box& box, F&& fn) const {
        std::vector<std::uint32_t> open{0};
        while (!open.empty()) {
            const std::uint32_t at = open.back();
            open.pop_back();
            const Node& node = nodes_[at];
            if (!overlap(node.box, box)) continue;
            if (node.second != 0) {
                open.push_back(node.second);
                open.push_back(at + 1);
                continue;
            }
            for (std::uint32_t i = node.begin; i < node.end; ++i) fn(order_[i]);
        }
    }

private:
    void split(const std::vector<Box>& boxes, std::uint32_t begin, std::uint32_t end);

    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

Corners corners_of(const Mesh& mesh, std::uint64_t triangle);
Box box_of(const Corners& triangle);
bool is_degenerate(const Corners& t);

/// Whether two triangles have a point in common. The first is not degenerate, the second may be.
bool meet(const Corners& s, const Corners& t);

/// Whether two triangles, neither degenerate, have a point in common beside a corner or an edge that they
/// share.
bool meet_beside_shared(const Corners& s, const Corners& t);

/// The mesh's winding number about a point, displaced as in verify/exact.h.
std::int64_t winding_number(const Mesh& mesh, const Boxes& boxes, const Vec3& p);

}  // namespace its::verifier
