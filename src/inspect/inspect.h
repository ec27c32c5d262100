#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "geometry/scaling.h"
#include "its/inspect.h"
#include "mesh/arrays.h"
#include "winding/filling.h"

namespace its::inspector {

/// inspect(), with what `auto` does to the mesh before it builds.
struct Inspection {
    MeshReport report;
    std::vector<std::uint8_t> turn;  ///< 1 for each triangle to turn around; empty: none
    /// What fills the holes of the mesh with these turned around, where it was looked at: signs need it again.
    std::optional<winding::Filling> filling;
    std::vector<std::uint8_t> part_turn;  ///< those to turn around besides, for turn_parts(); empty: none
};

/// Reports each step, of which the longest takes about a third of the time.
/// \throws Cancelled
Inspection examine(const mesh::Arrays& mesh, const Progress& progress = {});

/// What was found out about a scaled mesh. A volume may be infinite then, or 0.
PartsReport in_units_of_caller(PartsReport parts, const geometry::Scaling& scaling);

/// The triangles, those with a 1 with their second and third corner exchanged.
std::vector<Triangle> turned(std::vector<Triangle> triangles, std::span<const std::uint8_t> turn);
Mesh turned(Mesh mesh, std::span<const std::uint8_t> turn);

}  // namespace its::inspector
