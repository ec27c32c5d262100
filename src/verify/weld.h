#pragma once

#include "its/mesh.h"

/// The verifier's own welding, to tell whether a shell's mesh is the given one as ShellInfo::weld says.
namespace its::verifier {

/// Positions of corners that are nearer than `length` become one, and so do those that rows of such neighbours
/// connect: the vertex of the lowest number stays. Vertices and triangles keep their numbers.
Mesh welded(const Mesh& mesh, double length);

}  // namespace its::verifier
