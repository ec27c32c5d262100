#pragma once

#include "mesh/merged.h"
#include "winding/filling.h"

namespace its::inspector {

/// What the winding numbers on the two sides of M say about it, by samples spread evenly over its area. A side
/// is clearly outside or inside where its winding number is within 3/8 of 0 or of 1: at the middle of a dome,
/// if that is higher than a quarter of its radius.
struct Sides {
    /// Share of the area with outside, clearly, where the normal points, and inside behind.
    double separates = 0;
    double reversed = 0;      ///< the same for the mesh with all triangles turned around
    bool any_inside = false;  ///< some sample has a winding number over ½ on either side
};

/// \param filling  of this mesh
Sides sample_sides(const mesh::Merged& mesh, const winding::Filling& filling);

}  // namespace its::inspector
