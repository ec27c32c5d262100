#pragma once

#include "its/distance.h"
#include "mesh/arrays.h"

namespace its::distance {

/// mesh_distance() of arrays that are known to be a mesh it takes, on the threads of the caller.
MeshDistance mesh_distance(const mesh::Arrays& from, const mesh::Arrays& to, std::uint64_t samples,
                           const Progress& progress);

}  // namespace its::distance
