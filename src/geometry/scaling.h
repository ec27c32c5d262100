#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/vec3.h"

/// Exact scaling by powers of two, so that what holds at common sizes holds at all: docs/design/base.md.
namespace its::geometry {

/// v·2^e, rounded once where the result is subnormal; infinite beyond all doubles.
inline Vec3 times_power(const Vec3& v, int e) {
    return {std::ldexp(v.x, e), std::ldexp(v.y, e), std::ldexp(v.z, e)};
}

inline double largest_magnitude(const Vec3& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// The exponent of a finite vector's largest coordinate, which is in [2^e, 2^(e + 1)); the least that there is
/// for the zero vector.
inline int exponent_of(const Vec3& v) {
    const double largest = largest_magnitude(v);
    return largest > 0 ? std::ilogb(largest) : -1074;
}

/// |v| of a finite vector: no square overflows or underflows. Infinite only where |v| is beyond all doubles.
inline double norm_at_any_size(const Vec3& v) {
    const int e = exponent_of(v);
    return std::ldexp(norm(times_power(v, -e)), e);
}

/// |p − q| of finite points, likewise: even the difference may be beyond all doubles.
inline double distance_at_any_size(const Vec3& p, const Vec3& q) {
    const int e = std::max(exponent_of(p), exponent_of(q)) + 1;
    if (e < 1000) return norm_at_any_size(p - q);
    return std::ldexp(norm_at_any_size(times_power(p, -e) - times_power(q, -e)), e);
}

/// Between a caller's lengths and those that are computed with: in(x) = x·2^−exponent.
struct Scaling {
    int exponent = 0;

    double in(double x) const { return exponent == 0 ? x : std::ldexp(x, -exponent); }
    double out(double x) const { return exponent == 0 ? x : std::ldexp(x, exponent); }
    Vec3 in(const Vec3& v) const { return exponent == 0 ? v : times_power(v, -exponent); }
    Vec3 out(const Vec3& v) const { return exponent == 0 ? v : times_power(v, exponent); }
    Box out(const Box& box) const { return {out(box.min), out(box.max)}; }
    /// Of an upper bound ≥ 0: not below the exact product.
    double out_upwards(double x) const {
        const double y = out(x);
        return in(y) < x ? std::nextafter(y, std::numeric_limits<double>::infinity()) : y;
    }
};

/// Sizes of coordinates that need no scaling: products of nine such lengths, or of six that are 2⁻⁷⁰ of them,
/// are between 2⁻¹⁰²⁰ and 2⁹⁰⁰.
inline constexpr double least_common_size = 0x1p-100, largest_common_size = 0x1p100;

/// None for common sizes, else the one that brings this largest magnitude of coordinates into [1/2, 1).
inline Scaling scaling_for(double largest) {
    if (!(largest > 0) || (largest >= least_common_size && largest <= largest_common_size)) return {};
    return {std::ilogb(largest) + 1};
}

}  // namespace its::geometry
