#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "base/platform/compiler.h"

/// Several numbers at a time, one a lane: vector registers where the compiler has a type for them, else an
/// array.
namespace its::platform {

inline constexpr int lanes = 8, single_lanes = 16;

#if defined(__GNUC__) && !defined(ITS_PLAIN)

// How vectors wider than the machine's are passed to functions does not matter: all such are inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));
using Singles = float __attribute__((vector_size(single_lanes * sizeof(float))));

ITS_INLINE Lanes larger(const Lanes& a, const Lanes& b) {
    return a < b ? b : a;
}
ITS_INLINE Singles larger(const Singles& a, const Singles& b) {
    return a < b ? b : a;
}
ITS_INLINE Lanes smaller(const Lanes& a, const Lanes& b) {
    return b < a ? b : a;
}
ITS_INLINE Singles smaller(const Singles& a, const Singles& b) {
    return b < a ? b : a;
}
ITS_INLINE Lanes absolute(const Lanes& a) {
    return a < 0.0 ? -a : a;
}
/// 0 where a > 0, else b.
ITS_INLINE Singles zero_if_positive(const Singles& a, const Singles& b) {
    return a > 0.0F ? Singles{} : b;
}
/// Bit i: a ≤ b in lane i.
ITS_INLINE std::uint32_t lanes_at_most(const Singles& a, const Singles& b) {
    using Bits = int __attribute__((vector_size(64)));
    using Eight = long long __attribute__((vector_size(64)));
    using Four = long long __attribute__((vector_size(32)));
    constexpr Bits bits = {1,      1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                           1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};
    const Eight set = reinterpret_cast<Eight>((a <= b) & bits);
    const Four half =
        __builtin_shufflevector(set, set, 0, 1, 2, 3) | __builtin_shufflevector(set, set, 4, 5, 6, 7);
    const auto all = std::uint64_t((half[0] | half[1]) | (half[2] | half[3]));
    return std::uint32_t(all | all >> 32);
}

#else

template <class T, int n>
struct LaneArray {
    T lane[n] = {};

    T& operator[](int i) { return lane[i]; }
    T operator[](int i) const { return lane[i]; }
};
using Lanes = LaneArray<double, lanes>;
using Singles = LaneArray<float, single_lanes>;

/// f of each lane of a and b.
template <class T, int n, class F>
LaneArray<T, n> lanewise(const LaneArray<T, n>& a, const LaneArray<T, n>& b, F&& f) {
    LaneArray<T, n> result;
    for (int i = 0; i < n; ++i) result[i] = f(a[i], b[i]);
    return result;
}
template <class T, int n>
LaneArray<T, n> all_lanes(T x) {
    LaneArray<T, n> result;
    for (T& lane : result.lane) lane = x;
    return result;
}
template <class T, int n>
LaneArray<T, n> operator+(const LaneArray<T, n>& a, const LaneArray<T, n>& b) {
    return lanewise(a, b, [](T x, T y) { return x + y; });
}
template <class T, int n>
LaneArray<T, n> operator-(const LaneArray<T, n>& a, const LaneArray<T, n>& b) {
    return lanewise(a, b, [](T x, T y) { return x - y; });
}
template <class T, int n>
LaneArray<T, n> operator*(const LaneArray<T, n>& a, const LaneArray<T, n>& b) {
    return lanewise(a, b, [](T x, T y) { return x * y; });
}
template <class T, int n>
LaneArray<T, n> operator-(const LaneArray<T, n>& a) {
    return lanewise(a, a, [](T x, T) { return -x; });
}
template <class T, int n>
LaneArray<T, n> operator+(const LaneArray<T, n>& a, std::type_identity_t<T> b) {
    return a + all_lanes<T, n>(b);
}
template <class T, int n>
LaneArray<T, n> operator-(const LaneArray<T, n>& a, std::type_identity_t<T> b) {
    return a - all_lanes<T, n>(b);
}
template <class T, int n>
LaneArray<T, n> operator*(const LaneArray<T, n>& a, std::type_identity_t<T> b) {
    return a * all_lanes<T, n>(b);
}
template <class T, int n>
LaneArray<T, n> operator*(std::type_identity_t<T> a, const LaneArray<T, n>& b) {
    return all_lanes<T, n>(a) * b;
}
template <class T, int n>
LaneArray<T, n> larger(const LaneArray<T, n>& a, const LaneArray<T, n>& b) {
    return lanewise(a, b, [](T x, T y) { return x < y ? y : x; });
}
template <class T, int n>
LaneArray<T, n> smaller(const LaneArray<T, n>& a, const LaneArray<T, n>& b) {
    return lanewise(a, b, [](T x, T y) { return y < x ? y : x; });
}
template <class T, int n>
LaneArray<T, n> absolute(const LaneArray<T, n>& a) {
    return lanewise(a, a, [](T x, T) { return x < 0 ? -x : x; });
}
/// 0 where a > 0, else b.
inline Singles zero_if_positive(const Singles& a, const Singles& b) {
    return lanewise(a, b, [](float x, float y) { return x > 0 ? 0 : y; });
}
/// Bit i: a ≤ b in lane i.
inline std::uint32_t lanes_at_most(const Singles& a, const Singles& b) {
    std::uint32_t bits = 0;
    for (int i = 0; i < single_lanes; ++i) bits |= std::uint32_t{a[i] <= b[i]} << i;
    return bits;
}

#endif

/// The numbers from `from` on, one a lane.
template <class Vector, class T>
ITS_INLINE Vector load(const T* from) {
    Vector result;
    std::memcpy(static_cast<void*>(&result), from, sizeof result);
    return result;
}
ITS_INLINE Singles square_root(const Singles& a) {
    float x[single_lanes];
    std::memcpy(x, &a, sizeof x);
    for (float& lane : x) lane = std::sqrt(lane);
    return load<Singles>(x);
}

}  // namespace its::platform
