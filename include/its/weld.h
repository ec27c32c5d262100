#pragma once

#include <cstdint>

#include "its/mesh.h"

/// Closing cracks: corners of a mesh that are nearer than a length become one.
namespace ITS_API its {

struct WeldReport {
    double length = 0;
    std::uint64_t corners = 0;     ///< distinct positions that became one with another
    std::uint64_t clusters = 0;    ///< the positions that they became
    std::uint64_t degenerate = 0;  ///< triangles that have become segments or points by it
    double largest_move = 0;       ///< of a corner, mesh units; more than the length where many lie in a row
};

struct Welded {
    Mesh mesh;
    WeldReport report;
};

/// Two positions of corners that are nearer than `length` become one, and so do those that a row of such
/// neighbours connects: what is left is at least `length` apart, and the result does not depend on any order
/// but for which position stays: that of the lowest number. Vertices and triangles keep their numbers; vertices
/// that no triangle uses any more stay where they are. Triangles two or three of whose corners became one are
/// then segments or points: they belong to M, but have no effect on what is inside.
/// \param length  mesh units, 0: nothing changes
/// \throws OptionError if it is negative or not finite; InputError on a mesh that inspect() refuses, or whose
///         coordinates are so large that they do not resolve the length
Welded weld(const MeshView& mesh, double length);

}  // namespace its
