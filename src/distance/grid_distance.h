#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "its/mesh.h"
#include "octree/octree.h"

/// Distances from the grid points of an octree to M.
namespace its::distance {

/// The unsigned distance, in cell widths, at the 27 points of each group: result[level][27·group + point].
///
/// Octree and triangle tree are descended together: a group inherits from its parent the nodes that can be
/// nearest to some point of its cube, and its points start from the bounds D(p) ≤ D(g) + |p − g| of points g
/// that the parent has solved. Equal positions get equal bits, whichever group computed them.
/// \param positions  vertices in lattice coordinates
std::vector<std::vector<double>> grid_distances(const octree::Octree& octree, std::span<const Vec3> positions,
                                                std::span<const Triangle> triangles, const Progress& progress);

}  // namespace its::distance
