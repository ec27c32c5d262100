#pragma once

#include <array>
#include <cstdint>

#include "octree/octree.h"

/// What lies next to a cell on its level, and what its children share with that: the tables, once.
namespace its::octree {

/// The cells around a cell, itself included: number (1 + dx) + 3 (1 + dy) + 9 (1 + dz).
inline constexpr int neighbours = 27, itself = 13;

/// Number, among the 27 points of a neighbour's children, of point `point` of the cell's own; −1 if that point
/// is not the neighbour's.
constexpr int point_of_neighbour(int point, int neighbour) {
    int result = 0;
    for (int stride = 1; stride < group_points; stride *= 3) {
        const int at = point / stride % 3 - 2 * (neighbour / stride % 3 - 1);
        if (at < 0 || at > 2) return -1;
        result += at * stride;
    }
    return result;
}

/// The points that a cell's children share with those of a neighbour, ascending.
struct SharedPoints {
    std::uint32_t bits = 0;  ///< bit p: our point p is shared
    int count = 0;
    std::array<std::uint8_t, group_points> ours{}, theirs{};
};

inline constexpr std::array<SharedPoints, neighbours> shared_points = [] {
    std::array<SharedPoints, neighbours> table{};
    for (int n = 0; n < neighbours; ++n) {
        SharedPoints& shared = table[std::size_t(n)];
        for (int p = 0; p < group_points; ++p) {
            const int theirs = point_of_neighbour(p, n);
            if (theirs < 0) continue;
            shared.bits |= 1u << p;
            shared.ours[std::size_t(shared.count)] = std::uint8_t(p);
            shared.theirs[std::size_t(shared.count++)] = std::uint8_t(theirs);
        }
    }
    return table;
}();

/// Where what is around each child is: which neighbour of the parent, and which child of that.
struct ChildTable {
    std::uint8_t neighbour[8][neighbours], child[8][neighbours];

    constexpr ChildTable() : neighbour{}, child{} {
        for (int c = 0; c < 8; ++c)
            for (int n = 0; n < neighbours; ++n) {
                const int offset[3] = {n % 3, n / 3 % 3, n / 9};
                int parent = 0, place = 0, stride = 1;
                for (int axis = 0; axis < 3; ++axis, stride *= 3) {
                    const int at = (c >> axis & 1) + offset[axis] + 1;  // 1 to 4: half cells from the corner
                    parent += stride * (at / 2);                        // of neighbour 0
                    place += (at & 1) << axis;
                }
                neighbour[c][n] = std::uint8_t(parent);
                child[c][n] = std::uint8_t(place);
            }
    }
};
inline constexpr ChildTable child_neighbours;

/// Of a cell and those around it, the groups of their children, or no_group where there are none.
using Around = std::array<std::uint64_t, neighbours>;

/// Of a cell of `level`, by search from the root.
Around around_cell(const Octree& octree, int level, const Cell& at);

/// The same of child `child`, whose cells are those of `level`.
Around around_child(const Level& level, const Around& parent, int child);

/// Child x + 2y + 4z of a cell.
inline Cell child_of(const Cell& at, int child) {
    const auto c = unsigned(child);
    return {2 * at[0] + (c & 1), 2 * at[1] + (c >> 1 & 1), 2 * at[2] + (c >> 2)};
}

}  // namespace its::octree
