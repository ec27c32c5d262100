#pragma once

#include <limits>

#include "mesh/arrays.h"

namespace its::mesh {

/// Beyond this magnitude of coordinates, products of distances could overflow.
inline constexpr double largest_coordinate = 1e75;

/// What every algorithm asks of a mesh: at least one triangle, whose vertices exist, are finite and have no
/// coordinate of a magnitude beyond `largest`. \throws InputError that names the first that does not
void require_usable(const mesh::Arrays& mesh, double largest = std::numeric_limits<double>::max());

}  // namespace its::mesh
