#pragma once

#include <array>
#include <cstdint>

#include "its/base.h"

/// Whether two triangles meet, exactly.
namespace its::geometry {

/// A triangle with the numbers of its vertices: equal numbers are the same point.
struct NumberedTriangle {
    std::array<std::uint32_t, 3> number;
    std::array<Vec3, 3> corner;
};

/// Whether two triangles have a point in common that is not part of a corner or edge that they share by number.
bool intersect(const NumberedTriangle& s, const NumberedTriangle& t);

}  // namespace its::geometry
