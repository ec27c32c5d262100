#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "inspect/parts.h"
#include "its/base.h"
#include "mesh/merged.h"

/// How the closed parts of a mesh lie in each other.
namespace its::inspector {

/// One closed part among the others.
struct Placed {
    std::uint32_t part = 0;  ///< of Parts
    Box bounds;
    double volume = 0;  ///< the integral of its winding number
    int facing = 0;     ///< 1 outward, −1 inward, 0: neither, since it encloses nothing
    std::vector<std::uint32_t> containers = {};  ///< the placed that it lies in, the outermost first
    bool crosses = false;                        ///< its surface crosses that of another, or is the same
    bool unclear = false;                        ///< those that it lies in do not lie in each other
};

/// All closed parts, in order, by exact winding numbers about points of each other.
std::vector<Placed> place_parts(const mesh::Merged& mesh, const Parts& parts);

/// 1 for each of the placed to turn around so that they face outward, inward, outward, … as they lie in each
/// other. Those that cross others or are unclear stay.
std::vector<std::uint8_t> nesting_turns(std::span<const Placed> placed);

}  // namespace its::inspector
