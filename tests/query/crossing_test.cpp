// The displaced crossing against the undisplaced predicate with a point that is really displaced a little.

#include "query/crossing.h"

#include <gtest/gtest.h>

#include <random>

namespace its {
namespace {

/// Integer coordinates up to 4: determinants of displaced points are integers plus integer multiples, at most
/// 200 in all, of these. So ε_y ≫ ε_z ≫ ε_x decides as if infinitesimal.
constexpr double ey = 0x1p-10, ez = 0x1p-20, ex = 0x1p-30;

struct Case {
    Vec3 a, b, c, p, g;
};

Case random_case(std::mt19937_64& random) {
    const auto coordinate = [&] { return double(random() % 5); };
    const auto point = [&] { return Vec3{coordinate(), coordinate(), coordinate()}; };
    return {point(), point(), point(), point(), point()};
}

TEST(DisplacedCrossing, IsThatOfAPointDisplacedALittle) {
    std::mt19937_64 random(1);
    int seen[3] = {}, in_plane = 0, on_triangle = 0, degenerate_before = 0;
    for (int i = 0; i < 400'000; ++i) {
        const auto [a, b, c, p, g] = random_case(random);
        if (query::triangle_holds(a, b, c, p)) {
            ++on_triangle;
            continue;
        }
        const int side = geometry::orient3d(a, b, c, p);
        const int crossing = query::displaced_crossing(a, b, c, p, side, g);
        bool meet = false;
        const int expected = geometry::segment_crossing(a, b, c, p, {g.x + ex, g.y + ey, g.z + ez}, meet);
        ASSERT_FALSE(meet) << "a displaced segment meets no edge";
        ASSERT_EQ(crossing, expected);
        ASSERT_TRUE(crossing == 0 || query::boxes_meet(a, b, c, p, g));
        ++seen[crossing + 1];
        in_plane += side == 0;
        geometry::segment_crossing(a, b, c, p, g, meet);
        degenerate_before += meet;
    }
    for (const int count : seen) EXPECT_GT(count, 1000);
    EXPECT_GT(in_plane, 1000);
    EXPECT_GT(on_triangle, 1000);
    EXPECT_GT(degenerate_before, 1000) << "the displacement was needed";
}

TEST(TriangleHolds, PointsOfTrianglesSegmentsAndPoints) {
    const Vec3 a{0, 0, 0}, b{4, 0, 0}, c{0, 4, 0};
    EXPECT_TRUE(query::triangle_holds(a, b, c, {1, 1, 0}));
    EXPECT_TRUE(query::triangle_holds(a, b, c, {2, 2, 0}));
    EXPECT_TRUE(query::triangle_holds(a, b, c, a));
    EXPECT_FALSE(query::triangle_holds(a, b, c, {1, 1, 0x1p-1000}));
    EXPECT_FALSE(query::triangle_holds(a, b, c, {2, 2 + 0x1p-50, 0}));
    EXPECT_TRUE(query::triangle_holds(a, b, b, {3, 0, 0}));
    EXPECT_TRUE(query::triangle_holds(b, {1, 0, 0}, a, {0.5, 0, 0}));
    EXPECT_FALSE(query::triangle_holds(a, b, b, {3, 0x1p-60, 0}));
    EXPECT_FALSE(query::triangle_holds(a, b, b, {5, 0, 0}));
    EXPECT_TRUE(query::triangle_holds(c, c, c, c));
    EXPECT_FALSE(query::triangle_holds(c, c, c, a));
}

}  // namespace
}  // namespace its
