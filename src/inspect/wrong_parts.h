#pragma once

#include "inspect/inspect.h"
#include "mesh/merged.h"

namespace its::inspector {

/// Fills in what is said about closed parts, and the triangles that turn_parts() turns.
/// \param mesh  with the triangles of out.turn turned around; all else in `out` is known
void examine_parts(const mesh::Merged& mesh, Inspection& out);

}  // namespace its::inspector
