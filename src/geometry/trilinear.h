#pragma once

#include "base/platform/compiler.h"
#include "its/base.h"

/// Trilinear functions on the unit cell; corner values v in the order x + 2y + 4z.
namespace its::geometry {

/// Rounding error, in units of u·V, of trilinear() and of each component of trilinear_with_gradient(), for |v|
/// ≤ V and local coordinates in [−1/16, 17/16]. Let the arguments of one a + t(b − a) be of size W and err by
/// e: the difference (2uW), the product (2·17/16·uW more) and the sum (9/8·uW) err by less than 6uW together,
/// the result is of size 9/8·W, and e grows to 9/8·e. Three in a row: 6, then 6·9/8 + 9/8·6 < 13.6, then
/// 6·(9/8)² + 9/8·13.6 < 23. A gradient component is of size 2·(9/8)²·V < 2.54V; as a difference of two values
/// after two steps it errs by 2·13.6 + 2.54 < 30, as two steps on differences (of size 2V, err 2) by less.
inline constexpr double trilinear_roundings = 32;

ITS_INLINE double lerp_exact_at_zero(double a, double b, double t) {
    return a + t * (b - a);
}

/// The function at local coordinates p.
ITS_INLINE double trilinear(const double* v, const Vec3& p) {
    const auto mix = lerp_exact_at_zero;
    return mix(mix(mix(v[0], v[1], p.x), mix(v[2], v[3], p.x), p.y),
               mix(mix(v[4], v[5], p.x), mix(v[6], v[7], p.x), p.y), p.z);
}

/// The function and its gradient at local coordinates p.
ITS_INLINE double trilinear_with_gradient(const double* v, const Vec3& p, Vec3& gradient) {
    const auto mix = lerp_exact_at_zero;
    const double y0z0 = mix(v[0], v[1], p.x), y1z0 = mix(v[2], v[3], p.x);
    const double y0z1 = mix(v[4], v[5], p.x), y1z1 = mix(v[6], v[7], p.x);
    const double z0 = mix(y0z0, y1z0, p.y), z1 = mix(y0z1, y1z1, p.y);
    gradient.x = mix(mix(v[1] - v[0], v[3] - v[2], p.y), mix(v[5] - v[4], v[7] - v[6], p.y), p.z);
    gradient.y = mix(y1z0 - y0z0, y1z1 - y0z1, p.z);
    gradient.z = z1 - z0;
    return mix(z0, z1, p.z);
}

}  // namespace its::geometry
