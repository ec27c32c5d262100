#pragma once

#include <cstdint>
#include <vector>

#include "mesh/merged.h"

/// Consistent directions of triangles.
namespace its::inspector {

/// Triangles connected through edges that have exactly two of them form patches.
struct Patches {
    bool orientable = true;  ///< all patches can be turned so that their triangles agree
    std::uint32_t count = 0;
    std::vector<std::uint32_t>
        patch;  ///< of each triangle; those that repeat a corner are patches of their own
    std::vector<std::uint8_t> against;  ///< 1 if a triangle runs against the first of its patch
    std::vector<std::uint8_t> mixed;    ///< of each patch: some triangle runs against the first
};

Patches find_patches(const mesh::Merged& mesh);

/// Turns, 1 for each triangle to turn around, that make patches consistent and most of each one's area face to
/// where a ray to infinity crosses the mesh an even number of times: outward, and into cavities.
/// \param all  else patches that are not mixed stay as they are
/// Precondition: orientable, and every edge has an even number of triangles.
std::vector<std::uint8_t> outward_turns(const mesh::Merged& mesh, const Patches& patches, bool all);

}  // namespace its::inspector
