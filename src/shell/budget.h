#pragma once

#include <cstdint>

#include "its/mesh.h"

/// How much memory a build takes, before it takes it.
namespace its {

/// Bytes at the peak of a build with these numbers of finest cells and of (cell, triangle) pairs.
std::uint64_t build_bytes(std::uint64_t triangles, std::uint64_t surface_cells, std::uint64_t pairs);

struct CellEstimate {
    double surface_cells, pairs;
};

/// Expected numbers at a depth. A flat piece of area A and perimeter P meets 1 + ¾P + 1½A cells of a lattice in
/// random position (principal kinematic formula; lengths in cell widths): this gives the pairs. Triangles smaller
/// than a cell share it, so the cells are 1½A with a third for bends, and at most the pairs.
CellEstimate estimate_cells(const Mesh& mesh, int depth);

/// Refuses builds that would take more than `limit` bytes.
class MemoryBudget {
public:
    /// \param options_limit  bytes, or 0 for three quarters of what is free
    MemoryBudget(const Mesh& mesh, int depth, std::uint64_t options_limit);

    /// \throws MemoryError if the estimate for the whole build exceeds the limit
    void check_estimate() const;

    /// The numbers found at a level; each level below has at most about 4 times the cells. \throws MemoryError
    void check_level(int level, std::uint64_t cells, std::uint64_t pairs) const;

private:
    [[noreturn]] void refuse(double bytes) const;

    const Mesh& mesh_;
    int depth_;
    std::uint64_t limit_;
};

/// The depth at which a surface cell holds about four triangles, and that fits into `options_limit`.
int automatic_depth(const Mesh& mesh, std::uint64_t options_limit);

}  // namespace its
