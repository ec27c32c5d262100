#pragma once

#include <cmath>
#include <numbers>

#include "base/rounding.h"
#include "geometry/vec3.h"

/// Solid angles of triangles, and sums of many angles.
namespace its {

/// A sum of arguments of complex numbers, not modulo 2π, with a bound on its error. Numbers in the right
/// half-plane are multiplied and turns are counted; an arc tangent is taken for the others only.
class AngleSum {
public:
    /// Adds arg(re + i·im), a number that is off by at most `error`; (0, 0) makes the bound infinite.
    void add(double re, double im, double error) {
        const double size = std::abs(re) + std::abs(im);  // between the modulus and √2 times it
        error_ += error > 0 ? std::numbers::sqrt2 * std::numbers::pi / 2 * error / size : 0.0;
        ++count_;
        if (!(re > 0)) {
            rest_ += std::atan2(im, re);
            error_ += unit_roundoff * std::abs(rest_);
            return;
        }
        // Each step turns by less than a right angle: the sum passes π, up or down, where the product changes
        // sides within the left half-plane. Rounding at the border itself does no harm: either way is right.
        const double a = re / size, b = im / size;
        const double x = x_ * a - y_ * b, y = x_ * b + y_ * a;
        if (x_ < 0 && x < 0 && (y_ < 0) != (y < 0)) turns_ += y < 0 ? 1 : -1;
        x_ = x;
        y_ = y + 0.0;  // −0 counts as +0
        if (x_ * x_ + y_ * y_ < 0x1p-200) normalise();
    }

    double sum() const { return rest_ + std::atan2(y_, x_) + 2 * std::numbers::pi * turns_; }

    /// Bound on |sum() − the exact sum|: what the numbers were off by, the roundings of adding arc tangents,
    /// and for each number less than 8u: a division and a product, or an arc tangent of at most π. 8u more for
    /// each half turn in the last sum.
    double error() const { return error_ + 8 * unit_roundoff * (count_ + 2 + std::abs(sum())); }

private:
    void normalise() {
        const double size = std::sqrt(x_ * x_ + y_ * y_);
        x_ /= size;
        y_ /= size;
    }

    double x_ = 1, y_ = 0, rest_ = 0, error_ = 0;
    int turns_ = 0;
    int count_ = 0;
};

/// Adds half of the solid angle of triangle abc seen from the origin, > 0 where abc is clockwise from there
/// (the origin is behind it): Van Oosterom and Strackee 1983. Each coordinate may be off by a relative u, as
/// differences are. With P = |a||b||c| the triple product errs by less than 10u·P (six monomials, at most
/// 1.2 P together, of eight roundings) and the real part by less than 24u·P.
inline void add_half_solid_angle(AngleSum& sum, const Vec3& a, const Vec3& b, const Vec3& c) {
    const double la = norm(a), lb = norm(b), lc = norm(c);
    const double re = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    sum.add(re, dot(a, cross(b, c)), 32 * unit_roundoff * la * lb * lc);
}

}  // namespace its
