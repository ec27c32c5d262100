// Solid angles and sums of angles.
#include "winding/solid_angle.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <random>

namespace its {
namespace {

TEST(QuickAtan2, IsWithinItsError) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> unit(-1, 1);
    double worst = 0;
    for (int i = 0; i < 1000000; ++i) {
        const double x = unit(random), y = unit(random) * std::exp2(-40 * (i % 3 == 0 ? unit(random) : 0.0));
        worst = std::max(worst, std::abs(winding::quick_atan2(y, x) - std::atan2(y, x)));
    }
    EXPECT_LT(worst, winding::quick_error);
    EXPECT_GT(worst, winding::quick_error / 4);  // at the ends of octants, where the series is worst
}

TEST(QuickAtan2, HasTheQuadrantsOfAtan2) {
    for (const double y : {-1.0, -0.0, 0.0, 1.0})
        for (const double x : {-1.0, 0.0, 1.0}) {
            if (x == 0 && y == 0) continue;
            EXPECT_NEAR(winding::quick_atan2(y, x), std::atan2(y, x), winding::quick_error) << y << ' ' << x;
        }
    EXPECT_EQ(std::signbit(winding::quick_atan2(-0.0, 1)), true);
}

/// Turns add up beyond π, either way, for sums by either function.
TEST(AngleSums, CountTurns) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int trial = 0; trial < 2000; ++trial) {
        winding::AngleSums<1> sums;
        double expected = 0;
        const double drift = 2.5 * unit(random);
        const int count = 40;
        for (int i = 0; i < count; ++i) {
            const double angle = std::clamp(drift + unit(random), -3.14, 3.14),
                         size = std::exp2(20 * unit(random));
            sums.add(0, size * std::cos(angle), size * std::sin(angle), 0);
            expected += angle;
        }
        ASSERT_NEAR(sums.sum(0), expected, sums.error(0, count) + 1e-13);
        ASSERT_NEAR(sums.quick_sum(0), expected, sums.error(0, count) + winding::quick_error + 1e-13);
    }
}

TEST(HalfSolidAngle, OfAnOctantAndOfItsOppositeSide) {
    winding::AngleSums<2> sums;
    const winding::Sight x{1, 0, 0, 1}, y{0, 1, 0, 1}, z{0, 0, 1, 1};
    EXPECT_EQ(winding::add_half_solid_angle(sums, 0, x, y, z), 0);
    EXPECT_EQ(winding::add_half_solid_angle(sums, 1, x, z, y), 0);
    EXPECT_NEAR(sums.sum(0), std::numbers::pi / 4, 1e-15);
    EXPECT_NEAR(sums.sum(1), -std::numbers::pi / 4, 1e-15);
}

TEST(HalfSolidAngle, IsInDoubtInTheTriangle) {
    winding::AngleSums<1> sums;
    const double s = std::sqrt(0.5);
    EXPECT_EQ(winding::add_half_solid_angle(sums, 0, {1, 0, 0, 1}, {-s, s, 0, 1}, {-s, -s, 0, 1}),
              std::numeric_limits<double>::infinity());
    EXPECT_EQ(winding::add_half_solid_angle(sums, 0, {2, 0, 0, 2}, {3, 1, 0, std::sqrt(10)},
                                            {3, -1, 0, std::sqrt(10)}),
              0);
}

}  // namespace
}  // namespace its
