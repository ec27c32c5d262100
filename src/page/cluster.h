#pragma once

#include "its/mesh.h"

namespace its::page {

/// A coarser mesh for display, with at most `most` triangles: vertices within a cell of a grid become one at
/// their mean, and triangles that then have fewer than three corners go, as do copies. The grid is the finest
/// of 2ⁿ cells a side, n ≤ 11, that is coarse enough. A mesh that is small enough is returned as it is.
Mesh cluster(const Mesh& mesh, std::uint64_t most);

}  // namespace its::page
