#pragma once

#include <span>

#include "its/distance.h"

namespace its::distance {

/// The arrays of a mesh, wherever they lie.
struct MeshView {
    std::span<const Vec3> vertices;
    std::span<const Triangle> triangles;
};

/// mesh_distance() of arrays that are known to be a mesh it takes, on the threads of the caller.
MeshDistance mesh_distance(const MeshView& from, const MeshView& to, std::uint64_t samples,
                           const Progress& progress);

}  // namespace its::distance
