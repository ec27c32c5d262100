#include "geometry/bernstein.h"

#include <gtest/gtest.h>
#include <random>

#include "base/rounding.h"
#include "geometry/clip.h"

namespace its {
namespace {

using Real = long double;

Real trilinear_exactly(const double* v, Real x, Real y, Real z) {
    Real sum = 0;
    for (int c = 0; c < 8; ++c) sum += v[c] * (c & 1 ? x : 1 - x) * (c & 2 ? y : 1 - y) * (c & 4 ? z : 1 - z);
    return sum;
}

struct Case {
    double corner[8];
    Vec3 p, q, r;
};

Case random_case(std::mt19937_64& random) {
    std::uniform_real_distribution<double> unit(0, 1), value(-2, 2);
    Case c;
    for (double& v : c.corner) v = value(random);
    for (Vec3* p : {&c.p, &c.q, &c.r}) *p = {unit(random), unit(random), unit(random)};
    return c;
}

TEST(Trilinear, EvaluationErrorIsBelowItsBound) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 100000; ++i) {
        const Case c = random_case(random);
        const Real exact = trilinear_exactly(c.corner, c.p.x, c.p.y, c.p.z);
        EXPECT_LE(double(std::abs(geometry::trilinear(c.corner, c.p) - exact)),
                  geometry::trilinear_roundings * unit_roundoff * 2);
    }
}

TEST(Trilinear, IsExactAtTheLowerCorner) {
    std::mt19937_64 random(2);
    const Case c = random_case(random);
    EXPECT_EQ(geometry::trilinear(c.corner, {0, 0, 0}), c.corner[0]);
}

TEST(Trilinear, GradientIsThatOfTheInterpolant) {
    std::mt19937_64 random(3);
    for (int i = 0; i < 1000; ++i) {
        const Case c = random_case(random);
        Vec3 g;
        EXPECT_EQ(geometry::trilinear_with_gradient(c.corner, c.p, g), geometry::trilinear(c.corner, c.p));
        for (int axis = 0; axis < 3; ++axis) {  // linear along each axis: a difference of any length is exact
            Vec3 a = c.p, b = c.p;
            a[axis] = 0;
            b[axis] = 1;
            EXPECT_NEAR(g[axis], geometry::trilinear(c.corner, b) - geometry::trilinear(c.corner, a), 1e-13);
        }
    }
}

TEST(Bernstein, BoundsHoldOnDenseSamplesAndAreAttainedWhereTheySay) {
    std::mt19937_64 random(4);
    for (int i = 0; i < 3000; ++i) {
        const Case c = random_case(random);
        const geometry::Bounds b =
            geometry::bernstein_bounds(c.corner, geometry::sample(c.corner, c.p),
                                       geometry::sample(c.corner, c.q), geometry::sample(c.corner, c.r));
        const double slack = (geometry::control_roundings + geometry::trilinear_roundings) * unit_roundoff * 2;
        EXPECT_LE(b.lower, b.least);
        EXPECT_LE(b.most, b.upper);
        const int n = 16;
        for (int s = 0; s <= n; ++s)
            for (int t = 0; s + t <= n; ++t) {
                const Real f = trilinear_exactly(
                    c.corner, (s * Real(c.p.x) + t * Real(c.q.x) + (n - s - t) * Real(c.r.x)) / n,
                    (s * Real(c.p.y) + t * Real(c.q.y) + (n - s - t) * Real(c.r.y)) / n,
                    (s * Real(c.p.z) + t * Real(c.q.z) + (n - s - t) * Real(c.r.z)) / n);
                ASSERT_GE(double(f), b.lower - slack);
                ASSERT_LE(double(f), b.upper + slack);
            }
    }
}

