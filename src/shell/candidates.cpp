#include "shell/candidates.h"

#include <algorithm>
#include <cmath>

#include "geometry/trilinear.h"
#include "geometry/vec3.h"

namespace its::shell {
namespace {

/// Taylor expansion of f at a point: exact, since f has no other derivatives.
struct Taylor {
    Vec3 gradient;
    double xy, yz, zx, xyz;  // mixed derivatives

    Taylor(const std::array<double, 8>& c, const Vec3& p) {
        const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
        double dx[4], dy[4], dz[4], dxy[2], dyz[2], dzx[2];  // on the cell's edges and faces
        for (int i = 0; i < 4; ++i) {
            dx[i] = c[2 * i + 1] - c[2 * i];                          // (y, z)
            dy[i] = c[i % 2 + i / 2 * 4 + 2] - c[i % 2 + i / 2 * 4];  // (x, z)
            dz[i] = c[i + 4] - c[i];                                  // (x, y)
        }
        for (int i = 0; i < 2; ++i) {
            dxy[i] = dx[2 * i + 1] - dx[2 * i];  // z
            dyz[i] = dy[2 + i] - dy[i];          // x
            dzx[i] = dz[2 * i + 1] - dz[2 * i];  // y
        }
        gradient = {mix(mix(dx[0], dx[1], p.y), mix(dx[2], dx[3], p.y), p.z),
                    mix(mix(dy[0], dy[1], p.x), mix(dy[2], dy[3], p.x), p.z),
                    mix(mix(dz[0], dz[1], p.x), mix(dz[2], dz[3], p.x), p.y)};
        xy = mix(dxy[0], dxy[1], p.z);
        yz = mix(dyz[0], dyz[1], p.x);
        zx = mix(dzx[0], dzx[1], p.y);
        xyz = dxy[1] - dxy[0];
    }
};

/// The values seen so far.
struct Search {
    const std::array<double, 8>& corner;
    Range range;

    Search(const std::array<double, 8>& c, const Vec3& first)
        : corner(c), range{geometry::trilinear(c.data(), first), 0, first, first} {
        range.max = range.min;
    }
    void add(const Vec3& p) {
        const double value = geometry::trilinear(corner.data(), p);
        if (value < range.min) range.min = value, range.argmin = p;
        if (value > range.max) range.max = value, range.argmax = p;
    }
};

/// Real roots of a·t² + b·t + c, at most two; the vertex if a rounding may have hidden a double root. No
/// coefficient has to be different from 0; roots that overflow are left out.
int quadratic_roots(double a, double b, double c, double roots[2]) {
    const double discriminant = b * b - 4 * a * c;
    // Rounding errors of the discriminant: below 3u·(b² + 4|ac|).
    if (discriminant < -4 * 0x1p-53 * (b * b + 4 * std::abs(a * c))) return 0;
    const double q = -0.5 * (b + std::copysign(std::sqrt(std::max(discriminant, 0.0)), b));
    int count = 0;
    for (const double root : {q / a, c / q})
        if (std::isfinite(root)) roots[count++] = root;
    return count;
}

/// Along p + t·d, f is a cubic in t: its extremes are at the ends or where the derivative, a quadratic, is 0.
void add_edge(Search& search, const Vec3& p, const Vec3& q) {
    const Vec3 d = q - p;
    const Taylor e(search.corner, p);
    double roots[2];
    const int count = quadratic_roots(3 * e.xyz * d.x * d.y * d.z,
                                      2 * (e.xy * d.x * d.y + e.yz * d.y * d.z + e.zx * d.z * d.x),
                                      dot(e.gradient, d), roots);
    for (int i = 0; i < count; ++i)
        if (roots[i] > 0 && roots[i] < 1) search.add(p + roots[i] * d);
}

/// H(s, t) = f(origin + s·u + t·v) − f(origin), a cubic: hij is the coefficient of sⁱtʲ.
struct Cubic {
    double h10, h01, h20, h11, h02, h30, h21, h12, h03;

