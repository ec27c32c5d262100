#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "mesh/arrays.h"

namespace its::mesh {

/// The mesh with vertices at identical positions made one: numbers of positions that triangles use.
struct Merged {
    std::vector<Vec3> points;
    std::vector<Triangle> triangles;
};

/// \throws InputError on what inspect() refuses.
Merged merge(const mesh::Arrays& mesh);

/// A triangle that is a segment or point even without a look at coordinates: it connects points, but is no
/// face.
inline bool repeats_corner(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/// A triangle's use of the edge between two positions, `low` < `high`.
struct EdgeUse {
    std::uint32_t high, triangle;
    bool upwards;  ///< the triangle goes from low to high
};

/// fn(low, uses) for each edge, in ascending order of (low, high); uses by ascending triangle. Only triangles
/// for which use(i) holds count, none of which may repeat a corner.
template <class Use, class F>
void for_edges(const Merged& mesh, Use&& use, F&& fn) {
    std::vector<std::uint64_t> begin(mesh.points.size() + 1);
    const auto for_uses = [&](auto&& visit) {
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            if (!use(i)) continue;
            const Triangle& t = mesh.triangles[i];
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = t[k], b = t[k == 2 ? 0 : k + 1];
                visit(std::min(a, b), EdgeUse{std::max(a, b), std::uint32_t(i), a < b});
            }
        }
    };
    for_uses([&](std::uint32_t low, const EdgeUse&) { ++begin[low + std::size_t{1}]; });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<EdgeUse> uses(begin.back());
    std::vector<std::uint64_t> at(begin.begin(), begin.end() - 1);
    for_uses([&](std::uint32_t low, const EdgeUse& edge) { uses[at[low]++] = edge; });
    for (std::size_t low = 0; low + 1 < begin.size(); ++low) {
        const auto first = uses.begin() + std::ptrdiff_t(begin[low]),
                   last = uses.begin() + std::ptrdiff_t(begin[low + 1]);
        std::sort(first, last, [](const EdgeUse& a, const EdgeUse& b) {
            return std::pair(a.high, a.triangle) < std::pair(b.high, b.triangle);
        });
        for (auto it = first; it != last;) {
            const auto end = std::find_if(it, last, [&](const EdgeUse& e) { return e.high != it->high; });
            fn(std::uint32_t(low), std::span<const EdgeUse>(&*it, std::size_t(end - it)));
            it = end;
        }
    }
}

}  // namespace its::mesh