TEST(Bernstein, ControlValuesAreThePolarForm) {
    // b(p,q,r) is the mean of the products over the orders of the arguments: compare the middle one, computed
    // from the centroid, through the bounds of a function whose middle control value is the largest.
    const double corner[8] = {0, 0, 0, 0, 0, 0, 0, 6};  // 6xyz: b(p,q,r) = the permanent of the coordinates
    const Vec3 p{1, 0, 0}, q{0, 1, 0}, r{0, 0, 1};
    const geometry::Bounds b = geometry::bernstein_bounds(
        corner, geometry::sample(corner, p), geometry::sample(corner, q), geometry::sample(corner, r));
    EXPECT_NEAR(b.upper, 1.0, 1e-15);
    EXPECT_NEAR(b.most, 6.0 / 27, 1e-15);
    EXPECT_NEAR(b.lower, 0, 1e-15);
}

TEST(Bernstein, SubdivisionConvergesQuadratically) {
    std::mt19937_64 random(5);
    for (int i = 0; i < 100; ++i) {
        Case c = random_case(random);
        double gap[3];
        for (double& g : gap) {
            const geometry::Bounds b =
                geometry::bernstein_bounds(c.corner, geometry::sample(c.corner, c.p),
                                           geometry::sample(c.corner, c.q), geometry::sample(c.corner, c.r));
            g = (b.upper - b.most) + (b.least - b.lower);
            c.q = c.p + 0.125 * (c.q - c.p);
            c.r = c.p + 0.125 * (c.r - c.p);
        }
        EXPECT_LE(gap[2], gap[0] / 16 + 1e-12) << "1/64 of the size, 1/4096 of the gap: far below 1/16";
    }
}

double area(const geometry::Polygon& polygon) {
    Vec3 sum{0, 0, 0};
    for (int i = 2; i < polygon.size; ++i)
        sum = sum + cross(polygon.vertex(i - 1) - polygon.vertex(0), polygon.vertex(i) - polygon.vertex(0));
    return 0.5 * norm(sum);
}

TEST(Clip, PartsInAllCellsMakeUpTheTriangle) {
    std::mt19937_64 random(6);
    std::uniform_real_distribution<double> anywhere(0, 8);
    for (int i = 0; i < 500; ++i) {
        Vec3 v[3];
        for (Vec3& p : v) p = {anywhere(random), anywhere(random), anywhere(random)};
        double sum = 0;
        for (int x = 0; x < 8; ++x)
            for (int y = 0; y < 8; ++y)
                for (int z = 0; z < 8; ++z) {
                    const Vec3 corner{double(x), double(y), double(z)};
                    const geometry::Polygon part =
                        geometry::clip_to_cell(v[0] - corner, v[1] - corner, v[2] - corner, 0);
                    sum += area(part);
                    for (int k = 0; k < part.size; ++k)
                        for (int axis = 0; axis < 3; ++axis) {
                            ASSERT_GE(part.vertex(k)[axis], -1e-14);
                            ASSERT_LE(part.vertex(k)[axis], 1 + 1e-14);
                        }
                }
        EXPECT_NEAR(sum, 0.5 * norm(cross(v[1] - v[0], v[2] - v[0])), 1e-11);
    }
}

TEST(Clip, KeepsPointsAndSegments) {
    const Vec3 p{0.25, 0.5, 0.75};
    EXPECT_GT(geometry::clip_to_cell(p, p, p, 0).size, 0);
    const geometry::Polygon segment = geometry::clip_to_cell({-1, 0.5, 0.5}, {2, 0.5, 0.5}, {-1, 0.5, 0.5}, 0);
    double low = 9, high = -9;
    for (int i = 0; i < segment.size; ++i) {
        low = std::min(low, segment.vertex(i).x);
        high = std::max(high, segment.vertex(i).x);
    }
    EXPECT_EQ(low, 0);
    EXPECT_EQ(high, 1);
    EXPECT_EQ(geometry::clip_to_cell({2, 2, 2}, {3, 2, 2}, {2, 3, 2}, 0).size, 0);
    EXPECT_GT(geometry::clip_to_cell({1, 0, 0}, {1, 1, 0}, {1, 0, 1}, 0).size, 0)
        << "a triangle in a face of the cell";
}

}  // namespace
}  // namespace its