    Cubic(const Taylor& e, const Vec3& u, const Vec3& v) {
        h10 = dot(e.gradient, u);
        h01 = dot(e.gradient, v);
        h20 = e.xy * u.x * u.y + e.yz * u.y * u.z + e.zx * u.z * u.x;
        h02 = e.xy * v.x * v.y + e.yz * v.y * v.z + e.zx * v.z * v.x;
        h11 = e.xy * (u.x * v.y + u.y * v.x) + e.yz * (u.y * v.z + u.z * v.y) + e.zx * (u.z * v.x + u.x * v.z);
        h30 = e.xyz * u.x * u.y * u.z;
        h21 = e.xyz * (u.x * u.y * v.z + u.x * v.y * u.z + v.x * u.y * u.z);
        h12 = e.xyz * (u.x * v.y * v.z + v.x * u.y * v.z + v.x * v.y * u.z);
        h03 = e.xyz * v.x * v.y * v.z;
    }
    double largest() const {
        return std::max({std::abs(h10), std::abs(h01), std::abs(h20), std::abs(h11), std::abs(h02),
                         std::abs(h30), std::abs(h21), std::abs(h12), std::abs(h03)});
    }
    void divide(double by) {
        for (double* h : {&h10, &h01, &h20, &h11, &h02, &h30, &h21, &h12, &h03}) *h /= by;
    }
};

/// Resultant with respect to s of ∂H/∂s = a₂s² + a₁(t)s + a₀(t) and ∂H/∂t = b₂s² + b₁(t)s + b₀(t):
/// (a₂b₀ − b₂a₀)² − (a₂b₁ − b₂a₁)(a₁b₀ − b₁a₀), a quartic in t, coefficient of t⁰ first.
std::array<double, 5> resultant(const Cubic& h) {
    const double a2 = 3 * h.h30, b2 = h.h21;
    const double a1[] = {2 * h.h20, 2 * h.h21}, b1[] = {h.h11, 2 * h.h12};
    const double a0[] = {h.h10, h.h11, h.h12}, b0[] = {h.h01, 2 * h.h02, 3 * h.h03};
    double u[3], v[2], w[4] = {};
    for (int i = 0; i < 3; ++i) u[i] = a2 * b0[i] - b2 * a0[i];
    for (int i = 0; i < 2; ++i) v[i] = a2 * b1[i] - b2 * a1[i];
    for (int i = 0; i < 2; ++i)
        for (int k = 0; k < 3; ++k) w[i + k] += a1[i] * b0[k] - b1[i] * a0[k];
    std::array<double, 5> r = {};
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) r[i + k] += u[i] * u[k];
    for (int i = 0; i < 2; ++i)
        for (int k = 0; k < 4; ++k) r[i + k] -= v[i] * w[k];
    return r;
}

/// A root between low and high, where p has values of different signs: Newton's step where it stays between.
template <class Value>
double bracketed_root(const Value& value, double low, double high) {
    const bool rising = value(high).first > 0;
    double t = 0.5 * (low + high);
    for (int i = 0; i < 100; ++i) {
        const auto [p, slope] = value(t);
        if (p == 0) return t;
        ((p > 0) == rising ? high : low) = t;
        double next = t - p / slope;
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (next == t || next <= low || next >= high) return next;
        // Newton may creep along one side of a flat root: every fourth step is a bisection.
        t = i % 4 == 3 ? 0.5 * (low + high) : next;
    }
    return t;
}

constexpr int most_roots = 30;  // of roots_between for degree ≤ 4

/// Real roots of the polynomial c[0] + … + c[degree]·t^degree in [low, high], by the intervals on which it is
/// monotone: no division by a leading coefficient, which may be 0. Points where it comes to 0 up to rounding
/// without changing its sign (double roots) are listed too. Returns their number, at most 2^(degree+1) − 2.
int roots_between(const double* c, int degree, double low, double high, double* roots) {
    const auto value = [&](double t) {
        double p = c[degree], slope = 0;
        for (int i = degree - 1; i >= 0; --i) slope = slope * t + p, p = p * t + c[i];
        return std::pair(p, slope);
    };
    if (degree == 0) return 0;
    double derivative[4], turns[most_roots];
    for (int i = 0; i < degree; ++i) derivative[i] = (i + 1) * c[i + 1];
    int turn_count = roots_between(derivative, degree - 1, low, high, turns);
    turns[turn_count++] = high;
    int count = 0;
    double from = low, value_from = value(low).first;
    for (int i = 0; i < turn_count; ++i) {
        const double to = turns[i], value_to = value(to).first;
        if ((value_from < 0 && value_to > 0) || (value_from > 0 && value_to < 0))
            roots[count++] = bracketed_root(value, from, to);
        double magnitude = 0;
        for (int k = degree; k >= 0; --k) magnitude = magnitude * std::abs(to) + std::abs(c[k]);
        // Horner's rule and rounded coefficients: errors below (2·degree + 1)u·magnitude ≤ 16u·magnitude.
        if (std::abs(value_to) <= 16 * 0x1p-53 * magnitude) roots[count++] = to;
        from = to, value_from = value_to;
    }
    return count;
}

/// Where the polygon lies: origin + s·u + t·v with |s|, |t| ≤ 1, u ⟂ v. Scaled apart, so that a thin polygon
/// is as well conditioned as a round one.
struct Frame {
    Vec3 origin, u, v;

    Vec3 at(double s, double t) const { return origin + s * u + t * v; }
};

/// False if the polygon is a point or a segment.
bool make_frame(std::span<const Vec3> polygon, Frame& frame) {
    double longest = 0;
    for (const Vec3& p : polygon)
        for (const Vec3& q : polygon)
            if (const Vec3 d = q - p; dot(d, d) > longest) {
                longest = dot(d, d);
                frame.origin = 0.5 * (p + q);
                frame.u = 0.5 * d;
            }
    if (longest == 0) return false;
    double farthest = 0;
    for (const Vec3& p : polygon) {
        const Vec3 d = p - frame.origin;
        const Vec3 across = d - (dot(d, frame.u) / dot(frame.u, frame.u)) * frame.u;
        if (dot(across, across) > farthest) farthest = dot(across, across), frame.v = across;
    }
    // u × v is the normal that tells inside from outside; beyond this it has no direction.
    return farthest > 0 && norm(cross(frame.u, frame.v)) > 0;
}

/// Whether the polygon holds p, a point of its plane. Rounding may decide points within about 1e-16 of an edge
/// either way; there the gradient is 0, so f differs from its value on the edge by the square of that.
bool holds(std::span<const Vec3> polygon, const Vec3& normal, const Vec3& p) {
    bool left = false, right = false;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3& from = polygon[i];
        const double side = dot(cross(polygon[(i + 1) % polygon.size()] - from, p - from), normal);
        left |= side > 0;
        right |= side < 0;
    }
    return !(left && right);
}

