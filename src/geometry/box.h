#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "its/base.h"

namespace its::geometry {

/// Holds no point; extended by points, it is the smallest box around them.
inline constexpr Box empty_box = {
    {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
     std::numeric_limits<double>::infinity()},
    {-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
     -std::numeric_limits<double>::infinity()}};

inline void extend(Box& box, const Vec3& p) {
    box.min = {std::min(box.min.x, p.x), std::min(box.min.y, p.y), std::min(box.min.z, p.z)};
    box.max = {std::max(box.max.x, p.x), std::max(box.max.y, p.y), std::max(box.max.z, p.z)};
}

inline void extend(Box& box, const Box& other) {
    extend(box, other.min);
    extend(box, other.max);
}

inline Box bounds(std::span<const Vec3> points) {
    Box box = empty_box;
    for (const Vec3& p : points) extend(box, p);
    return box;
}

/// Of the corners that triangles use.
inline Box bounds(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 3>> triangles) {
    Box box = empty_box;
    for (const auto& t : triangles)
        for (const std::uint32_t v : t) extend(box, points[v]);
    return box;
}

inline bool contains(const Box& box, const Vec3& p) {
    return box.min.x <= p.x && p.x <= box.max.x && box.min.y <= p.y && p.y <= box.max.y && box.min.z <= p.z &&
           p.z <= box.max.z;
}

/// Whether two boxes share a point.
inline bool overlap(const Box& a, const Box& b) {
    return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y &&
           a.min.z <= b.max.z && b.min.z <= a.max.z;
}

}  // namespace its::geometry
