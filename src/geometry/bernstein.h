#pragma once

#include <algorithm>

#include "base/platform/compiler.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"

/// Bernstein–Bézier bounds of a trilinear function on a triangle.
namespace its::geometry {

/// A vertex of the triangle with the function's value and gradient there, local coordinates.
struct Sample {
    Vec3 at;
    double value;
    Vec3 gradient;
};

ITS_INLINE Sample sample(const double* corners, const Vec3& at) {
    Sample s{at, 0, {}};
    s.value = trilinear_with_gradient(corners, at, s.gradient);
    return s;
}

/// What is known of a function on a set: its values there lie in [lower, upper]; [least, most] are attained.
struct Bounds {
    double lower, upper;
    double least, most;

    void include(const Bounds& other) {
        lower = std::min(lower, other.lower);
        upper = std::max(upper, other.upper);
        least = std::min(least, other.least);
        most = std::max(most, other.most);
    }
};

/// Rounding error of the control values, in units of u·V, V the largest absolute corner value, for local
/// coordinates in [−1/16, 17/16]. A value errs by trilinear_roundings = 32 and is below 1.43V; a gradient
/// component errs by 32 and is below 2.54V; an edge is at most 9/8 long per axis.
///   Edge values: 32, a third of three products, 9/8·(32 + 6·2.54) < 54, and the last sum, of size < 4.3V:
///   < 91. Middle: 27 values at a centroid that itself errs by 4u per axis (moving f by 3·2.54·4 < 31), 27·63 =
///   1701; three vertices, 96; three times six edge values, 1638; the sums, six roundings of sizes below
///   27·1.43V + 18·4.3V < 117V, 702; a sixth of it all: < 690.
inline constexpr double control_roundings = 1024;

/// The restriction of the trilinear function to the triangle is a cubic; its ten control values are the polar
/// form (blossom) at triples of vertices, and bound it (Farin 1986). b(p,p,q) = f(p) + ∇f(p)·(q − p)/3; the
/// middle one follows from the value at the centroid, 27 f(c) = Σ b(p,p,p) + 3 Σ b(p,p,q) + 6 b(p,q,r).
ITS_INLINE Bounds bernstein_bounds(const double* corners, const Sample& p, const Sample& q, const Sample& r) {
    const auto edge = [](const Sample& from, const Sample& to) {
        return from.value + dot(from.gradient, to.at - from.at) / 3.0;
    };
    const double e[6] = {edge(p, q), edge(q, p), edge(q, r), edge(r, q), edge(r, p), edge(p, r)};
    const Vec3 centroid = (1.0 / 3.0) * (p.at + q.at + r.at);
    const double centre = trilinear(corners, centroid);
    const double vertices = p.value + q.value + r.value;
    const double edges = (e[0] + e[1]) + (e[2] + e[3]) + (e[4] + e[5]);
    const double middle = (27.0 * centre - vertices - 3.0 * edges) / 6.0;

    Bounds b;
    const auto smaller = [](double x, double y) { return y < x ? y : x; };
    const auto larger = [](double x, double y) { return x < y ? y : x; };
    const double low = smaller(smaller(p.value, q.value), r.value);
    const double high = larger(larger(p.value, q.value), r.value);
    b.least = smaller(low, centre);
    b.most = larger(high, centre);
    b.lower = smaller(smaller(smaller(low, middle), smaller(e[0], e[1])),
                      smaller(smaller(e[2], e[3]), smaller(e[4], e[5])));
    b.upper = larger(larger(larger(high, middle), larger(e[0], e[1])),
                     larger(larger(e[2], e[3]), larger(e[4], e[5])));
    return b;
}

}  // namespace its::geometry
