#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/vec3.h"
#include "its/distance.h"
#include "support/zoo.h"

namespace its {
namespace {

TEST(MeshDistance, ClosedForms) {
    const Mesh inner = zoo::box({0, 0, 0}, {1, 1, 1}), outer = zoo::box({-0.5, 0, 0}, {1, 1, 1});
    const MeshDistance d = mesh_distance(outer, inner, 100'000);
    EXPECT_DOUBLE_EQ(d.max, 0.5);
    // The side at −½ is ½ away; the four strips of 0.5 × 1 next to it ¼ on average; of 8 in all.
    EXPECT_NEAR(d.mean, (0.5 + 4 * 0.5 * 0.25) / 8, 1e-3);
    EXPECT_NEAR(d.root_mean_square, std::sqrt((0.25 + 4 * 0.5 * 0.25 / 3) / 8), 1e-3);
    EXPECT_EQ(mesh_distance(inner, inner, 1000).max, 0);
}

TEST(MeshDistance, IsThatOfTheFarthestVertexBetweenConvexBodies) {
    // The distance to a convex body is convex: largest at a vertex, which no sample may exceed.
    const Mesh ball = zoo::sphere({0.2, 0, 0}, 2, 3), box = zoo::box({-1, -1, -1}, {1, 1, 1});
    double most = 0;
    for (const Vec3& p : ball.vertices) {
        const Vec3 out{std::max(std::abs(p.x) - 1, 0.0), std::max(std::abs(p.y) - 1, 0.0),
                       std::max(std::abs(p.z) - 1, 0.0)};
        most = std::max(most, norm(out));
    }
    EXPECT_NEAR(mesh_distance(ball, box, 0).max, most, 1e-14);
    EXPECT_NEAR(mesh_distance(ball, box).max, most, 1e-14);
}

TEST(MeshDistance, SamplesFindWhatVerticesMiss) {
    // The tip of a pyramid is above the middle of the square, whose corners both share.
    const Mesh square{{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}, {{0, 1, 2}, {0, 2, 3}}};
    const Mesh roof{{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 1, 5}},
                    {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}};
    EXPECT_EQ(mesh_distance(square, roof, 0).max, 0);
    EXPECT_NEAR(mesh_distance(square, roof, 100'000).max, 5 / std::sqrt(26.0), 0.01);
}

TEST(MeshDistance, VerticesThatNoTriangleUsesDoNotCount) {
    Mesh mesh = zoo::tetrahedron();
    mesh.vertices.push_back({100, 0, 0});
    mesh.vertices.push_back({std::numeric_limits<double>::quiet_NaN(), 0, 0});
    EXPECT_LT(mesh_distance(mesh, zoo::tetrahedron(), 0).max, 1e-14);
}

TEST(MeshDistance, OfAMeshWithoutAreaIsThatOfItsVertices) {
    const Mesh needle{{{0, 0, 3}, {0, 0, 4}}, {{0, 1, 1}}};
    const Mesh floor{{{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}, {{0, 1, 2}}};
    const MeshDistance d = mesh_distance(needle, floor);
    EXPECT_DOUBLE_EQ(d.max, 4);
    EXPECT_EQ(d.mean, 0);
}

TEST(MeshDistance, IsTheSameForAnyNumberOfThreads) {
    const Mesh a = zoo::twisted_knot(80, 20), b = zoo::twisted_knot(60, 15);
    const MeshDistance one = mesh_distance(a, b, 50'000, {.threads = 1}),
                       two = mesh_distance(a, b, 50'000, {.threads = 2});
    EXPECT_EQ(one.max, two.max);
    EXPECT_EQ(one.mean, two.mean);
    EXPECT_EQ(one.root_mean_square, two.root_mean_square);
}

TEST(MeshDistance, AnyNumberOfSamplesTakesLittleMemory) {
    int calls = 0;
    const auto soon = [&](std::string_view, double) { return ++calls < 4; };
    EXPECT_THROW(
        mesh_distance(zoo::tetrahedron(), zoo::tetrahedron(), std::uint64_t{1} << 60, {.progress = soon}),
        Cancelled);
}

TEST(MeshDistance, RefusesAndStops) {
    const Mesh mesh = zoo::tetrahedron();
    EXPECT_THROW(mesh_distance({}, mesh), InputError);
    EXPECT_THROW(mesh_distance(mesh, {}), InputError);
    EXPECT_THROW(mesh_distance(mesh, mesh, 10, {.threads = -1}), OptionError);
    EXPECT_THROW(mesh_distance(mesh, mesh, 100'000,
                               {.threads = 2, .progress = [](std::string_view, double f) { return f < 0.5; }}),
                 Cancelled);
}

}  // namespace
}  // namespace its
