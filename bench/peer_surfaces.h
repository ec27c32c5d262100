#pragma once

#include "its/mesh.h"

/// Other ways to wrap a mesh, each with one thread unless said.
namespace its::bench {

/// A surface, and the wall-clock seconds it took.
struct PeerSurface {
    Mesh mesh;
    double seconds = 0;
};

/// CGAL's alpha_wrap_3; alpha and offset in mesh units.
PeerSurface alpha_wrap(const Mesh& mesh, double alpha, double offset);

/// OpenVDB: meshToVolume with this voxel, and volumeToMesh at `level` (mesh units, from the surface) without
/// adaptivity, its quads split; `seconds` is of volumeToMesh alone, `build_seconds` of meshToVolume.
PeerSurface volume_to_mesh(const Mesh& mesh, double voxel, double level, int threads, double& build_seconds);

}  // namespace its::bench
