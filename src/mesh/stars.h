#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "its/mesh.h"

namespace its::mesh {

/// The corners 3t + k at each vertex: corner[first[v] … first[v + 1]), ascending.
struct Stars {
    std::vector<std::uint64_t> first, corner;

    Stars(std::span<const Triangle> triangles, std::size_t vertices)
        : first(vertices + 1), corner(3 * triangles.size()) {
        for (const Triangle& t : triangles)
            for (const std::uint32_t v : t) ++first[v + std::size_t{1}];
        std::partial_sum(first.begin(), first.end(), first.begin());
        std::vector<std::uint64_t> next(first.begin(), first.end() - 1);
        for (std::size_t c = 0; c < corner.size(); ++c) corner[next[triangles[c / 3][c % 3]]++] = c;
    }
    std::span<std::uint64_t> at(std::size_t v) {
        return {corner.data() + first[v], std::size_t(first[v + 1] - first[v])};
    }
};

}  // namespace its::mesh
