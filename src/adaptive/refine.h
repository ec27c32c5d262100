#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "adaptive/open_sides.h"
#include "its/inspect.h"
#include "mesh/arrays.h"
#include "octree/lattice.h"
#include "octree/octree.h"
#include "signs/cell_sides.h"

/// The octree and the function f of a shell whose surface cells are as large as a window for f on M allows.
namespace its::adaptive {

/// What is to be refined. Lengths in finest cells of the lattice.
struct Task {
    const octree::Lattice& lattice;
    /// Vertices in lattice coordinates. Under the rule generalized mesh and positions are those of `open`'s
    /// closed mesh.
    std::span<const Vec3> positions;
    mesh::Arrays mesh;
    SignRule rule = SignRule::unsigned_rule;
    const OpenSides* open = nullptr;  ///< for the rule generalized
    double lower = 0, upper = 0;      ///< f on M shall be within, not counting γ
    int least_depth = 0;              ///< surface cells are at least this deep; the root's children are at 0
    /// Surface cells of more triangles are halved, too, unless they are no wider.
    std::uint32_t many_triangles = 16;
    double many_width = 0;
    std::uint64_t max_cells = ~std::uint64_t{0}, max_bytes = ~std::uint64_t{0};
    bool balanced = true;
    /// Whether a surface cell is to be halved whatever f does there, of its level and code; for tests.
    std::function<bool(int level, std::uint64_t code)> also = {};
};

struct Refined {
    int depth = 0;  ///< of the octree: levels finer than the finest surface cell are left out
    octree::Octree octree;
    std::vector<std::vector<double>> values;  ///< as in field::Field, in finest cells of the octree
    signs::CellSides sides;
    std::vector<std::uint8_t> corners_inside;  ///< of each surface cell: bit c: corner c, displaced
    std::vector<std::uint64_t> offset;         ///< of each surface cell, in `triangle`
    std::vector<std::uint32_t> triangle;       ///< ascending in each
    std::uint64_t distances = 0;               ///< evaluated
    int passes = 0;
    std::vector<std::uint64_t>
        coarse;  ///< numbers of surface cells that miss the window: the limits are reached
};

Refined refine(const Task& task, const Progress& progress);

}  // namespace its::adaptive
