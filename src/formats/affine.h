#pragma once

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

}  // namespace its::formats
