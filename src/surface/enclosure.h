#pragma once

#include <cstdint>
#include <vector>

#include "its/mesh.h"
#include "shell/shell_data.h"

/// Which parts of M a surface encloses, exactly.
namespace its::surface {

struct Enclosure {
    std::uint64_t components = 0;  ///< of M: triangles that share vertices
    std::vector<Vec3> wrong;       ///< a vertex of each component about which the winding number is another one
};

/// Components of M.
std::uint64_t count_parts(const shell::MeshArrays& mesh);

/// The surface's winding number about a vertex of each component of M. If they do not meet, it tells of the
/// whole component.
/// \param wanted  1: enclosed, 0: not
Enclosure enclosure(const shell::MeshArrays& mesh, const Mesh& surface, int wanted, const Progress& progress);

}  // namespace its::surface
