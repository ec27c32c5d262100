#include "geometry/predicates.h"

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <span>

namespace its::geometry {
namespace {

// Expansions (Priest; Shewchuk 1997): a number as the exact sum of doubles that do not overlap, in ascending
// magnitude, none of them zero. The sign is that of the last one; zero has no components. All steps are exact
// as long as nothing overflows or falls below 2⁻¹⁰⁷⁴, see in_range.

template <int capacity>
struct Expansion {
    int size = 0;
    std::array<double, capacity> part;

    void push(double v) {
        if (v != 0) part[size++] = v;
    }
    int sign() const { return size == 0 ? 0 : detail::sign(part[size - 1]); }
};

struct Pair {
    double high, low;  // high = fl(high + low)
};

// high + low = a + b, if |a| ≥ |b| or a = 0.
inline Pair fast_two_sum(double a, double b) {
    const double high = a + b;
    return {high, b - (high - a)};
}

inline Pair two_sum(double a, double b) {
    const double high = a + b;
    const double from_b = high - a;
    return {high, (a - (high - from_b)) + (b - from_b)};
}

inline Pair two_product(double a, double b) {
    const double high = a * b;
    return {high, std::fma(a, b, -high)};
}

inline Expansion<2> difference(double a, double b) {
    const auto [high, low] = two_sum(a, -b);
    Expansion<2> e;
    e.push(low);
    e.push(high);
    return e;
}

// Shewchuk's fast expansion sum, with elimination of zeros; keeps the strongly non-overlapping property.
// f_sign: 1 or −1, for e + f or e − f.
template <int n, int m>
Expansion<n + m> sum(const Expansion<n>& e, const Expansion<m>& f, double f_sign = 1) {
    Expansion<n + m> h;
    int i = 0, j = 0;
    const auto next = [&] {
        if (j == f.size || (i < e.size && std::abs(e.part[i]) < std::abs(f.part[j]))) return e.part[i++];
        return f_sign * f.part[j++];
    };
    if (e.size + f.size == 0) return h;
    double q = next();
    if (i < e.size || j < f.size) {
        const auto [high, low] = fast_two_sum(next(), q);
        q = high;
        h.push(low);
    }
    while (i < e.size || j < f.size) {
        const auto [high, low] = two_sum(q, next());
        q = high;
        h.push(low);
    }
    h.push(q);
    return h;
}

// Shewchuk's expansion scaling.
template <int n>
Expansion<2 * n> scaled(const Expansion<n>& e, double b) {
    Expansion<2 * n> h;
    if (e.size == 0) return h;
    auto [q, first] = two_product(e.part[0], b);
    h.push(first);
    for (int i = 1; i < e.size; ++i) {
        const Pair product = two_product(e.part[i], b);
        const Pair s = two_sum(q, product.low);
        h.push(s.low);
        const Pair t = fast_two_sum(product.high, s.high);
        h.push(t.low);
        q = t.high;
    }
    h.push(q);
    return h;
}

template <int n>
Expansion<4 * n> product(const Expansion<n>& e, const Expansion<2>& f) {
    Expansion<4 * n> h;
    if (e.size == 0 || f.size == 0) return h;
    if (f.size == 2) return sum(scaled(e, f.part[0]), scaled(e, f.part[1]));
    const Expansion<2 * n> s = scaled(e, f.part[0]);
    h.size = s.size;
    std::copy_n(s.part.begin(), s.size, h.part.begin());
    return h;
}

// e·f − g·h
Expansion<16> minor(const Expansion<2>& e, const Expansion<2>& f, const Expansion<2>& g,
                    const Expansion<2>& h) {
    return sum(product(e, f), product(g, h), -1);
}

// A double of magnitude ≥ 1e-90 > 2⁻²⁹⁹ is a multiple of 2⁻³⁵¹; so are differences and their rounding errors,
// and products of three are multiples of 2⁻¹⁰⁵³: no bit is lost below 2⁻¹⁰⁷⁴. With magnitudes ≤ 1e100 < 2³³³
// the six monomials stay below 6·(2³³⁴)³ < 2¹⁰⁰⁵: no overflow.
bool in_range(std::initializer_list<double> coordinates) {
    return std::ranges::all_of(
        coordinates, [](double v) { return v == 0 || (std::abs(v) >= 1e-90 && std::abs(v) <= 1e100); });
}

using Integer = boost::multiprecision::cpp_int;

// v·2¹⁰⁷⁴
Integer to_integer(double v) {
    int exponent = 0;
    const double fraction = std::frexp(v, &exponent);  // 2⁵³·fraction is an integer
    const Integer mantissa = static_cast<long long>(std::ldexp(fraction, 53));
    const int shift = exponent - 53 + 1074;  // < 0 only for subnormal numbers, whose low bits are then 0
    return shift >= 0 ? Integer(mantissa << shift) : Integer(mantissa / (Integer(1) << -shift));
}

int orient3d_integer(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto difference = [&](const Vec3& p) {
        return std::array<Integer, 3>{to_integer(p.x) - to_integer(a.x), to_integer(p.y) - to_integer(a.y),
                                      to_integer(p.z) - to_integer(a.z)};
    };
    const auto u = difference(b), v = difference(c), w = difference(d);
    const Integer det = (u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] +
                        (u[0] * v[1] - u[1] * v[0]) * w[2];
    return det.sign();
}

struct Point2 {
    double x, y;
};

Point2 project(const Vec3& p, int axis) {
    return {p[(axis + 1) % 3], p[(axis + 2) % 3]};
}

int orient(const Point2& a, const Point2& b, const Point2& c) {
    return orient2d(a.x, a.y, b.x, b.y, c.x, c.y);
}

bool in_box(const Point2& p, const Point2& q, const Point2& r) {  // r in the box of p and q
    return std::min(p.x, q.x) <= r.x && r.x <= std::max(p.x, q.x) && std::min(p.y, q.y) <= r.y &&
           r.y <= std::max(p.y, q.y);
}

// Whether the closed segments pq and rs share a point; either may be a point.
bool segments_meet(const Point2& p, const Point2& q, const Point2& r, const Point2& s) {
    const int r_side = orient(p, q, r), s_side = orient(p, q, s);
    const int p_side = orient(r, s, p), q_side = orient(r, s, q);
    if (r_side * s_side < 0 && p_side * q_side < 0) return true;
    return (r_side == 0 && in_box(p, q, r)) || (s_side == 0 && in_box(p, q, s)) ||
           (p_side == 0 && in_box(r, s, p)) || (q_side == 0 && in_box(r, s, q));
}

// In space: coplanar, and the projections along every axis meet. At least one of these is one-to-one on the
// plane (or line) of the segments, so its meeting is a meeting in space.
bool segments_meet(const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s) {
    if (orient3d(p, q, r, s) != 0) return false;
    for (int axis = 0; axis < 3; ++axis)
        if (!segments_meet(project(p, axis), project(q, axis), project(r, axis), project(s, axis)))
            return false;
    return true;
}

// Whether the closed triangle holds p, a point of its plane. False if the triangle is degenerate.
bool triangle_holds(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
    for (int axis = 0; axis < 3; ++axis) {
        const Point2 a2 = project(a, axis), b2 = project(b, axis), c2 = project(c, axis), p2 = project(p, axis);
        const int side = orient(a2, b2, c2);
        if (side == 0) continue;
        return side * orient(a2, b2, p2) >= 0 && side * orient(b2, c2, p2) >= 0 &&
               side * orient(c2, a2, p2) >= 0;
    }
    return false;
}

bool boxes_meet(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p, const Vec3& q) {
    for (int i = 0; i < 3; ++i) {
        if (std::max(p[i], q[i]) < std::min({a[i], b[i], c[i]})) return false;
        if (std::min(p[i], q[i]) > std::max({a[i], b[i], c[i]})) return false;
    }
    return true;
}

}  // namespace

int detail::orient2d_exact(double ax, double ay, double bx, double by, double cx, double cy) {
    const Pair ux = two_sum(bx, -ax), vy = two_sum(cy, -ay), uy = two_sum(by, -ay), vx = two_sum(cx, -ax);
    // Rounded differences have the right signs, hence so have their products.
    const int left_sign = sign(ux.high) * sign(vy.high), right_sign = sign(uy.high) * sign(vx.high);
    if (left_sign != right_sign || left_sign == 0) return sign(double(left_sign - right_sign));

    const auto exact = [](const Pair& left, const Pair& right) {  // no bit below 2⁻¹⁰⁷⁴, no overflow
        return std::min(std::abs(left.high), std::abs(right.high)) > 0x1p-960 &&
               std::max(std::abs(left.high), std::abs(right.high)) < 0x1p1000;
    };
    if (ux.low == 0 && vy.low == 0 && uy.low == 0 && vx.low == 0) {
        const Pair left = two_product(ux.high, vy.high), right = two_product(uy.high, vx.high);
        if (exact(left, right)) {  // rounding is monotone: unequal rounded products settle it
            return left.high != right.high ? sign(left.high - right.high) : sign(left.low - right.low);
        }
    }
    if (!in_range({ax, ay, bx, by, cx, cy})) {
        return orient3d_integer({0, 0, 0}, {ax, ay, 1}, {bx, by, 1}, {cx, cy, 1});
    }
    return minor(difference(bx, ax), difference(cy, ay), difference(by, ay), difference(cx, ax)).sign();
}

// Whether p·q − r·s is a difference of zeros; rounded differences of coordinates are 0 only if exactly so.
static bool vanishes(double p, double q, double r, double s) {
    return (p == 0 || q == 0) && (r == 0 || s == 0);
}

int detail::orient3d_exact(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const Vec3 u{b.x - a.x, b.y - a.y, b.z - a.z}, v{c.x - a.x, c.y - a.y, c.z - a.z},
        w{d.x - a.x, d.y - a.y, d.z - a.z};
    if ((w.x == 0 || vanishes(u.y, v.z, u.z, v.y)) && (w.y == 0 || vanishes(u.z, v.x, u.x, v.z)) &&
        (w.z == 0 || vanishes(u.x, v.y, u.y, v.x)))
        return 0;  // four points of an axis-aligned plane, equal corners: most zeros of CAD meshes
    if (!in_range({a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, d.x, d.y, d.z}))
        return orient3d_integer(a, b, c, d);
    const auto ux = difference(b.x, a.x), uy = difference(b.y, a.y), uz = difference(b.z, a.z);
    const auto vx = difference(c.x, a.x), vy = difference(c.y, a.y), vz = difference(c.z, a.z);
    const auto x = product(minor(uy, vz, uz, vy), difference(d.x, a.x));
    const auto y = product(minor(uz, vx, ux, vz), difference(d.y, a.y));
    const auto z = product(minor(ux, vy, uy, vx), difference(d.z, a.z));
    return sum(sum(x, y), z).sign();
}

bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) {
    return orient2d(a.x, a.y, b.x, b.y, c.x, c.y) == 0 && orient2d(a.y, a.z, b.y, b.z, c.y, c.z) == 0 &&
           orient2d(a.z, a.x, b.z, b.x, c.z, c.x) == 0;
}

