#pragma once

#include <array>

#include "geometry/vec3.h"

namespace its::formats {

/// An affine map: columns of the linear part, and the shift.
struct Affine {
    Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, shift;

    Vec3 linear(const Vec3& p) const { return p.x * x + p.y * y + p.z * z; }
    Vec3 operator()(const Vec3& p) const { return linear(p) + shift; }
    Affine operator*(const Affine& inner) const {
        return {linear(inner.x), linear(inner.y), linear(inner.z), (*this)(inner.shift)};
    }
    double determinant() const { return dot(x, cross(y, z)); }
};

/// Scales, then turns by a quaternion (x, y, z, w), then shifts.
inline Affine placed(const Vec3& shift, const std::array<double, 4>& quaternion, const Vec3& scale) {
    const auto [x, y, z, w] = quaternion;
    return {scale.x * Vec3{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
            scale.y * Vec3{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
            scale.z * Vec3{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}, shift};
}

}  // namespace its::formats
