#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "base/platform/compiler.h"
#include "base/rounding.h"
#include "geometry/vec3.h"

/// Solid angles of triangles, and sums of many angles.
namespace its::winding {

/// atan2(y, x) but for less than quick_error. Straight selections: a loop becomes vector code, with the same
/// bits. In the octant at 0 the angle is π/8 + atan z, |z| ≤ √2 − 1; the series of atan z is cut off after z¹⁷,
/// which errs by less than its next term, z¹⁹/19 < 3e-9.
constexpr double quick_error = 0x1p-28;
ITS_INLINE double quick_atan2(double y, double x) {
    constexpr double tangent = std::numbers::sqrt2 - 1;
    const double ax = std::abs(x), ay = std::abs(y);
    const bool steep = ay > ax;
    const double large = steep ? ay : ax, small = steep ? ax : ay;
    const double t = small / (large > 0 ? large : 1.0), z = (t - tangent) / (1 + tangent * t), zz = z * z;
    double series = 1.0 / 17;
    series = 1.0 / 15 - zz * series;
    series = 1.0 / 13 - zz * series;
    series = 1.0 / 11 - zz * series;
    series = 1.0 / 9 - zz * series;
    series = 1.0 / 7 - zz * series;
    series = 1.0 / 5 - zz * series;
    series = 1.0 / 3 - zz * series;
    const double octant = std::numbers::pi / 8 + z * (1 - zz * series);
    const double quadrant = steep ? std::numbers::pi / 2 - octant : octant;
    return std::copysign(x < 0 ? std::numbers::pi - quadrant : quadrant, y);
}

/// Sums of arguments of complex numbers, not modulo 2π, with bounds on their errors. The numbers of a sum are
/// multiplied and turns are counted; no function is taken before the end.
template <int lanes>
class AngleSums {
public:
    AngleSums() {
        for (int i = 0; i < lanes; ++i) x_[i] = 1, y_[i] = quarters_[i] = error_[i] = 0;
    }

    /// Adds arg(re + i·im) to sum i, where it has the sign of im for re < 0, be it ±0; the number is off by at
    /// most `error`. 0 adds nothing. Straight selections: a loop over i becomes vector code, with the same
    /// bits.
    ITS_INLINE void add(int i, double re, double im, double error) {
        const double sum = std::abs(re) + std::abs(im);  // between the modulus and √2 times it
        const double inverse = 1 / (sum > 0 ? sum : 1.0);
        error_[i] += (std::numbers::sqrt2 * std::numbers::pi / 2) * (error * inverse);
        // What lies in the left half-plane is turned by a right angle into the other: i·(−i) or (−i)·i.
        const double side = std::copysign(1.0, im);
        const double turned = re < 0 ? std::abs(im) : re;
        const double a = sum > 0 ? turned * inverse : 1.0;
        const double b = (re < 0 ? -re * side : im) * inverse;
        // Each step turns by a right angle at most: the sum passes π, up or down, where the product changes
        // sides within the left half-plane. Rounding at the border itself does no harm: either way is right.
        const double x = x_[i] * a - y_[i] * b, y = x_[i] * b + y_[i] * a + 0.0;  // −0 counts as +0
        const double passed = y < 0 ? (y_[i] < 0 ? 0.0 : 4.0) : (y_[i] < 0 ? -4.0 : 0.0);
        const double left = x < 0 ? passed : 0.0;
        quarters_[i] += (re < 0 ? side : 0.0) + (x_[i] < 0 ? left : 0.0);
        // A factor's modulus is 1/√2 at least: far from underflow.
        const double scale = std::abs(x) + std::abs(y) < 0x1p-200 ? 0x1p200 : 1.0;
        x_[i] = scale * x;
        y_[i] = scale * y;
    }

    double sum(int i) const { return std::atan2(y_[i], x_[i]) + std::numbers::pi / 2 * quarters_[i]; }

    /// The same but for less than quick_error.
    ITS_INLINE double quick_sum(int i) const {
        return quick_atan2(y_[i], x_[i]) + std::numbers::pi / 2 * quarters_[i];
    }

    /// Bound on |sum − the exact sum| after `count` numbers: what they were off by, less than 8u for the
    /// scaling and the product of each, and 8u for the last steps and each of their quarter turns.
    double error(int i, double count) const {
        return error_[i] + 8 * unit_roundoff * (count + 2 + std::abs(quarters_[i]));
    }

private:
    double x_[lanes], y_[lanes], quarters_[lanes], error_[lanes];
};

/// A point seen from another.
struct Sight {
    double x = 0, y = 0, z = 0, length = 0;
};

/// Half of a solid angle: the argument of re + i·im, which is off by at most `error`.
struct SolidAngle {
    double re, im, error;
    double doubtful;  ///< infinity if the sign of a half turn is in doubt; else 0
};

/// Half of the solid angle of triangle abc seen from the origin, > 0 where abc is clockwise from there (the
/// origin is behind it): Van Oosterom and Strackee 1983. Each coordinate may be off by a relative u, as
/// differences are. With P = |a||b||c| the triple product errs by less than 10u·P (six monomials, at most
/// 1.2 P together, of eight roundings) and the real part by less than 24u·P. The sign of a half turn is in
/// doubt if the origin is in the triangle but for rounding.
ITS_INLINE SolidAngle half_solid_angle(const Sight& a, const Sight& b, const Sight& c) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double ab = a.length * b.length, product = ab * c.length;
    const double re = product + (a.x * b.x + a.y * b.y + a.z * b.z) * c.length +
                      (b.x * c.x + b.y * c.y + b.z * c.z) * a.length +
                      (c.x * a.x + c.y * a.y + c.z * a.z) * b.length;
    const double im =
        a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x);
    // By underflow a product loses 2⁻¹⁰⁷⁴, a length therefore √(3·2⁻¹⁰⁷⁴), twice in the real part.
    const double error =
        32 * unit_roundoff * product + 0x1p-535 * (ab + b.length * c.length + c.length * a.length) + 0x1p-1000;
    const double behind = re <= error ? infinity : 0.0;
    return {re, im, error, std::abs(im) <= error ? behind : 0.0};
}

/// \return whether it is in doubt, as 0 or infinity
template <int lanes>
ITS_INLINE double add_half_solid_angle(AngleSums<lanes>& sums, int i, const Sight& a, const Sight& b,
                                       const Sight& c) {
    const SolidAngle s = half_solid_angle(a, b, c);
    sums.add(i, s.re, s.im, s.error);
    return s.doubtful;
}

}  // namespace its::winding
