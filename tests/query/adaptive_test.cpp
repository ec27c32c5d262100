#include <gtest/gtest.h>

#include <fmt/format.h>
#include <cmath>

#include "its/inspect.h"
#include "its/query.h"
#include "its/shell.h"
#include "query/oracle.h"
#include "support/tries.h"
#include "support/zoo.h"

// Shells built to a thickness: the same promises as of those with cells of one size.

namespace its {
namespace {

double longest_side(const Mesh& mesh) {
    Vec3 low = mesh.vertices[mesh.triangles[0][0]], high = low;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = std::min(low[axis], mesh.vertices[v][axis]);
                high[axis] = std::max(high[axis], mesh.vertices[v][axis]);
            }
    return std::max({high.x - low.x, high.y - low.y, high.z - low.z, 1e-300});
}

ThinShell build_to(const Mesh& mesh, double relative, std::optional<SignRule> sign = {}) {
    BuildOptions options;
    options.thickness = relative * longest_side(mesh);
    options.sign = sign;
    return build(mesh, options);
}

void expect_exact(const std::string& name, const Mesh& mesh, double thickness, SignRule rule, int count) {
    SCOPED_TRACE(fmt::format("{}, thickness {}", name, thickness));
    const Query query(build_to(mesh, thickness, rule));
    const ShellInfo& info = query.shell().info();
    EXPECT_TRUE(info.adaptive);
    EXPECT_EQ(info.coarse_cells, 0u);
    EXPECT_LE(info.thickness(), info.thickness_asked);
    const std::vector<Vec3> points = test::hard_points(query.shell(), mesh, test::tries(count), 11);
    std::vector<std::int8_t> batch(points.size());
    query.classify(points, batch);
    int wrong = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3& p = points[i];
        const Side expected = test::brute_force_side(mesh, p, rule), side = query.classify(p);
        EXPECT_EQ(std::int8_t(side), batch[i]);
        if (side == expected) continue;
        if (++wrong <= 3)
            ADD_FAILURE() << fmt::format("({:a}, {:a}, {:a}) is {} and not {}", p.x, p.y, p.z, int(expected),
                                         int(side));
    }
    EXPECT_EQ(wrong, 0) << "of " << points.size();
}

TEST(AdaptiveClassify, AgreesWithAllTrianglesOnClosedMeshes) {
    for (const test::NamedMesh& entry : test::closed_meshes()) {
        const int count = int(std::clamp<std::size_t>(200'000 / (entry.mesh.triangles.size() + 100), 8, 200));
        for (const double thickness : {0.2, 0.01}) {
            expect_exact(entry.name, entry.mesh, thickness, SignRule::winding, count);
            expect_exact(entry.name, entry.mesh, thickness, SignRule::even_odd, count / 2);
        }
    }
}

/// Points of triangles, evenly enough.
std::vector<Vec3> points_of(const Mesh& mesh, int per_triangle) {
    std::vector<Vec3> points;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        for (int i = 0; i <= per_triangle; ++i)
            for (int j = 0; i + j <= per_triangle; ++j) {
                const double u = double(i) / per_triangle, v = double(j) / per_triangle, w = 1 - u - v;
                points.push_back(
                    {w * a.x + u * b.x + v * c.x, w * a.y + u * b.y + v * c.y, w * a.z + u * b.z + v * c.z});
            }
    }
    return points;
}

TEST(AdaptiveField, TheMeshIsInTheShellAndTheShellIsAsThinAsAskedFor) {
    for (const zoo::Entry& entry : zoo::all())
        for (const double thickness : {0.3, 0.01}) {
            SCOPED_TRACE(fmt::format("{}, thickness {}", entry.name, thickness));
            const std::optional<SignRule> sign =
                entry.closed_oriented ? SignRule::winding : SignRule::unsigned_rule;
            const ThinShell shell = build_to(entry.mesh, thickness, sign);
            const ShellInfo& info = shell.info();
            EXPECT_EQ(info.coarse_cells, 0u);
            EXPECT_LE(info.thickness(), info.thickness_asked);
            EXPECT_LE(info.epsilon_inner, 0);
            EXPECT_GE(info.epsilon_outer, 0);
            const Query query(shell);
            const std::vector<Vec3> points = points_of(entry.mesh, entry.mesh.triangles.size() > 2000 ? 3 : 9);
            std::vector<double> f(points.size());
            query.value(points, f);
            for (std::size_t i = 0; i < points.size(); ++i) {
                EXPECT_GE(f[i], info.epsilon_inner);
                EXPECT_LE(f[i], info.epsilon_outer);
                const double g = shell.value(points[i]);
                EXPECT_GE(g, info.epsilon_inner);
                EXPECT_LE(g, info.epsilon_outer);
                EXPECT_NEAR(f[i], g, 1e-12 * info.scale);
            }
        }
}

TEST(AdaptiveField, DistanceBoundsHold) {
    const Mesh mesh = zoo::twisted_knot(40, 12);
    const Query query(build_to(mesh, 0.01, SignRule::winding));
    const ClosestPoints closest(mesh);
    for (const Vec3& p : test::hard_points(query.shell(), mesh, 200, 3)) {
        const Interval bound = query.signed_distance_bound(p);
        const double d = closest.find(p).distance, signed_d = query.classify(p) == Side::inside ? -d : d;
        EXPECT_LE(bound.lower, signed_d + 1e-12);
        EXPECT_GE(bound.upper, signed_d - 1e-12);
    }
}

}  // namespace
}  // namespace its
