#pragma once

#include <algorithm>
#include <utility>

#include "base/rounding.h"
#include "its/base.h"

/// Clipping a triangle to the unit cell.
namespace its::geometry {

/// A convex polygon in one plane. A triangle cut by six half spaces has at most nine vertices; a segment or a
/// point is a polygon whose vertices lie on a line or coincide. Coordinates past `size` are not set.
struct Polygon {
    static constexpr int capacity = 9;
    double coordinate[3][capacity];
    int size;

    Vec3 vertex(int i) const { return {coordinate[0][i], coordinate[1][i], coordinate[2][i]}; }
    void append(const Vec3& v) {
        for (int axis = 0; axis < 3; ++axis) coordinate[axis][size] = v[axis];
        ++size;
    }
};

/// Roundings that one cut may add to each coordinate, in units of u × the size of the coordinates: a new vertex
/// a + t(b − a) has t = (c − aᵢ)/(bᵢ − aᵢ) with three roundings, and three more follow; |b − a|, |a| ≤ size.
inline constexpr double roundings_per_cut = 7;
inline constexpr int cuts = 6;

/// Of the vertices relative to a cell's corner: one subtraction, inexact for a vertex far from the cell.
inline constexpr double roundings_of_vertices = 1;

/// How far, per axis, a vertex of a clipped polygon is at most from where exact arithmetic would put it, for
/// coordinates of this size.
inline constexpr double clipping_error(double size) {
    return (cuts * roundings_per_cut + roundings_of_vertices) * unit_roundoff * size;
}

namespace detail {

/// Keeps the part of `in` with sign·(coordinate − bound) ≤ 0.
inline void cut(const Polygon& in, int axis, double bound, double sign, Polygon& out) {
    out.size = 0;
    const double* const along = in.coordinate[axis];
    for (int i = 0; i < in.size; ++i) {
        const int next = i + 1 == in.size ? 0 : i + 1;
        const bool kept = sign * along[i] <= sign * bound, next_kept = sign * along[next] <= sign * bound;
        if (kept && out.size < Polygon::capacity) out.append(in.vertex(i));
        if (kept == next_kept || out.size == Polygon::capacity) continue;
        const Vec3 a = in.vertex(i), b = in.vertex(next);
        const double t = (bound - a[axis]) / (b[axis] - a[axis]);
        Vec3 p{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
        p[axis] = bound;
        out.append(p);
    }
}

}  // namespace detail

/// The part of triangle abc in [−margin, 1 + margin]³ (Sutherland–Hodgman).
///
/// Let e = roundings_per_cut·u·size. If margin ≥ m + 6e, every point of the triangle within m of the unit cell
/// (per axis) is within 6e (per axis) of the result's convex hull: by induction over the cuts, a point of the
/// rounded polygon that is within k·e of the given point lies within m + k·e of the cell and so survives the
/// cut, and the cut's new vertices are within e of the true ones.
inline void clip_to_cell(const Vec3& a, const Vec3& b, const Vec3& c, double margin, Polygon& result) {
    Polygon other;
    Polygon *current = &result, *next = &other;
    current->size = 0;
    for (const Vec3& v : {a, b, c}) current->append(v);
    for (int axis = 0; axis < 3; ++axis) {
        const double low = std::min({a[axis], b[axis], c[axis]}), high = std::max({a[axis], b[axis], c[axis]});
        if (low < -margin) {
            detail::cut(*current, axis, -margin, -1, *next);
            std::swap(current, next);
        }
        if (high > 1 + margin) {
            detail::cut(*current, axis, 1 + margin, 1, *next);
            std::swap(current, next);
        }
        if (current->size == 0) break;
    }
    if (current != &result) result = other;
}

inline Polygon clip_to_cell(const Vec3& a, const Vec3& b, const Vec3& c, double margin) {
    Polygon polygon;
    clip_to_cell(a, b, c, margin, polygon);
    return polygon;
}

}  // namespace its::geometry
