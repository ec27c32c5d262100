#include "base/double_double.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <random>

namespace its {
namespace {

using Rational = boost::multiprecision::cpp_rational;

const Rational u2 = Rational(std::ldexp(1.0, -106));

Rational exact(const DoubleDouble& x) {
    return Rational(x.high) + Rational(x.low);
}
Rational size(const Rational& x) {
    return x < 0 ? Rational(-x) : x;
}

/// Numbers whose low part is anything from nothing to half a unit in the last place of the high one; near
/// others, so that sums cancel.
class Numbers {
public:
    DoubleDouble next() {
        const double high = std::ldexp(1 + unit_(random_), exponent_(random_)) * (random_() & 1 ? 1 : -1);
        const double base = random_() & 1 ? last_ * (1 + std::ldexp(unit_(random_), exponent_(random_))) : high;
        last_ = random_() & 1 ? -base : base;
        const double ulp = std::ldexp(1.0, std::ilogb(base) - 52);
        constexpr double parts[] = {0, 0.5, 0.25, 1e-3, 1e-20};
        DoubleDouble x = exact_sum(base, parts[random_() % 5] * unit_(random_) * ulp);
        if (random_() & 1) x.low = -x.low;
        return exact_sum(x.high, x.low);
    }

private:
    std::mt19937 random_{1};
    std::uniform_real_distribution<double> unit_{0, 1};
    std::uniform_int_distribution<int> exponent_{-60, 3};
    double last_ = 1;
};

void expect_normal(const DoubleDouble& x) {
    EXPECT_EQ(x.high + x.low, x.high);
}

constexpr int cases = 20'000;

TEST(DoubleDouble, SumsAndProductsOfDoublesAreExact) {
    Numbers numbers;
    for (int i = 0; i < cases; ++i) {
        const double a = numbers.next().high, b = numbers.next().high;
        EXPECT_EQ(exact(exact_sum(a, b)), Rational(a) + Rational(b));
        EXPECT_EQ(exact(exact_product(a, b)), Rational(a) * Rational(b));
        const double larger = std::abs(a) < std::abs(b) ? b : a, smaller = std::abs(a) < std::abs(b) ? a : b;
        EXPECT_EQ(exact(exact_sum_of_ordered(larger, smaller)), Rational(a) + Rational(b));
    }
}

TEST(DoubleDouble, HasAFloor) {
    EXPECT_EQ(floor(DoubleDouble(2.75)), 2);
    EXPECT_EQ(floor(DoubleDouble(-2.75)), -3);
    EXPECT_EQ(floor(DoubleDouble(3, 1e-20)), 3);
    EXPECT_EQ(floor(DoubleDouble(3, -1e-20)), 2);
    EXPECT_EQ(floor(DoubleDouble(-3, -1e-20)), -4);
    EXPECT_EQ(floor(DoubleDouble(2.5, -1e-20)), 2);
}

TEST(DoubleDouble, ErrsWithinTheBoundsThatAreStated) {
    Numbers numbers;
    for (int i = 0; i < cases; ++i) {
        const DoubleDouble a = numbers.next(), b = numbers.next(), c = numbers.next(), d = numbers.next();
        const Rational x = exact(a), y = exact(b), z = exact(c), w = exact(d);
        EXPECT_LE(size(exact(a + b) - (x + y)), 6 * u2 * (size(x) + size(y)));
        EXPECT_LE(size(exact(a - b) - (x - y)), 6 * u2 * (size(x) + size(y)));
        EXPECT_LE(size(exact(a * b) - x * y), 8 * u2 * size(x * y));
        EXPECT_LE(size(exact(sum_of_products(a, b, c, d)) - (x * y + z * w)),
                  15 * u2 * (size(x * y) + size(z * w)));
        EXPECT_LE(size(exact(inverse(a)) * x - 1), 12 * u2);
        const DoubleDouble positive = a.high < 0 ? -a : a, root = square_root(positive);
        EXPECT_LE(size(exact(root) * exact(root) - size(x)), 25 * u2 * size(x));
        for (const DoubleDouble& result : {a + b, a - b, a * b, sum_of_products(a, b, c, d), inverse(a), root})
            expect_normal(result);
        EXPECT_EQ(a < b, x < y);
        EXPECT_FALSE(a < a);
    }
}

}  // namespace
}  // namespace its
