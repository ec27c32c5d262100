#include "verify/exact.h"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstddef>
#include <vector>

namespace its::verifier {
namespace {

using Whole = boost::multiprecision::cpp_int;

int sign_of(double v) {
    return (v > 0) - (v < 0);
}

/// A double with what it may be off by, in units of 2⁻⁵³ of `size`, the sum of the magnitudes of all terms:
/// each term of a determinant of differences goes through at most nine roundings, and 16 cover their powers.
struct Filtered {
    double value = 0, size = 0;

    /// The sign is beyond doubt. Where nothing was rounded away (all terms are 0) zero is exact.
    bool certain() const {
        return std::abs(value) > 16 * 0x1p-53 * size + 0x1p-960 || (value == 0 && size == 0);
    }
};

/// Numbers that a double holds exactly, or a note that it did not.
struct Exactly {
    double value = 0;
    bool exact = true;
};

Exactly minus(const Exactly& a, const Exactly& b) {
    const double d = a.value - b.value, back = d - a.value;
    const double rest = (a.value - (d - back)) - (b.value + back);
    return {d, a.exact && b.exact && rest == 0};
}

/// A product's rounding is a double itself unless it is below all doubles; hence the limits.
Exactly times(const Exactly& a, const Exactly& b) {
    const double p = a.value * b.value;
    if (a.value == 0 || b.value == 0) return {0, a.exact && b.exact};
    const bool plain = std::abs(p) > 0x1p-900 && std::abs(p) < 0x1p1000;
    return {p, a.exact && b.exact && plain && std::fma(a.value, b.value, -p) == 0};
}

/// Coordinates as whole numbers times one power of two.
class Wholes {
public:
    void add(double v) {
        values_.push_back(v);
        if (v == 0) return;
        int exponent = 0;
        std::frexp(v, &exponent);
        least_ = std::min(least_, exponent - 53);
    }
    Whole at(std::size_t i) const {
        if (values_[i] == 0) return 0;
        int exponent = 0;
        const double mantissa = std::frexp(values_[i], &exponent);
        Whole whole = static_cast<long long>(std::ldexp(mantissa, 53));
        return whole << unsigned(exponent - 53 - least_);
    }

private:
    std::vector<double> values_;
    int least_ = 2000;
};

/// (b − a) × (p − a) in the plane.
template <class T, class Minus, class Times>
T plane_determinant(const T (&v)[6], const Minus& minus, const Times& times) {
    return minus(times(minus(v[2], v[0]), minus(v[5], v[1])), times(minus(v[3], v[1]), minus(v[4], v[0])));
}

/// [b − a, c − a, p − a]; negative terms are taken off, so that there is no sum.
template <class T, class Minus, class Times>
T space_determinant(const T (&v)[12], const Minus& minus, const Times& times) {
    T u[3], w[3], d[3];
    for (int i = 0; i < 3; ++i) {
        u[i] = minus(v[3 + i], v[i]);
        w[i] = minus(v[6 + i], v[i]);
        d[i] = minus(v[9 + i], v[i]);
    }
    const auto minor = [&](int i, int j) { return minus(times(u[i], w[j]), times(u[j], w[i])); };
    // n·d with n_y = u_z w_x − u_x w_z = −minor(0, 2).
    const T off = minus(times(minor(0, 2), d[1]), times(minor(0, 1), d[2]));
    return minus(times(minor(1, 2), d[0]), off);
}

template <std::size_t n, class Determinant>
int exact_sign(const double (&v)[n], const Determinant& determinant) {
    Exactly e[n];
    for (std::size_t i = 0; i < n; ++i) e[i].value = v[i];
    const Exactly quick = determinant(
        e, [](const Exactly& a, const Exactly& b) { return minus(a, b); },
        [](const Exactly& a, const Exactly& b) { return times(a, b); });
    if (quick.exact) return sign_of(quick.value);
    Wholes wholes;
    for (const double x : v) wholes.add(x);
    Whole whole[n];
    for (std::size_t i = 0; i < n; ++i) whole[i] = wholes.at(i);
    const Whole slow = determinant(
        whole, [](const Whole& a, const Whole& b) -> Whole { return a - b; },
        [](const Whole& a, const Whole& b) -> Whole { return a * b; });
    return slow.sign();
}

Filtered filtered(const Vec3& u, const Vec3& v, const Vec3& w) {
    const double yz = u.y * v.z, zy = u.z * v.y, zx = u.z * v.x, xz = u.x * v.z, xy = u.x * v.y, yx = u.y * v.x;
    return {(yz - zy) * w.x + (zx - xz) * w.y + (xy - yx) * w.z,
            (std::abs(yz) + std::abs(zy)) * std::abs(w.x) + (std::abs(zx) + std::abs(xz)) * std::abs(w.y) +
                (std::abs(xy) + std::abs(yx)) * std::abs(w.z)};
}

/// Products of three differences may fall below all doubles, or a size of 0 hide such a product.
bool ordinary(double v) {
    return v == 0 || (std::abs(v) > 1e-90 && std::abs(v) < 1e90);
}

}  // namespace

int turn_sign(const Vec3& a, const Vec3& b, const Vec3& p, int first, int second) {
    const double ux = b[first] - a[first], uy = b[second] - a[second];
    const double vx = p[first] - a[first], vy = p[second] - a[second];
    const double left = ux * vy, right = uy * vx;
    const Filtered f{left - right, std::abs(left) + std::abs(right)};
    if (f.certain() && ordinary(ux) && ordinary(uy) && ordinary(vx) && ordinary(vy)) return sign_of(f.value);
    const double v[6] = {a[first], a[second], b[first], b[second], p[first], p[second]};
    return exact_sign(v, [](const auto& values, const auto& minus, const auto& times) {
        return plane_determinant(values, minus, times);
    });
}

int plane_side(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
    const Vec3 u = {b.x - a.x, b.y - a.y, b.z - a.z}, v = {c.x - a.x, c.y - a.y, c.z - a.z},
               w = {p.x - a.x, p.y - a.y, p.z - a.z};
    const Filtered f = filtered(u, v, w);
    bool plain = f.certain();
    for (int axis = 0; axis < 3; ++axis)
        plain = plain && ordinary(u[axis]) && ordinary(v[axis]) && ordinary(w[axis]);
    if (plain) return sign_of(f.value);
    const double all[12] = {a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, p.x, p.y, p.z};
    return exact_sign(all, [](const auto& values, const auto& minus, const auto& times) {
        return space_determinant(values, minus, times);
    });
}

// turn(a, b, p + δ) = turn(a, b, p) + δy (bx − ax) − δx (by − ay), and δy ≫ δx.
int displaced_turn(const Vec3& a, const Vec3& b, const Vec3& p) {
    const int sign = turn_sign(a, b, p, 0, 1);
    if (sign != 0) return sign;
    return a.x != b.x ? sign_of(b.x - a.x) : (a.y > b.y) - (a.y < b.y);
}

// n·(p + δ − a) = n·(p − a) + δy n_y + δz n_z + …, and δy ≫ δz; n_z is not 0.
bool displaced_above(const Vec3& a, const Vec3& b, const Vec3& c, int up, const Vec3& p) {
    int side = plane_side(a, b, c, p);
    if (side == 0) side = turn_sign(a, b, c, 2, 0);  // n_y = u_z v_x − u_x v_z
    if (side == 0) side = up;
    return side == up;
}

bool strictly_between(const Vec3& a, const Vec3& b, const Vec3& p) {
    if (p == a || p == b) return false;
    for (int axis = 0; axis < 3; ++axis)
        if (p[axis] < std::min(a[axis], b[axis]) || p[axis] > std::max(a[axis], b[axis])) return false;
    return turn_sign(a, b, p, 0, 1) == 0 && turn_sign(a, b, p, 1, 2) == 0 && turn_sign(a, b, p, 2, 0) == 0;
}

}  // namespace its::verifier
