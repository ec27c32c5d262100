#pragma once

#include "its/base.h"

/// Clipping a triangle to the unit cell.
namespace its {

/// A convex polygon in one plane. A triangle cut by six half spaces has at most nine vertices; a segment or a
/// point is a polygon whose vertices lie on a line or coincide.
struct Polygon {
    static constexpr int capacity = 9;
    Vec3 vertex[capacity];
    int size = 0;
};

/// Roundings that one cut may add to each coordinate, in units of u × the size of the coordinates: a new vertex
/// a + t(b − a) has t = (c − aᵢ)/(bᵢ − aᵢ) with three roundings, and three more follow; |b − a|, |a| ≤ size.
inline constexpr double roundings_per_cut = 7;
inline constexpr int cuts = 6;

namespace detail {

/// Keeps the part of `in` with sign·(coordinate − bound) ≤ 0.
inline void cut(const Polygon& in, int axis, double bound, double sign, Polygon& out) {
    out.size = 0;
    for (int i = 0; i < in.size; ++i) {
        const Vec3& a = in.vertex[i];
        const Vec3& b = in.vertex[i + 1 == in.size ? 0 : i + 1];
        const bool a_kept = sign * a[axis] <= sign * bound, b_kept = sign * b[axis] <= sign * bound;
        if (a_kept && out.size < Polygon::capacity) out.vertex[out.size++] = a;
        if (a_kept == b_kept || out.size == Polygon::capacity) continue;
        const double t = (bound - a[axis]) / (b[axis] - a[axis]);
        Vec3 p{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
        p[axis] = bound;
        out.vertex[out.size++] = p;
    }
}

}  // namespace detail

/// The part of triangle abc in [−margin, 1 + margin]³ (Sutherland–Hodgman).
///
/// Let e = roundings_per_cut·u·size. If margin ≥ m + 6e, every point of the triangle within m of the unit cell
/// (per axis) is within 6e (per axis) of the result's convex hull: by induction over the cuts, a point of the
/// rounded polygon that is within k·e of the given point lies within m + k·e of the cell and so survives the cut,
/// and the cut's new vertices are within e of the true ones.
inline Polygon clip_to_cell(const Vec3& a, const Vec3& b, const Vec3& c, double margin) {
    Polygon polygon{.vertex = {a, b, c}, .size = 3};
    for (int axis = 0; axis < 3; ++axis) {
        const double x = a[axis], y = b[axis], z = c[axis];
        for (const double sign : {-1.0, 1.0}) {
            const double bound = sign < 0 ? -margin : 1 + margin;
            if (sign * x <= sign * bound && sign * y <= sign * bound && sign * z <= sign * bound) continue;
            Polygon kept;
            detail::cut(polygon, axis, bound, sign, kept);
            polygon = kept;
        }
    }
    return polygon;
}

}  // namespace its
