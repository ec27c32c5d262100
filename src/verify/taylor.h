#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/vec3.h"
#include "verify/polygon.h"

/// Bounds of a trilinear function over a polygon; coordinates of the cell, [0, 1]³ but for rounding.
namespace its::verifier {

/// The exact Taylor expansion of a trilinear function about `centre`:
/// f(centre + d) = f + g·d + h_xy dx dy + h_xz dx dz + h_yz dy dz + h_xyz dx dy dz.
struct Taylor {
    Vec3 centre, g;
    double f = 0, h_xy = 0, h_xz = 0, h_yz = 0, h_xyz = 0;

    double at(const Vec3& d) const {
        return f + g.x * d.x + g.y * d.y + g.z * d.z + h_xy * d.x * d.y + h_xz * d.x * d.z + h_yz * d.y * d.z +
               h_xyz * d.x * d.y * d.z;
    }
};

/// Expands the interpolation of corner values v (corner x + 2y + 4z) about c.
inline Taylor expand(const double (&v)[8], const Vec3& c) {
    const auto lerp = [](double a, double b, double t) { return a + t * (b - a); };
    const double x00 = lerp(v[0], v[1], c.x), x10 = lerp(v[2], v[3], c.x);
    const double x01 = lerp(v[4], v[5], c.x), x11 = lerp(v[6], v[7], c.x);
    const double d00 = v[1] - v[0], d10 = v[3] - v[2], d01 = v[5] - v[4], d11 = v[7] - v[6];
    Taylor out;
    out.centre = c;
    const double y0 = lerp(x00, x10, c.y), y1 = lerp(x01, x11, c.y);
    out.f = lerp(y0, y1, c.z);
    out.g.x = lerp(lerp(d00, d10, c.y), lerp(d01, d11, c.y), c.z);
    out.g.y = lerp(x10 - x00, x11 - x01, c.z);
    out.g.z = y1 - y0;
    out.h_xy = lerp(d10 - d00, d11 - d01, c.z);
    out.h_xz = lerp(d01 - d00, d11 - d10, c.y);
    out.h_yz = (x11 - x01) - (x10 - x00);
    out.h_xyz = (d11 - d01) - (d10 - d00);
    return out;
}

/// Rounding of every bound and value below, for corner values up to V in size: less than 400 · 2⁻⁵³ V in all;
/// the terms are counted in docs/design/verify.md.
inline double evaluation_error(const double (&v)[8]) {
    double largest = 0;
    for (const double value : v) largest = std::max(largest, std::abs(value));
    return 512 * 0x1p-53 * largest;
}

/// What is known of f over the hull of a polygon's vertices: low ≤ f ≤ high, and f takes the values
/// attained_low and attained_high at vertices; all four up to evaluation_error.
struct Bounds {
    double low = 0, high = 0, attained_low = 0, attained_high = 0;
};

/// A trilinear function on a polygon, expanded about the middle of the polygon's box.
class Expansion {
public:
    Expansion(const double (&v)[8], const Polygon& polygon) : count_(polygon.count) {
        Vec3 low = polygon.vertex[0], high = low;
        for (int i = 1; i < count_; ++i)
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = std::min(low[axis], polygon.vertex[i][axis]);
                high[axis] = std::max(high[axis], polygon.vertex[i][axis]);
            }
        const Vec3 centre = 0.5 * (low + high);
        taylor_ = expand(v, centre);
        for (int axis = 0; axis < 3; ++axis)
            r_[axis] = std::max(high[axis] - centre[axis], centre[axis] - low[axis]);
        for (int i = 0; i < count_; ++i) {
            d_[i] = polygon.vertex[i] - centre;
            linear_[i] = dot(taylor_.g, d_[i]);
        }
        cubic_ = std::abs(taylor_.h_xyz) * r_.x * r_.y * r_.z;
    }

    /// The linear part is extreme at vertices; the others are at most their size on the box.
    Bounds cheap() const {
        Bounds b;
        double linear_low = infinity, linear_high = -infinity;
        b.attained_low = infinity, b.attained_high = -infinity;
        for (int i = 0; i < count_; ++i) {
            linear_low = std::min(linear_low, linear_[i]);
            linear_high = std::max(linear_high, linear_[i]);
            const double value = taylor_.at(d_[i]);
            b.attained_low = std::min(b.attained_low, value);
            b.attained_high = std::max(b.attained_high, value);
        }
        const double rest = std::abs(taylor_.h_xy) * r_.x * r_.y + std::abs(taylor_.h_xz) * r_.x * r_.z +
                            std::abs(taylor_.h_yz) * r_.y * r_.z + cubic_;
        b.low = taylor_.f + linear_low - rest;
        b.high = taylor_.f + linear_high + rest;
        return b;
    }

    /// With Q the quadratic part's symmetric form, the parts up to degree 2 at a mean Σ λᵢ dᵢ of the vertices
    /// are Σ λᵢ λⱼ (½ g·dᵢ + ½ g·dⱼ + Q(dᵢ, dⱼ)): between the least and the greatest over pairs. Sharp along
    /// lines and planes on which f does not change.
    void sharpen(Bounds& b) const {
        double low = infinity, high = -infinity;
        for (int i = 0; i < count_; ++i)
            for (int j = i; j < count_; ++j) {
                const double pair = 0.5 * (linear_[i] + linear_[j]) + form(d_[i], d_[j]);
                low = std::min(low, pair);
                high = std::max(high, pair);
            }
        b.low = std::max(b.low, taylor_.f + low - cubic_);
        b.high = std::min(b.high, taylor_.f + high + cubic_);
    }

    /// How to halve the polygon: the unit vector along the chord on which the quadratic part bends most, or
    /// along the longest where the cubic part is larger; and the middle of the polygon's extent along it.
    /// \return the extent.
    double halving(Vec3& direction, double& middle) const {
        double bend = -1, longest = -1, quadratic = 0;
        Vec3 chord[2];
        for (int i = 0; i < count_; ++i)
            for (int j = i + 1; j < count_; ++j) {
                const Vec3 m = d_[i] - d_[j];
                const double length = norm(m), q = std::abs(form(m, m));
                if (length > longest) longest = length, chord[0] = m;
                if (length > 0 && q / length > bend) bend = q / length, chord[1] = m;
                quadratic = std::max(quadratic, q);
            }
        if (!(longest > 0)) return 0;
        const Vec3& along = chord[0.25 * quadratic > cubic_ ? 1 : 0];
        direction = (1 / norm(along)) * along;
        double low = infinity, high = -infinity;
        for (int i = 0; i < count_; ++i) {
            low = std::min(low, dot(direction, d_[i]));
            high = std::max(high, dot(direction, d_[i]));
        }
        middle = dot(direction, taylor_.centre) + 0.5 * (low + high);
        return high - low;
    }

private:
    double form(const Vec3& a, const Vec3& b) const {
        return 0.5 * (taylor_.h_xy * (a.x * b.y + a.y * b.x) + taylor_.h_xz * (a.x * b.z + a.z * b.x) +
                      taylor_.h_yz * (a.y * b.z + a.z * b.y));
    }

    int count_;
    Taylor taylor_;
    Vec3 r_, d_[Polygon::capacity];
    double linear_[Polygon::capacity];
    double cubic_ = 0;
};

}  // namespace its::verifier
