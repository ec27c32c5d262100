#pragma once

#include <fmt/format.h>

#include "distance/closest_point.h"
#include "mesh/arrays.h"
#include "mesh/require.h"

namespace its::distance {

/// \throws InputError if a ClosestPointTree cannot be built over the mesh
inline void require_searchable(const mesh::Arrays& mesh) {
    if (mesh.triangles.size() >= ClosestPointTree::leaf_bit)
        throw InputError(fmt::format("the mesh has {} triangles; at most {} can be searched",
                                     mesh.triangles.size(), ClosestPointTree::leaf_bit - 1));
    mesh::require_usable(mesh, mesh::largest_coordinate);
}

}  // namespace its::distance
