#include <gtest/gtest.h>

#include <fmt/format.h>
#include <cmath>
#include <limits>

#include "base/rounding.h"
#include "geometry/vec3.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "query/access.h"
#include "query/decide.h"
#include "query/oracle.h"
#include "shell/shell_data.h"
#include "support/tries.h"
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
    const std::vector<Vec3> points =
        test::hard_points(query.shell(), mesh, test::tries(count), std::uint64_t(depth) + 7);
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

TEST(ClosestSides, AgreeWithTheExactSideOnEmbeddedMeshes) {
    for (const Mesh& mesh :
         {zoo::torus(1.0, 0.35, 24, 12), zoo::box({0, 0, 0}, {1, 2, 3}), zoo::plate(0.05),
          zoo::sphere({0, 0, 0}, 1, 3), zoo::reversed(zoo::tetrahedron()), zoo::twisted_knot(60, 12)}) {
        for (const int depth : {3, 6}) {
            const Query query(build_shell(mesh, depth));
            const ClosestSides closest(query.shell().mesh_view());
            std::vector<Vec3> points = test::hard_points(query.shell(), mesh, 100, 3);
            std::vector<std::int8_t> codes(points.size());
            query.classify_shell(points, codes, closest);
            int on_shell = 0;
            for (std::size_t i = 0; i < points.size(); ++i) {
                const Side side = query.classify_shell(points[i], closest), exact = query.classify(points[i]);
                EXPECT_EQ(std::int8_t(side), codes[i]);
                on_shell += query.classify_shell(points[i]) == ShellSide::on_shell ? 1 : 0;
                // Up to rounding: whose distance is some roundings may count as on either side of M, or on it.
                const double rounding = 64 * unit_roundoff * query.shell().info().scale;
                if (side == exact) continue;
                EXPECT_LE(ClosestPoints(mesh).find(points[i]).distance, rounding);
            }
            EXPECT_GT(on_shell, 100);
        }
    }
}

TEST(ClosestSides, NeedAClosedMesh) {
    const Mesh open{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
    EXPECT_THROW(ClosestSides{open}, InputError);
    EXPECT_THROW(ClosestSides{Mesh{}}, InputError);
    EXPECT_THROW(ClosestSides(zoo::tetrahedron(), {.threads = -1}), OptionError);
    const ClosestSides closest(zoo::tetrahedron());
    EXPECT_THROW(closest.side({NAN, 0, 0}), InputError);
}

TEST(Classify, UnsignedShellsTellOnSurfaceFromOff) {
    for (const zoo::Entry& entry : zoo::all()) {
        const int count = int(std::clamp<std::size_t>(100'000 / (entry.mesh.triangles.size() + 100), 8, 100));
        for (const int depth : {0, 3, 5})
            expect_exact(entry.name, entry.mesh, depth, SignRule::unsigned_rule, count);
    }
}

TEST(Classify, ShellsOfTheIterativeSolverAreExactToo) {
    const Mesh mesh = zoo::torus(1.0, 0.35, 16, 8);
    BuildOptions options;
    options.depth = 3;
    options.solver = Solver::lscg;
    const Query query(build(mesh, options));
    for (const Vec3& p : test::hard_points(query.shell(), mesh, 100, 5))
        ASSERT_EQ(query.classify(p), test::brute_force_side(mesh, p, SignRule::winding));
}

/// Ways to decide, and that all of them are taken.
TEST(Classify, BoundsSettleMostPointsAndWalksSomeOfTheRest) {
    const Mesh mesh = zoo::overlapping_spheres(3);  // where they overlap, f < 0 on M
    const Query query(build_shell(mesh, 5));
    const query::QueryIndex& index = query::Access::index(query);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    const Box box = octree::bounds(mesh);
    int seen[3] = {};
    for (int i = 0; i < 200'000; ++i) {
        const Vec3 size = box.max - box.min;
        const Vec3 p = box.min + Vec3{unit(random) * size.x, unit(random) * size.y, unit(random) * size.z};
        const Vec3 u = index.to_lattice(p);
        const octree::Cell finest = query::finest_cell(u);
        const query::Place at = query::descend(index.levels.data(), 0, 5, finest);
        if (!at.marked) continue;
        const query::SurfacePoint point = query::surface_point(at, finest, u);
        const query::Decision how = query::how_decided(index, point);
        ++seen[int(how)];
        if (how == query::Decision::walk) {
            ASSERT_EQ(query.classify(p), test::brute_force_side(mesh, p, SignRule::winding));
        }
    }
    EXPECT_GT(seen[int(query::Decision::bounds)], 3 * seen[int(query::Decision::local)]);
    EXPECT_GT(seen[int(query::Decision::walk)], 0);
    EXPECT_GT(seen[int(query::Decision::local)], 0);
}

}  // namespace
}  // namespace its
