#pragma once

#include <cstdint>
#include <vector>

#include "field/field.h"
#include "its/base.h"
#include "octree/octree.h"
#include "surface/memory_guard.h"

/// f at the points of a lattice of any width.
namespace its::surface {

/// A lattice cell or point as one number, in the order of z, then y, then x.
inline std::uint64_t key_of(const octree::Cell& at) {
    return at[0] | std::uint64_t{at[1]} << 21 | std::uint64_t{at[2]} << 42;
}
inline octree::Cell cell_of(std::uint64_t key) {
    return {std::uint32_t(key & 0x1fffff), std::uint32_t(key >> 21 & 0x1fffff), std::uint32_t(key >> 42)};
}

struct LatticePoint {
    std::uint64_t key;
    double value;
};

/// The lattice points at which f is in [low, high], in the order of their keys. In one pass over the octree,
/// which leaves out what no lattice point is in.
/// \param ratio  width of a lattice cell in finest cells
/// \param side   lattice cells along the root cube
std::vector<LatticePoint> find_lattice_points(const octree::Octree& octree, const field::Field& field,
                                              double ratio, std::uint32_t side, double low, double high,
                                              MemoryGuard& guard, const Progress& progress);

}  // namespace its::surface
