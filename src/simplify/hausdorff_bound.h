#pragma once

#include "its/mesh.h"

/// A proven bound of a one-sided Hausdorff distance.
namespace its::simplifier {

/// An upper bound of the largest distance d(x, N) of any point x of the surface M, above it by at most a
/// twentieth and rounding errors; infinity as soon as the distance is known to be above `limit`, or if the
/// meshes are too near to each other for the work that is allowed. By branch and bound, see
/// docs/design/simplify.md. Mesh units.
/// \param m,  n  with triangles, which use all vertices
double hausdorff_bound(const Mesh& m, const Mesh& n, double limit, const Progress& progress);

}  // namespace its::simplifier
