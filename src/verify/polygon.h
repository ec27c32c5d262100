#pragma once

#include <cmath>

#include "its/base.h"

/// Small convex polygons and their clipping by axis-aligned planes; lattice units.
namespace its::verifier {

/// Vertices of a convex, planar polygon (or segment, or point) in cyclic order, each displaced by a known
/// rounding error. See docs/design/verify.md for what clipping such a list preserves.
struct Polygon {
    static constexpr int capacity = 20;  ///< 3 + 6 planes leave at most 9; the rest is for noise
    int count = 0;
    bool overflow = false;  ///< a clip would not have fitted and was left out: the list is a superset
    Vec3 vertex[capacity];
};

/// The part of `in` on one side of the plane v[axis] = plane. A new vertex has its coordinate on `axis` exactly
/// on the plane; the others are off the edge by less than 6 · 2⁻⁵³ · (largest coordinate).
/// Where the result would not fit, `in` is kept whole and marked.
/// \return false if nothing is left.
inline bool clip(const Polygon& in, int axis, double plane, bool above, Polygon& out) {
    out.count = 0;
    out.overflow = in.overflow;
    const auto height = [&](const Vec3& v) { return above ? v[axis] - plane : plane - v[axis]; };
    for (int i = 0; i < in.count; ++i) {
        const Vec3& a = in.vertex[i];
        const Vec3& b = in.vertex[i + 1 < in.count ? i + 1 : 0];
        const double ha = height(a), hb = height(b);
        if (out.count + 2 > Polygon::capacity) {
            out = in;
            out.overflow = true;
            return true;
        }
        if (ha >= 0) out.vertex[out.count++] = a;
        if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) {
            const double t = (plane - a[axis]) / (b[axis] - a[axis]);
            Vec3 v = {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
            v[axis] = plane;
            out.vertex[out.count++] = v;
        }
    }
    return out.count > 0;
}

/// Clips to low ≤ v[axis] ≤ high.
inline bool clip_slab(const Polygon& in, int axis, double low, double high, Polygon& out) {
    Polygon half;
    return clip(in, axis, low, true, half) && clip(half, axis, high, false, out);
}

}  // namespace its::verifier
