#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "its/inspect.h"
#include "mesh/arrays.h"

namespace its::inspector {

/// inspect(), with what `auto` does to the mesh before it builds.
struct Inspection {
    MeshReport report;
    std::vector<std::uint8_t> turn;  ///< 1 for each triangle to turn around; empty: none
};

Inspection examine(const mesh::Arrays& mesh);

/// The mesh with the second and third corner of these triangles exchanged.
Mesh turned(Mesh mesh, std::span<const std::uint8_t> turn);

}  // namespace its::inspector
