#pragma once

#include "mesh/arrays.h"

namespace its::mesh {

/// What every algorithm asks of a mesh: at least one triangle, whose vertices exist and are finite.
/// \throws InputError that names the first that does not
void require_usable(const mesh::Arrays& mesh);

}  // namespace its::mesh
