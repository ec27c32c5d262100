#pragma once

#include "its/mesh.h"

namespace its::bench {

struct TwoDistances {
    double there, back;
};

/// Measured one-sided Hausdorff distances from `a` to `b` and back, at vertices and centroids of triangles.
TwoDistances distances_between(const Mesh& a, const Mesh& b);

}  // namespace its::bench
