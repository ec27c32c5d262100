#pragma once

#include "shell/shell_data.h"

namespace its::shell {

/// Checks every invariant that queries rely on, so that none of them can read out of bounds, loop for ever or
/// meet a NaN, whatever file the data came from: the lattice is exact; levels are sorted, in range and
/// linked; arrays have the sizes that follow from the octree; indices are in range; numbers are finite; bounds
/// are ordered; `info` agrees with the arrays. Linear time, parallel.
/// Not checked: that values are distances and that bounds contain f(M); `verify` does that with the mesh.
/// \throws InputError naming the first invariant that is broken.
void validate(const ShellData& shell);

/// The two parts of validate(). The first: lattice, mesh, octree, the sizes of all arrays, `info`. The second,
/// if the first holds: the values of f, the bounds and the triangle lists of surface cells. Where only the
/// first was done, queries may meet any number in these, and TriangleList gives only triangles that exist.
void validate_structure(const ShellData& shell);
void validate_payload(const ShellData& shell);

}  // namespace its::shell
