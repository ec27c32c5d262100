#pragma once

#include <array>
#include <cstdint>

#include "its/base.h"

/// The triangles of a level set within one lattice cell. See docs/design/surface.md for the proofs.
namespace its::surface {

/// Names of a patch's vertices within its cell: 0 to 11 lie on the cell's edges, first_inner + c between the
/// cell's centre and corner c.
inline constexpr int first_inner = 12, patch_vertices = 20;

/// Edge 4·axis + a + 2b runs along `axis`, at a along axis + 1 and b along axis + 2 (modulo 3).
inline constexpr int edge_start(int edge) {
    const int axis = edge / 4;
    return (edge & 1) << (axis + 1) % 3 | (edge >> 1 & 1) << (axis + 2) % 3;
}
inline constexpr int edge_end(int edge) {
    return edge_start(edge) | 1 << edge / 4;
}

/// How a level set runs through a cell, by the signs of its corners alone and, where a face has two diagonal
/// corners below and two above, by the asymptotic decider.
struct Crossing {
    unsigned below = 0;         ///< bit c: corner c is below the level
    unsigned joined = 0;        ///< bit f: on face f, corners 0 and 3 are joined; for ambiguous faces
    bool star = false;          ///< some face is ambiguous: the patch is made around the cell's centre
    bool centre_below = false;  ///< where star

    /// Corners that have a vertex between them and the centre.
    unsigned inner() const { return !star ? 0 : centre_below ? ~below & 0xff : below; }
    bool has(int vertex) const {
        return vertex < first_inner ? crossed(vertex) : inner() >> (vertex - first_inner) & 1;
    }
    bool crossed(int edge) const { return (below >> edge_start(edge) ^ below >> edge_end(edge)) & 1; }
};

/// \param value  at the corners minus the level; a corner at the level counts as above
Crossing make_crossing(const std::array<double, 8>& value);

/// Number of vertices on edges that start at the cell's corner 0, which are edges 0, 4 and 8.
inline int own_edges(unsigned below) {
    return int((below ^ below >> 1) & 1) + int((below ^ below >> 2) & 1) + int((below ^ below >> 4) & 1);
}

struct Patch {
    static constexpr int capacity = 24;  ///< six faces with four triangles each
    std::array<std::array<std::uint8_t, 3>, capacity> triangle;
    int size = 0;

    void add(int a, int b, int c) {
        triangle[std::size_t(size++)] = {std::uint8_t(a), std::uint8_t(b), std::uint8_t(c)};
    }
};

/// A closed curve on the surface of a cell, as edges in the order that has the part above on its left seen from
/// outside.
struct Loop {
    std::uint8_t size = 0;
    std::array<std::uint8_t, 12> edge = {};
};

/// The loops of a cell without ambiguous faces: two triangles around opposite corners, or one of 3 to 6 edges.
struct Loops {
    bool ambiguous = false;
    std::uint8_t count = 0;
    std::array<Loop, 2> loop = {};
};
const Loops& loops_of(unsigned below);

/// A fan of the loop around its vertex number `apex`.
void add_fan(const Loop& loop, int apex, Patch& patch);

/// The patch of a crossing with `star`.
void add_star(const Crossing& crossing, Patch& patch);

}  // namespace its::surface
