#include <gtest/gtest.h>

#include <fmt/format.h>
#include <cmath>
#include <limits>

#include "geometry/vec3.h"
#include "query/decide.h"
#include "query/oracle.h"
#include "shell/shell_data.h"
#include "support/zoo.h"

namespace its {
namespace {

ThinShell build_shell(const Mesh& mesh, int depth, std::optional<SignRule> sign = {}) {
    BuildOptions options;
    options.depth = depth;
    options.sign = sign;
    return build(mesh, options);
}

/// Every point against the oracle.
void expect_exact(const std::string& name, const Mesh& mesh, int depth, SignRule rule, int count) {
    SCOPED_TRACE(name + ", depth " + std::to_string(depth));
    const Query query(build_shell(mesh, depth, rule));
    ASSERT_EQ(query.shell().info().sign, rule);
    const std::vector<Vec3> points = test::hard_points(query.shell(), mesh, count, std::uint64_t(depth) + 7);
    int wrong = 0, sides[3] = {};
    for (const Vec3& p : points) {
        const Side expected = test::brute_force_side(mesh, p, rule), side = query.classify(p);
        ++sides[int(expected) + 1];
        if (side == expected) continue;
        if (++wrong <= 3)
            ADD_FAILURE() << fmt::format("({:a}, {:a}, {:a}) is {} and not {}", p.x, p.y, p.z, int(expected),
                                         int(side));
    }
    EXPECT_EQ(wrong, 0) << "of " << points.size();
    EXPECT_GT(sides[1], 0) << "no point was on the surface";
    EXPECT_GT(sides[2], 0) << "no point was outside";
}

TEST(Classify, AgreesWithAllTrianglesOnClosedMeshes) {
    for (const test::NamedMesh& entry : test::closed_meshes()) {
        const int count = int(std::clamp<std::size_t>(400'000 / (entry.mesh.triangles.size() + 100), 8, 300));
        for (const int depth : {0, 1, 2, 3, 5})
            expect_exact(entry.name, entry.mesh, depth, SignRule::winding, count);
    }
}

TEST(Classify, DeepShellsAgreeWithAllTriangles) {
    const Mesh mesh = zoo::torus(1.0, 0.35, 24, 12);
    for (const int depth : {6, 7, 8, 9}) expect_exact("torus", mesh, depth, SignRule::winding, 60);
    expect_exact("box", zoo::box({0, 0, 0}, {1, 1, 1}), 8, SignRule::winding, 200);
}

TEST(Classify, UnsignedShellsTellOnSurfaceFromOff) {
    for (const zoo::Entry& entry : zoo::all()) {
        const int count = int(std::clamp<std::size_t>(100'000 / (entry.mesh.triangles.size() + 100), 8, 100));
        for (const int depth : {0, 3, 5})
            expect_exact(entry.name, entry.mesh, depth, SignRule::unsigned_rule, count);
    }
}

}  // namespace
}  // namespace its
