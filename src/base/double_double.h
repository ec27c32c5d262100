#pragma once

#include <cmath>

#include "base/platform/compiler.h"

/// Numbers with twice a double's digits, the same on every machine. In all bounds u = 2⁻⁵³, and neither an
/// operand's square nor a result overflows; where products underflow, 2⁻¹⁰⁷³ is added to each bound.
namespace its {

/// The unevaluated sum of two doubles, |low| ≤ u·|high|.
struct DoubleDouble {
    double high = 0, low = 0;

    DoubleDouble() = default;
    ITS_INLINE DoubleDouble(double x) : high(x) {}
    ITS_INLINE DoubleDouble(double big, double small) : high(big), low(small) {}

    explicit operator double() const { return high; }  ///< the nearest double, by |low| ≤ u·|high|
};

/// a + b, exactly (Knuth 1969).
ITS_INLINE DoubleDouble exact_sum(double a, double b) {
    const double sum = a + b, other = sum - a;
    return {sum, (a - (sum - other)) + (b - other)};
}

/// a + b, exactly, if |a| ≥ |b| or a = 0 (Dekker 1971).
ITS_INLINE DoubleDouble exact_sum_of_ordered(double a, double b) {
    const double sum = a + b;
    return {sum, b - (sum - a)};
}

/// a·b, exactly.
ITS_INLINE DoubleDouble exact_product(double a, double b) {
    const double product = a * b;
    return {product, std::fma(a, b, -product)};
}

ITS_INLINE DoubleDouble operator-(const DoubleDouble& a) {
    return {-a.high, -a.low};
}

/// Errs by at most 6u²(|a| + |b|): with S = |a.high| + |b.high|, the exact sum of the high parts leaves a rest
/// ≤ uS; the sum of the low parts, ≤ uS(1 + u), is rounded by u²S(1 + u), and the sum of both, ≤ 2uS(1 + u)²,
/// by 2u²S(1 + u)²; the last step is exact.
ITS_INLINE DoubleDouble operator+(const DoubleDouble& a, const DoubleDouble& b) {
    const DoubleDouble sum = exact_sum(a.high, b.high);
    return exact_sum(sum.high, sum.low + (a.low + b.low));
}
ITS_INLINE DoubleDouble operator-(const DoubleDouble& a, const DoubleDouble& b) {
    return a + -b;
}

/// Errs by at most 8u²|ab|: with P = |a.high·b.high|, the product of the low parts, ≤ u²P, is left out; one
/// mixed product, ≤ uP, is rounded by u²P; the sum of both, ≤ 2uP(1 + u), by 2u²P(1 + u); that with the rest of
/// the first product, ≤ 3uP(1 + 2u), by 3u²P(1 + 2u); the last step is exact.
ITS_INLINE DoubleDouble operator*(const DoubleDouble& a, const DoubleDouble& b) {
    const DoubleDouble product = exact_product(a.high, b.high);
    return exact_sum_of_ordered(product.high, product.low + std::fma(a.low, b.high, a.high * b.low));
}

/// 1/b for b ≠ 0; errs by at most 12u²/|b|. Newton's step from q = fl(1/b.high): with r = 1 − qb, |r| ≤ 2.1u,
/// the quotient is q(1 + r) up to r²/|b| ≤ 5u²/|b|. The computed r errs by u² for the product and 2.1u² for the
/// difference, since 1 − q·b.high is a double; its product with q by 2.2u²/|b|; the last step is exact.
ITS_INLINE DoubleDouble inverse(const DoubleDouble& b) {
    const double q = 1 / b.high, rest = std::fma(-q, b.high, 1.0) - q * b.low;
    return exact_sum_of_ordered(q, q * rest);
}

/// √a for a > 0 (nothing meaningful otherwise); errs by at most 12u²√a. Newton's step from h = fl(√a.high):
/// with r = a − h², |r| ≤ 3.1ua, the root is h + r/2h up to r²/8h³ ≤ 1.3u²√a. In r, a.high − fl(h²) is exact
/// (Sterbenz); the two sums with what is left of h² and with a.low are rounded by u times 3.1ua
/// and 4.2ua, 3.7u²√a of the root; the quotient by 2u²√a.
ITS_INLINE DoubleDouble square_root(const DoubleDouble& a) {
    const double h = std::sqrt(a.high);
    const DoubleDouble square = exact_product(h, h);
    return exact_sum_of_ordered(h, (((a.high - square.high) - square.low) + a.low) / (2 * h));
}

/// ab + cd; errs by at most 15u²(|ab| + |cd|): with S the sum of |products of high parts|, the products of low
/// parts, ≤ u²S, are left out; the mixed ones are rounded by 3u²S as above, their sums with the rests of the
/// products by 3u²S, the sum of both by 3u²S, that with the rest of the sum, ≤ 4uS, by 4u²S, each up to a
/// factor 1 + 3u.
ITS_INLINE DoubleDouble sum_of_products(const DoubleDouble& a, const DoubleDouble& b, const DoubleDouble& c,
                                        const DoubleDouble& d) {
    const DoubleDouble first = exact_product(a.high, b.high), second = exact_product(c.high, d.high),
                       sum = exact_sum(first.high, second.high);
    const double low = (first.low + std::fma(a.low, b.high, a.high * b.low)) +
                       (second.low + std::fma(c.low, d.high, c.high * d.low));
    return exact_sum(sum.high, sum.low + low);
}

ITS_INLINE bool operator<(const DoubleDouble& a, const DoubleDouble& b) {
    return a.high < b.high || (a.high == b.high && a.low < b.low);
}

/// The largest whole number that is no larger, for numbers below 2⁵³.
ITS_INLINE double floor(const DoubleDouble& a) {
    const double whole = std::floor(a.high);
    return whole == a.high && a.low < 0 ? whole - 1 : whole;
}

}  // namespace its
