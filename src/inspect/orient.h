#pragma once

#include <cstdint>
#include <vector>

#include "mesh/merged.h"

/// Consistent directions of triangles.
namespace its::inspector {

/// Triangles connected through edges that have exactly two of them form patches. Where not all of a patch can
/// agree, those agree that did, and then those that are made to at most edges.
struct Patches {
    bool orientable = true;  ///< all patches can be turned so that their triangles agree
    std::uint32_t count = 0;
    std::vector<std::uint32_t>
        patch;  ///< of each triangle; those that repeat a corner are patches of their own
    std::vector<std::uint8_t> against;  ///< 1 if a triangle runs against the first of its patch
    std::vector<std::uint8_t> mixed;    ///< of each patch: some triangle runs against the first
};

Patches find_patches(const mesh::Merged& mesh);

/// Turns, 1 for each triangle to turn around, that repair directions by majority: within a patch, triangles
/// that run against those with more of its area are turned; and then, the smallest first, patches with which
/// edges of more than two triangles are used more equally in both directions.
std::vector<std::uint8_t> majority_turns(const mesh::Merged& mesh, const Patches& patches);

/// Turns, 1 for each triangle to turn around, that make patches consistent and most of each one's area face to
/// where a ray to infinity crosses the mesh an even number of times: outward, and into cavities.
/// \param all  else patches that are not mixed stay as they are
/// Where edges have an odd number of triangles, or patches are not orientable, that is a guess.
std::vector<std::uint8_t> outward_turns(const mesh::Merged& mesh, const Patches& patches, bool all);

}  // namespace its::inspector
