#pragma once

#include <cstdint>

#include "its/mesh.h"

namespace its::bench {

/// OpenVDB's meshToVolume of a mesh whose vertices are in units of the voxel, as a narrow band of 3 voxels to
/// each side with `threads` threads. Returns the number of active voxels.
std::uint64_t openvdb_mesh_to_volume(const Mesh& mesh_in_voxels, int threads);

}  // namespace its::bench
