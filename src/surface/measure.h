#pragma once

#include <span>

#include "its/mesh.h"

/// Measured distances between meshes.
namespace its {

/// The arrays of a mesh, wherever they lie.
struct MeshView {
    std::span<const Vec3> vertices;
    std::span<const Triangle> triangles;
};

template <class AnyMesh>
MeshView view(const AnyMesh& mesh) {
    return {mesh.vertices, mesh.triangles};
}

/// The largest distance, in mesh units, from a vertex or centroid of `from`'s triangles to the surface of `to`:
/// a lower bound of the one-sided Hausdorff distance, exact up to rounding at these points. Both meshes have
/// triangles.
double measure_distance(const MeshView& from, const MeshView& to, const Progress& progress);

}  // namespace its
