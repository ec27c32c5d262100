#include "mesh/normals.h"

#include <gtest/gtest.h>
#include <cmath>

#include "geometry/vec3.h"
#include "support/zoo.h"

namespace its {
namespace {

TEST(Normals, SmoothOnABallSharpOnABox) {
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 4);
    const auto smooth = mesh::vertex_normals(ball.vertices, ball.triangles, 40);
    for (std::size_t t = 0; t < ball.triangles.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_NEAR(dot(smooth.at(t, i), ball.vertices[ball.triangles[t][i]]), 1, 1e-3);
    const Mesh box = zoo::box({0, 0, 0}, {1, 2, 3});
    const auto sharp = mesh::vertex_normals(box.vertices, box.triangles, 40);
    for (std::size_t t = 0; t < box.triangles.size(); ++t) {
        const Vec3 area = mesh::area_vector(box.vertices, box.triangles[t]);
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(dot(sharp.at(t, k), area), norm(area), 1e-12);
    }
}

TEST(Normals, DegenerateTrianglesHaveSome) {
    const Mesh mesh{{{0, 0, 0}, {1, 1, 1}}, {{0, 0, 1}, {0, 0, 0}}};
    const auto normals = mesh::vertex_normals(mesh.vertices, mesh.triangles, 40);
    for (std::size_t t = 0; t < 2; ++t)
        for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(normals.at(t, k), (Vec3{0, 0, 1}));
}

TEST(Normals, DoNotDependOnHowFlatPartsAreCut) {
    // A corner of the box has one, two or more triangles on a face.
    const Mesh box = zoo::box({0, 0, 0}, {1, 1, 1});
    const CornerValues<Vec3> smooth = mesh::vertex_normals(box.vertices, box.triangles),
                             sharp = mesh::vertex_normals(box.vertices, box.triangles, 45);
    for (std::size_t t = 0; t < box.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 p = box.vertices[box.triangles[t][k]] - Vec3{0.5, 0.5, 0.5};
            EXPECT_NEAR(norm(smooth.at(t, k) - (1 / norm(p)) * p), 0, 1e-15);
            const auto& [a, b, c] = box.triangles[t];
            const Vec3 face = cross(box.vertices[b] - box.vertices[a], box.vertices[c] - box.vertices[a]);
            EXPECT_NEAR(norm(sharp.at(t, k) - face), 0, 1e-15);
        }
}

TEST(Normals, ALargeFanTakesNoTimeInProportionToItsSquare) {
    constexpr std::uint32_t spokes = 300'000;  // 10¹¹ pairs would not end
    Mesh fan;
    fan.vertices.push_back({0, 0, 1});
    for (std::uint32_t i = 0; i < spokes; ++i) {
        const double a = 2 * 3.141592653589793 * i / spokes;
        fan.vertices.push_back({std::cos(a), std::sin(a), 0});
        fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % spokes});
    }
    const auto normals = mesh::vertex_normals(fan.vertices, fan.triangles, 45);
    EXPECT_NEAR(normals.at(7, 0).z, 1, 1e-9);
}

}  // namespace
}  // namespace its
