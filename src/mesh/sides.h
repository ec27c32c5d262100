#pragma once

#include "its/mesh.h"
#include "mesh/merged.h"

namespace its {

/// What the winding numbers on the two sides of M say about it, by samples spread evenly over its area. A side
/// is clearly inside or outside where its winding number is at least ¼ away from ½.
struct Sides {
    double separates =
        0;  ///< share of the area with outside, clearly, where the normal points, and inside behind
    double reversed = 0;      ///< the same for the mesh with all triangles turned around
    bool any_inside = false;  ///< some sample has a winding number over ½ on either side
};

/// \param mesh, merged  the same mesh
Sides sample_sides(const Mesh& mesh, const Merged& merged);

}  // namespace its
