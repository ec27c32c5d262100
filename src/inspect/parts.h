#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/merged.h"

/// The parts of a mesh.
namespace its::inspector {

/// A part: triangles connected through edges. Where an edge has more than two, those are paired that bound the
/// same material, and a part goes on from a triangle to its partner alone: solids that touch are several parts.
struct Parts {
    std::vector<std::uint32_t> order;  ///< triangles that repeat no corner, those of a part together, ascending
    std::vector<std::uint64_t> first;  ///< where each part begins in the order, and the end
    std::vector<std::uint8_t> closed;  ///< of each part: at each of its edges all triangles have partners

    std::size_t count() const { return closed.size(); }
    std::span<const std::uint32_t> triangles(std::size_t part) const {
        return std::span(order).subspan(first[part], first[part + 1] - first[part]);
    }
};

Parts find_parts(const mesh::Merged& mesh);

}  // namespace its::inspector