int perturbed_orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g) {
    if (const int s = orient3d(a, b, c, g)) return s;
    // orient3d(a, b, c, g + ε) = orient3d(a, b, c, g) + n·ε; n's components are doubled projected areas.
    if (const int s = orient2d(a.z, a.x, b.z, b.x, c.z, c.x)) return s;
    if (const int s = orient2d(a.x, a.y, b.x, b.y, c.x, c.y)) return s;
    return orient2d(a.y, a.z, b.y, b.z, c.y, c.z);
}

int detail::x_line_crossing_in_bounds(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g, double x1) {
    // The line meets the triangle where its projection lies on the same side of all three edges: the sign of
    // n_x. Where the projections of the corners are collinear the three areas add up to 0: never the same sign.
    const int side = perturbed_orient2d_yz(a, b, g);
    if (side == 0 || perturbed_orient2d_yz(b, c, g) != side || perturbed_orient2d_yz(c, a, g) != side) return 0;
    // Along +x the determinant rises where n_x > 0. Outside [min x, max x] the signs at the ends are known.
    if (g.x >= std::min({a.x, b.x, c.x}) && perturbed_orient3d(a, b, c, g) == side) return 0;
    if (x1 < std::max({a.x, b.x, c.x}) && perturbed_orient3d(a, b, c, {x1, g.y, g.z}) != side) return 0;
    return -side;
}

