#include "page/cluster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/vec3.h"
#include "mesh/normals.h"
#include "support/zoo.h"

namespace its {
namespace {

constexpr double pi = 3.141592653589793;

TEST(Cluster, KeepsTheShapeAndTheLimit) {
    const Mesh ball = zoo::sphere({1, 2, 3}, 2, 6);
    for (const std::uint64_t most : {std::uint64_t{20000}, std::uint64_t{2000}, std::uint64_t{100}}) {
        const Mesh coarse = page::cluster(ball, most);
        EXPECT_LE(coarse.triangles.size(), most);
        EXPECT_GE(coarse.triangles.size(), most / 20);  // a grid of half the cells has about a quarter
        for (const Triangle& t : coarse.triangles)
            for (const std::uint32_t v : t) {
                ASSERT_LT(v, coarse.vertices.size());
                EXPECT_LE(norm(coarse.vertices[v] - Vec3{1, 2, 3}), 2 + 1e-12);  // means are within
            }
        double area = 0;
        for (const Triangle& t : coarse.triangles) area += 0.5 * norm(mesh::area_vector(coarse.vertices, t));
        if (most >= 2000) {
            EXPECT_NEAR(area, 16 * pi, 2.5);
        }
    }
    EXPECT_EQ(page::cluster(ball, 1'000'000).triangles, ball.triangles);
}

}  // namespace
}  // namespace its
