#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "its/mesh.h"

/// A model to play with, for those who have none at hand.
namespace its::examples {

/// A trefoil knot thickened to a tube whose section, a rounded triangle, turns eleven thirds of a turn on the
/// way. Closed, smooth, outward, free of self-intersections, about 5.7 × 5.6 × 2.9 units; 2·along·around
/// triangles. Both counts are at least 3.
inline Mesh twisted_knot(int along, int around) {
    along = std::max(along, 3);
    around = std::max(around, 3);
    constexpr double pi = std::numbers::pi;
    constexpr double major = 2.0,
                     minor = 1.0;       // the knot winds twice around this torus, three times through it
    constexpr double thickness = 0.42;  // mean radius of the tube; from 0.64 on it could touch itself

    Mesh mesh;
    mesh.vertices.reserve(std::size_t(along) * std::size_t(around));
    for (int i = 0; i < along; ++i) {
        const double t = 2 * pi * i / along, u = 3 * t, v = 2 * t;
        const double ring = major + minor * std::cos(u);
        const double centre[3] = {ring * std::cos(v), ring * std::sin(v), minor * std::sin(u)};
        // The torus' normal is at right angles to the knot, so it carries a frame that closes up.
        const double normal[3] = {std::cos(u) * std::cos(v), std::cos(u) * std::sin(v), std::sin(u)};
        double tangent[3] = {-3 * minor * std::sin(u) * std::cos(v) - 2 * ring * std::sin(v),
                             -3 * minor * std::sin(u) * std::sin(v) + 2 * ring * std::cos(v),
                             3 * minor * std::cos(u)};
        const double speed = std::hypot(tangent[0], tangent[1], tangent[2]);
        for (double& c : tangent) c /= speed;
        const double side[3] = {tangent[1] * normal[2] - tangent[2] * normal[1],
                                tangent[2] * normal[0] - tangent[0] * normal[2],
                                tangent[0] * normal[1] - tangent[1] * normal[0]};
        for (int j = 0; j < around; ++j) {
            const double angle = 2 * pi * j / around;
            const double radius =
                thickness * (1 + 0.2 * std::cos(3 * angle + 11 * t)) * (1 + 0.07 * std::cos(24 * t));
            const double a = radius * std::cos(angle), b = radius * std::sin(angle);
            mesh.vertices.push_back({centre[0] + a * normal[0] + b * side[0],
                                     centre[1] + a * normal[1] + b * side[1],
                                     centre[2] + a * normal[2] + b * side[2]});
        }
    }
    const auto at = [&](int i, int j) { return std::uint32_t((i % along) * around + j % around); };
    for (int i = 0; i < along; ++i) {
        for (int j = 0; j < around; ++j) {
            mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
        }
    }
    return mesh;
}

}  // namespace its::examples
