#pragma once

#include <cmath>

#include "its/base.h"

/// Numbers of twice the precision: the unevaluated sum of two doubles (Dekker 1971). Each operation below errs
/// by a relative 2⁻¹⁰⁰ at most, barring overflow and underflow.
namespace its::verifier {

struct Twofold {
    double high = 0, low = 0;

    Twofold() = default;
    Twofold(double v) : high(v) {}
    Twofold(double h, double l) : high(h + l), low(l - (high - h)) {}  // |h| ≥ |l|
    explicit operator double() const { return high; }
};

inline Twofold operator+(const Twofold& a, const Twofold& b) {
    const double s = a.high + b.high, back = s - a.high;
    const double t = a.low + b.low, low_back = t - a.low;
    const Twofold first(s, (a.high - (s - back)) + (b.high - back) + t);
    return {first.high, first.low + ((a.low - (t - low_back)) + (b.low - low_back))};
}
inline Twofold operator-(const Twofold& a) {
    Twofold out;
    out.high = -a.high;
    out.low = -a.low;
    return out;
}
inline Twofold operator-(const Twofold& a, const Twofold& b) {
    return a + -b;
}
inline Twofold operator*(const Twofold& a, const Twofold& b) {
    const double p = a.high * b.high;
    return {p, std::fma(a.high, b.high, -p) + (a.high * b.low + a.low * b.high)};
}
inline Twofold operator/(const Twofold& a, const Twofold& b) {
    const double q = a.high / b.high;
    const Twofold rest = a - b * Twofold(q);
    return {q, rest.high / b.high};
}
inline Twofold square_root(const Twofold& a) {
    if (!(a.high > 0)) return {};
    const double r = std::sqrt(a.high);
    const Twofold rest = a - Twofold(r) * Twofold(r);
    return {r, rest.high / (2 * r)};
}
inline bool operator<(const Twofold& a, const Twofold& b) {
    return a.high < b.high || (a.high == b.high && a.low < b.low);
}

/// A vector of such numbers.
struct Twofold3 {
    Twofold x, y, z;
};

inline Twofold3 operator-(const Twofold3& a, const Twofold3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Twofold3 operator+(const Twofold3& a, const Twofold3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Twofold3 operator*(const Twofold& s, const Twofold3& a) {
    return {s * a.x, s * a.y, s * a.z};
}
inline Twofold dot(const Twofold3& a, const Twofold3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Twofold3 cross(const Twofold3& a, const Twofold3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace its::verifier
