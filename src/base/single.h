#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "its/base.h"

namespace its {

/// The nearest 32-bit number. Where two neighbours are rounded so, GCC 12 takes double(float(x)) for x.
inline double to_single(double x) {
    volatile float rounded = float(x);
    return double(rounded);
}

/// The numbers that coordinates may be: doubles, 32-bit numbers, or 32-bit numbers about an origin that they
/// are added to, of which only the multiples of `quantum` up to 2²⁴ are used, so that sums are exact. Rounding
/// to them is monotone.
struct Rounding {
    enum class Kind : std::uint8_t { none, single, about_origin } kind = Kind::none;
    Vec3 origin;         ///< a multiple of the quantum on each axis
    double quantum = 0;  ///< a power of two

    /// About a point near the centre of a cube, whose faces are `reach` from it: 2²⁴ quanta or fewer, but more
    /// than 2²³. Sums are exact, and has_room() says so, if coordinates are below 2⁵² quanta.
    static Rounding about(const Vec3& centre, double reach) {
        int exponent = 0;
        (void)std::frexp(reach, &exponent);
        Rounding rounding{Kind::about_origin, {}, std::ldexp(1.0, exponent - 24)};
        for (int axis = 0; axis < 3; ++axis)
            rounding.origin[axis] = std::rint(centre[axis] / rounding.quantum) * rounding.quantum;
        return rounding;
    }
    /// Nor are there 32-bit numbers between multiples of less than 2⁻¹⁴⁹.
    bool has_room(double largest) const { return largest < 0x1p52 * quantum && quantum >= 0x1p-149; }

    double nearest(int axis, double x) const {
        switch (kind) {
            case Kind::single:
                return to_single(x);
            case Kind::about_origin:
                return origin[axis] +
                       std::clamp(std::rint((x - origin[axis]) / quantum), -0x1p24, 0x1p24) * quantum;
            case Kind::none:
                break;
        }
        return x;
    }
    Vec3 nearest(const Vec3& p) const { return {nearest(0, p.x), nearest(1, p.y), nearest(2, p.z)}; }

    /// The next such number in direction −1 or 1. Precondition: x is one, and they are not all doubles.
    double next(double x, int direction) const {
        if (kind == Kind::about_origin) return x + direction * quantum;
        return double(std::nextafter(float(x), float(direction) * std::numeric_limits<float>::infinity()));
    }
    /// The largest distance of neighbouring such numbers, where coordinates are at most `largest`; 0 for
    /// doubles.
    double unit(double largest) const {
        if (kind == Kind::about_origin) return quantum;
        return kind == Kind::none ? 0.0 : next(double(float(largest)), 1) - double(float(largest));
    }
};

}  // namespace its
