#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "geometry/triangle_pair.h"
#include "simplify/complex.h"

/// Intersections between triangles of a mesh, by exact predicates.
namespace its::simplifier {

using geometry::intersect;
using geometry::NumberedTriangle;

/// The living triangles of a complex in a hierarchy of hashed grids: each stands in the cells, of the grid that
/// is about as wide as itself, that its box meets.
class TriangleGrid {
public:
    explicit TriangleGrid(const Complex& mesh);

    /// Whether the triangle meets a living one, other than those of `ring`, which are about to change.
    bool meets(const NumberedTriangle& triangle, const Complex& mesh, std::span<const std::uint32_t> ring);

    /// How many living triangles in the grid it meets.
    std::uint64_t count_met(const NumberedTriangle& triangle, const Complex& mesh);

    void remove(std::uint32_t triangle, const Complex& mesh);
    void insert(std::uint32_t triangle, const Complex& mesh);

private:
    template <class F>
    void for_cells(const Box& box, int level, F&& fn) const;
    template <class F>
    void for_met(const NumberedTriangle& triangle, const Complex& mesh, F&& fn);
    int level_of(const Box& box) const;

    Vec3 origin_;
    double width_ = 1;  ///< of the cells of level 0; doubled from level to level
    static constexpr int levels = 24;
    std::array<std::uint64_t, levels> in_level_{};  ///< triangles
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
    std::vector<std::uint64_t> mark_;
    std::uint64_t epoch_ = 0;
};

/// Pairs of living triangles that intersect.
std::uint64_t count_intersections(const Complex& mesh);

}  // namespace its::simplifier
