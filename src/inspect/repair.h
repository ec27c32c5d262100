#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/merged.h"
#include "winding/filling.h"

namespace its::inspector {

/// Directions of the triangles of a mesh with boundary.
struct Directions {
    std::vector<std::uint8_t> turn;  ///< 1 for each triangle to turn around; empty: none
    std::uint64_t repaired = 0;      ///< triangles turned because others disagreed with them
    std::uint64_t inconsistent =
        0;                  ///< edges that two triangles run through in the same direction all the same
    bool reversed = false;  ///< then all triangles are turned around, besides
    double separating = 0;  ///< share of the area that separates inside from outside then; see Sides
    std::optional<winding::Filling> filling;  ///< of the mesh thus turned, unless it is reversed
};

/// Of the directions as given, repaired by majority, and repaired so that patches face outward, those with
/// which most of the area separates inside from outside; the first of these that do so for nearly all of it. As
/// given only if no two triangles disagree.
/// \param inconsistent  the edges where two triangles disagree
Directions choose_directions(const mesh::Merged& mesh, std::uint64_t inconsistent);

/// The share of the area that counts as nearly all of it: what is asked for where triangles disagree.
inline constexpr double nearly_all = 0.9;

}  // namespace its::inspector
