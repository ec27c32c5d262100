#pragma once

#include "its/mesh.h"
#include "octree/lattice.h"

/// Measured distances between meshes.
namespace its {

/// The largest distance, in mesh units, from a vertex or centroid of `from`'s triangles to the surface of `to`:
/// a lower bound of the one-sided Hausdorff distance, exact up to rounding at these points. Both meshes lie in
/// the lattice's root cube and have triangles.
double measure_distance(const Mesh& from, const Mesh& to, const Lattice& lattice, const Progress& progress);

}  // namespace its