/// The search for ∇H = 0 in one frame.
class InteriorSearch {
public:
    InteriorSearch(Search& search, std::span<const Vec3> polygon, const Frame& frame, const Cubic& h)
        : search_(search), polygon_(polygon), frame_(frame), normal_(cross(frame.u, frame.v)), h_(h) {}

    /// Newton's iteration from (s, t). Each point of it that lies in the polygon is a candidate: a value that
    /// is attained never does harm.
    void polish(double s, double t) {
        constexpr int most_steps = 8;  // quadratic convergence from a root of the quartic: 2 to 4 do
        for (int step = 0; step < most_steps && std::max(std::abs(s), std::abs(t)) <= 2; ++step) {
            if (const Vec3 p = frame_.at(s, t); holds(polygon_, normal_, p)) search_.add(p);
            const double gs =
                h_.h10 + 2 * h_.h20 * s + h_.h11 * t + (3 * h_.h30 * s + 2 * h_.h21 * t) * s + h_.h12 * t * t;
            const double gt =
                h_.h01 + h_.h11 * s + 2 * h_.h02 * t + (h_.h21 * s + 2 * h_.h12 * t) * s + 3 * h_.h03 * t * t;
            const double ss = 2 * (h_.h20 + 3 * h_.h30 * s + h_.h21 * t);
            const double st = h_.h11 + 2 * (h_.h21 * s + h_.h12 * t);
            const double tt = 2 * (h_.h02 + h_.h12 * s + 3 * h_.h03 * t);
            const double det = ss * tt - st * st;
            const double ds = (st * gt - tt * gs) / det, dt = (st * gs - ss * gt) / det;
            if (!(std::isfinite(ds) && std::isfinite(dt)) || (s + ds == s && t + dt == t)) return;
            s += ds, t += dt;
        }
    }

    /// Both conics at each root of their resultant.
    void common_roots() {
        const std::array<double, 5> quartic = resultant(h_);
        double t[most_roots];
        const int count = roots_between(quartic.data(), 4, -1, 1, t);
        for (int i = 0; i < count; ++i) {
            double s[4];
            int n = quadratic_roots(3 * h_.h30, 2 * (h_.h21 * t[i] + h_.h20),
                                    (h_.h12 * t[i] + h_.h11) * t[i] + h_.h10, s);
            n += quadratic_roots(h_.h21, 2 * h_.h12 * t[i] + h_.h11,
                                 (3 * h_.h03 * t[i] + 2 * h_.h02) * t[i] + h_.h01, s + n);
            for (int k = 0; k < n; ++k) polish(s[k], t[i]);
        }
    }

private:
    Search& search_;
    std::span<const Vec3> polygon_;
    const Frame& frame_;
    Vec3 normal_;
    const Cubic& h_;
};

void add_interior(Search& search, std::span<const Vec3> polygon) {
    Frame frame;
    if (polygon.size() < 3 || !make_frame(polygon, frame)) return;
    const Taylor expansion(search.corner, frame.origin);
    Cubic h(expansion, frame.u, frame.v);
    // On |s|, |t| ≤ 1 each derivative changes by at most this from its value at the origin.
    const double change_s =
        2 * std::abs(h.h20) + std::abs(h.h11) + 3 * std::abs(h.h30) + 2 * std::abs(h.h21) + std::abs(h.h12);
    const double change_t =
        2 * std::abs(h.h02) + std::abs(h.h11) + 3 * std::abs(h.h03) + 2 * std::abs(h.h12) + std::abs(h.h21);
    if (std::abs(h.h10) > change_s || std::abs(h.h01) > change_t || h.largest() == 0) return;

    h.divide(h.largest());
    InteriorSearch interior(search, polygon, frame, h);
    interior.polish(0, 0);  // a quadratic H has one critical point, one step away from anywhere
    // Both conics linear in s: H is quadratic, or f is linear along u; then no extreme is inside.
    if (h.h30 != 0 || h.h21 != 0) interior.common_roots();
}

}  // namespace

Range candidate_extremes(const std::array<double, 8>& corner, std::span<const Vec3> polygon) {
    Search search(corner, polygon.front());
    for (const Vec3& p : polygon) search.add(p);
    for (std::size_t i = 0; i < polygon.size(); ++i)
        add_edge(search, polygon[i], polygon[(i + 1) % polygon.size()]);
    add_interior(search, polygon);
    return search.range;
}

}  // namespace its::shell
