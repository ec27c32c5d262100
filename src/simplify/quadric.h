#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/vec3.h"

/// Quadric error metrics (Garland and Heckbert 1997).
namespace its::simplifier {

/// q(x) = xᵀAx + 2bᵀx + c ≥ 0, A symmetric: a sum of weighted squared distances to planes and points.
struct Quadric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
    Vec3 b;
    double c = 0;

    Quadric& operator+=(const Quadric& q) {
        xx += q.xx, xy += q.xy, xz += q.xz, yy += q.yy, yz += q.yz, zz += q.zz;
        b = b + q.b;
        c += q.c;
        return *this;
    }
    friend Quadric operator+(Quadric p, const Quadric& q) { return p += q; }

    /// Never below 0, whatever the rounding.
    double operator()(const Vec3& x) const {
        const Vec3 ax{xx * x.x + xy * x.y + xz * x.z, xy * x.x + yy * x.y + yz * x.z,
                      xz * x.x + yz * x.y + zz * x.z};
        return std::max(dot(x, ax) + 2 * dot(b, x) + c, 0.0);
    }
};

/// weight × squared distance to the plane through p with unit normal n
inline Quadric plane_quadric(const Vec3& n, const Vec3& p, double weight) {
    const double d = dot(n, p);
    return {weight * n.x * n.x, weight * n.x * n.y, weight * n.x * n.z, weight * n.y * n.y,
            weight * n.y * n.z, weight * n.z * n.z, (-weight * d) * n,  weight * d * d};
}

/// weight × squared distance to p
inline Quadric point_quadric(const Vec3& p, double weight) {
    return {weight, 0, 0, weight, 0, weight, -weight * p, weight * dot(p, p)};
}

/// The point where q is least, by Cholesky's decomposition of A. Returns false, and leaves x, if A is not
/// positive definite to working precision.
inline bool minimum(const Quadric& q, Vec3& x) {
    const double l00 = std::sqrt(q.xx);
    if (!(l00 > 0)) return false;
    const double l10 = q.xy / l00, l20 = q.xz / l00;
    const double d1 = q.yy - l10 * l10;
    const double floor = 1e-12 * (q.xx + q.yy + q.zz);  // pivots below are rounding errors of their own terms
    if (!(d1 > floor)) return false;
    const double l11 = std::sqrt(d1), l21 = (q.yz - l20 * l10) / l11;
    const double d2 = q.zz - l20 * l20 - l21 * l21;
    if (!(d2 > floor)) return false;
    const double l22 = std::sqrt(d2);
    const double y0 = -q.b.x / l00, y1 = (-q.b.y - l10 * y0) / l11, y2 = (-q.b.z - l20 * y0 - l21 * y1) / l22;
    x.z = y2 / l22;
    x.y = (y1 - l21 * x.z) / l11;
    x.x = (y0 - l10 * x.y - l20 * x.z) / l00;
    return finite(x);
}

}  // namespace its::simplifier
