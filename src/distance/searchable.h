#pragma once

#include <fmt/format.h>

#include "distance/closest_point.h"
#include "geometry/scaling.h"
#include "mesh/arrays.h"
#include "mesh/require.h"

namespace its::distance {

/// \throws InputError if a ClosestPointTree cannot be built over the mesh
inline void require_searchable(const mesh::Arrays& mesh) {
    if (mesh.triangles.size() >= ClosestPointTree::leaf_bit)
        throw InputError(fmt::format("the mesh has {} triangles; at most {} can be searched",
                                     mesh.triangles.size(), ClosestPointTree::leaf_bit - 1));
    mesh::require_usable(mesh);
}

/// Where a query point is looked for among scaled coordinates.
struct SearchPoint {
    Vec3 at;
    bool moved = false;  ///< it is far away, and `at` is nearer, in the same direction from (0, 0, 0)
};

/// Points p = t·d, |d| = 1, that are far from a mesh of coordinates up to R have the same nearest point q, but
/// for |q|²/2t: |p − q| = t − q·d + O(|q|²/t). So a point farther than 2²⁷R is looked for at 2²⁷R in its
/// direction: what is found is farther than the nearest by 3R²/2²⁷R < 2⁻²⁵R at most, a hundredth of the error
/// that is allowed for, 144u·2²⁷R > 2⁻¹⁹R. Farther away squared distances would not tell one triangle from
/// another, and overflow.
/// \param reach  the largest magnitude of the scaled coordinates
inline SearchPoint search_point(const Vec3& point, const geometry::Scaling& scaling, double reach) {
    constexpr int far = 27;
    const int exponent = geometry::exponent_of(point);
    const int nearest = std::ilogb(reach > 0 ? reach : 1.0) + far;
    if (exponent - scaling.exponent <= nearest) return {scaling.in(point)};
    return {geometry::times_power(point, nearest - exponent), true};
}

}  // namespace its::distance