int detail::line_crossing_in_bounds(int axis, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g,
                                    double to) {
    const int side = perturbed_orient2d(axis, a, b, g);
    if (side == 0 || perturbed_orient2d(axis, b, c, g) != side || perturbed_orient2d(axis, c, a, g) != side)
        return 0;
    if (g[axis] >= std::min({a[axis], b[axis], c[axis]}) && perturbed_orient3d(a, b, c, g) == side) return 0;
    Vec3 end = g;
    end[axis] = to;
    if (to < std::max({a[axis], b[axis], c[axis]}) && perturbed_orient3d(a, b, c, end) != side) return 0;
    return -side;
}

int segment_crossing(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p, const Vec3& q,
                     bool& degenerate) {
    degenerate = false;
    if (!boxes_meet(a, b, c, p, q)) return 0;
    const int p_side = orient3d(a, b, c, p), q_side = orient3d(a, b, c, q);
    if (p_side * q_side > 0) return 0;
    if (p_side == 0 && q_side == 0) {  // coplanar; every triangle of zero area comes here
        degenerate = triangle_holds(a, b, c, p) || segments_meet(p, q, a, b) || segments_meet(p, q, b, c) ||
                     segments_meet(p, q, c, a);
        return 0;
    }
    // The line pq meets the plane in one point; it is in the triangle if on one side of the three edges.
    const int ab = orient3d(p, q, a, b), bc = orient3d(p, q, b, c), ca = orient3d(p, q, c, a);
    const bool outside = std::min({ab, bc, ca}) < 0 && std::max({ab, bc, ca}) > 0;
    if (outside) return 0;
    degenerate = p_side == 0 || q_side == 0 || ab == 0 || bc == 0 || ca == 0;
    return degenerate ? 0 : p_side;
}

}  // namespace its::geometry
