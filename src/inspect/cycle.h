#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "its/base.h"

/// Whether the boundary of a mesh cancels as a set of segments, which pairs of indices do not tell.
namespace its::inspector {

/// An edge that its triangles do not use as often one way as the other.
struct UnbalancedEdge {
    std::uint32_t low, high;  ///< numbers of two different positions
    std::int64_t excess;      ///< uses from low to high, less those from high to low; not 0
};

enum class Chain : std::uint8_t {
    signed_sum,  ///< each edge as often as its excess says
    modulo_two,  ///< each edge with an odd excess once, whatever its direction
};

/// What is left of a boundary.
struct Remainder {
    std::uint64_t open = 0;  ///< edges that do not cancel; 0: M is a cycle (modulo 2)
    /// Points within an edge that other edges cancel: it is split there on one side only.
    std::uint64_t t_junctions = 0;
};

/// Adds up the edges as segments in space. Exact: points are on an edge or they are not.
///
/// On each line through edges their sum is a chain of intervals. That is zero iff its own boundary is: at every
/// end of an edge, those on the line that leave the point and those that arrive there must be equally many. So
/// it is enough to look at the edges that share a point, and which of them are collinear there.
Remainder cancel_segments(std::span<const Vec3> points, std::span<const UnbalancedEdge> edges, Chain chain);

}  // namespace its::inspector
