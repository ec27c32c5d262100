#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "its/base.h"

namespace its::distance {

/// Sorts numbers of points in the order of a Hilbert curve through a cube around them: points that follow each
/// other are near to each other. Points of one cell of 2⁻¹¹ of the cube's side keep their order.
/// \param points  those of the numbers are finite
std::vector<std::uint32_t> curve_order(std::span<const Vec3> points, std::span<const std::uint32_t> numbers);

}  // namespace its::distance
