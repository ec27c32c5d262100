#pragma once

#include <limits>

#include "its/base.h"

/// Small convex polygons and their clipping by planes.
namespace its::verifier {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// Vertices of a convex, planar polygon (or segment, or point) in cyclic order, each displaced by a known
/// rounding error. See docs/design/verify.md for what clipping such a list preserves.
struct Polygon {
    static constexpr int capacity = 20;  ///< 3 + 6 planes leave at most 9; the rest is for noise
    int count = 0;
    bool overflow = false;  ///< a clip would not have fitted and was left out: the list is a superset
    Vec3 vertex[capacity];
};

/// The part of `in` where height(v) ≥ 0, for a height that is linear but for rounding. A new vertex is off its
/// edge by less than 6 · 2⁻⁵³ · (largest coordinate) per axis. Where the result would not fit, `in` is kept
/// whole and marked.
/// \return false if nothing is left.
template <class Height>
bool clip(const Polygon& in, const Height& height, Polygon& out) {
    out.count = 0;
    out.overflow = in.overflow;
    double next = height(in.vertex[0]);
    const double first = next;
    for (int i = 0; i < in.count; ++i) {
        const int j = i + 1 < in.count ? i + 1 : 0;
        const Vec3 &a = in.vertex[i], &b = in.vertex[j];
        const double ha = next, hb = next = j == 0 ? first : height(b);
        if (out.count + 2 > Polygon::capacity) {
            out = in;
            out.overflow = true;
            return true;
        }
        if (ha >= 0) out.vertex[out.count++] = a;
        if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) {
            const double t = ha / (ha - hb);
            out.vertex[out.count++] = {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
        }
    }
    return out.count > 0;
}

/// Clips to low ≤ v[axis] ≤ high.
inline bool clip_slab(const Polygon& in, int axis, double low, double high, Polygon& out) {
    Polygon half;
    return clip(
               in, [&](const Vec3& v) { return v[axis] - low; }, half) &&
           clip(
               half, [&](const Vec3& v) { return high - v[axis]; }, out);
}

}  // namespace its::verifier
