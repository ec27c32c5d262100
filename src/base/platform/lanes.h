#pragma once

#include "base/platform/compiler.h"

/// Eight numbers at a time, one a lane: vector registers where the compiler has a type for them, else an array.
namespace its::platform {

inline constexpr int lanes = 8;

#if defined(__GNUC__) && !defined(ITS_PLAIN)

// How vectors wider than the machine's are passed to functions does not matter: all such are inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));

ITS_INLINE Lanes larger(const Lanes& a, const Lanes& b) {
    return a < b ? b : a;
}
ITS_INLINE Lanes smaller(const Lanes& a, const Lanes& b) {
    return b < a ? b : a;
}
ITS_INLINE Lanes absolute(const Lanes& a) {
    return a < 0.0 ? -a : a;
}

#else

struct Lanes {
    double lane[lanes] = {};

    double& operator[](int i) { return lane[i]; }
    double operator[](int i) const { return lane[i]; }
};

/// f of each lane of a and b.
template <class F>
Lanes lanewise(const Lanes& a, const Lanes& b, F&& f) {
    Lanes result;
    for (int i = 0; i < lanes; ++i) result[i] = f(a[i], b[i]);
    return result;
}
inline Lanes all_lanes(double x) {
    Lanes result;
    for (double& lane : result.lane) lane = x;
    return result;
}
inline Lanes operator+(const Lanes& a, const Lanes& b) {
    return lanewise(a, b, [](double x, double y) { return x + y; });
}
inline Lanes operator-(const Lanes& a, const Lanes& b) {
    return lanewise(a, b, [](double x, double y) { return x - y; });
}
inline Lanes operator*(const Lanes& a, const Lanes& b) {
    return lanewise(a, b, [](double x, double y) { return x * y; });
}
inline Lanes operator-(const Lanes& a) {
    return lanewise(a, a, [](double x, double) { return -x; });
}
inline Lanes operator+(const Lanes& a, double b) {
    return a + all_lanes(b);
}
inline Lanes operator-(const Lanes& a, double b) {
    return a - all_lanes(b);
}
inline Lanes operator*(const Lanes& a, double b) {
    return a * all_lanes(b);
}
inline Lanes operator*(double a, const Lanes& b) {
    return all_lanes(a) * b;
}
inline Lanes larger(const Lanes& a, const Lanes& b) {
    return lanewise(a, b, [](double x, double y) { return x < y ? y : x; });
}
inline Lanes smaller(const Lanes& a, const Lanes& b) {
    return lanewise(a, b, [](double x, double y) { return y < x ? y : x; });
}
inline Lanes absolute(const Lanes& a) {
    return lanewise(a, a, [](double x, double) { return x < 0.0 ? -x : x; });
}

#endif

}  // namespace its::platform
