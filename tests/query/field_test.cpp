// f, gradient and distance bounds against the shell's own evaluation and the mesh; batches against single
// calls.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "geometry/vec3.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "query/access.h"
#include "query/index.h"
#include "query/oracle.h"
#include "shell/access.h"
#include "shell/shell_data.h"
#include "support/zoo.h"

namespace its {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

ThinShell build_shell(const Mesh& mesh, int depth, Solver solver = Solver::direct) {
    BuildOptions options;
    options.depth = depth;
    options.solver = solver;
    return build(mesh, options);
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

/// Depths at which the grid is at level 1, and higher.
TEST(QueryField, ValueAndGradientAreTheShells) {
    for (const zoo::Entry& entry : zoo::all()) {
        for (const int depth : {0, 1, 4, 6, 8}) {
            SCOPED_TRACE(entry.name + ", depth " + std::to_string(depth));
            const ThinShell shell = build_shell(entry.mesh, depth);
            const Query query(shell);
            const double scale = shell.info().scale;
            int in_surface_cells = 0;
            for (const Vec3& p : test::hard_points(shell, entry.mesh, 40, 3)) {
                const double f = shell.value(p), g = query.value(p);
                ASSERT_NEAR(f, g, 256 * unit_roundoff * (scale + std::abs(f)));
                const Vec3 df = shell.gradient(p), dg = query.gradient(p);
                ASSERT_LE(norm(df - dg), 1e-9);
                const query::QueryIndex& index = query::Access::index(query);
                const Vec3 u = index.to_lattice(p);
                if (!index.in_root(u)) continue;
                const query::Place at = query::descend(
                    index.levels.data(), 0, shell::Access::data(shell).octree.depth, query::finest_cell(u));
                if (!at.marked) continue;
                ++in_surface_cells;
                ASSERT_EQ(f, g) << "in a cell that meets M";
            }
            EXPECT_GT(in_surface_cells, 100);
        }
    }
}

TEST(QueryField, ManyRandomPointsHaveTheShellsValue) {
    const ThinShell shell = build_shell(zoo::twisted_knot(160, 18), 8);
    const Query query(shell);
    ASSERT_GT(query::Access::index(query).level, 2) << "there should be several levels below the grid";
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(-0.1, 1.1);
    const Box root = shell.info().root;
    const double side = root.max.x - root.min.x;
    for (int i = 0; i < 100'000; ++i) {
        const Vec3 p = root.min + side * Vec3{unit(random), unit(random), unit(random)};
        ASSERT_NEAR(shell.value(p), query.value(p), 256 * unit_roundoff * side)
            << p.x << ' ' << p.y << ' ' << p.z;
    }
}

TEST(QueryField, ShellModeIsByEpsilon) {
    const Mesh mesh = zoo::torus(1.0, 0.35, 48, 20);
    const Query query(build_shell(mesh, 5));
    const ShellInfo& info = query.shell().info();
    int seen[3] = {};
    for (const Vec3& p : test::hard_points(query.shell(), mesh, 300, 4)) {
        const double f = query.shell().value(p);
        if (std::abs(f - info.epsilon_inner) < 1e-12 || std::abs(f - info.epsilon_outer) < 1e-12) continue;
        const ShellSide side = query.classify_shell(p);
        ++seen[int(side) + 1];
        ASSERT_EQ(side, f < info.epsilon_inner   ? ShellSide::inside
                        : f > info.epsilon_outer ? ShellSide::outside
                                                 : ShellSide::on_shell);
    }
    for (const int count : seen) EXPECT_GT(count, 100);
    for (const Vec3& v : mesh.vertices) EXPECT_EQ(query.classify_shell(v), ShellSide::on_shell);
}

TEST(QueryField, DistanceBoundsHoldTheDistance) {
    for (const zoo::Entry& entry : zoo::all()) {
        const ClosestPoints closest(entry.mesh);
        for (const int depth : {0, 3, 6}) {
            SCOPED_TRACE(entry.name + ", depth " + std::to_string(depth));
            const ThinShell shell = build_shell(entry.mesh, depth);
            const Query query(shell);
            double widest = 0;
            for (const Vec3& p : test::hard_points(shell, entry.mesh, 40, 11)) {
                const Interval bound = query.signed_distance_bound(p);
                const double distance = closest.find(p).distance;
                const double rounding = 16 * unit_roundoff * (norm(p) + shell.info().scale);
                const double sign = query.classify(p) == Side::inside ? -1 : 1;
                ASSERT_LE(bound.lower, sign * distance + rounding);
                ASSERT_GE(bound.upper, sign * distance - rounding);
                ASSERT_LE(bound.lower, bound.upper);
                if (distance < shell.info().cell_width) widest = std::max(widest, bound.upper - bound.lower);
            }
            EXPECT_LE(widest, 8 * std::sqrt(3.0) * shell.info().cell_width) << "near M cells are small";
        }
    }
}

TEST(QueryField, DistanceBoundsNeedTheDirectSolver) {
    const Query query(build_shell(zoo::tetrahedron(), 2, Solver::lscg));
    EXPECT_THROW(static_cast<void>(query.signed_distance_bound({0, 0, 0})), OptionError);
    std::vector<Vec3> points(1);
    std::vector<Interval> out(1);
    EXPECT_THROW(query.signed_distance_bound(points, out), OptionError);
    // Nor a rule under which values beside a filled hole are no distances.
    Mesh open = zoo::box({0, 0, 0}, {1, 1, 1});
    open.triangles.pop_back();
    const Query filled(build(open, {.depth = 3}));
    ASSERT_EQ(filled.shell().info().sign, SignRule::generalized);
    EXPECT_THROW(static_cast<void>(filled.signed_distance_bound({0, 0, 0})), OptionError);
}

TEST(QueryBatch, EqualsSingleCallsBitByBitForAnyThreads) {
    const Mesh mesh = zoo::twisted_knot(160, 18);
    for (const int depth : {3, 6, 8}) {
        const Query query(build_shell(mesh, depth));
        std::vector<Vec3> points = test::hard_points(query.shell(), mesh, 1500, 21);
        const double nan = std::numeric_limits<double>::quiet_NaN();
        for (const double bad : {nan, infinity, -infinity})
            for (int axis = 0; axis < 3; ++axis) {
                Vec3& p = points[points.size() / 2 + std::size_t(17 * axis + (bad > 0 ? 1 : 2))];
                p[axis] = bad;
            }
        points[5] = {1e300, -1e300, 1e308};
        ASSERT_GT(points.size(), 2u * 16384) << "several tasks";
        const std::size_t n = points.size();
        std::vector<std::int8_t> side(n), shell_side(n);
        std::vector<double> value(n);
        std::vector<Vec3> gradient(n);
        std::vector<Interval> bound(n);
        for (std::size_t i = 0; i < n; ++i) {
            const Vec3& p = points[i];
            value[i] = query.value(p);
            gradient[i] = query.gradient(p);
            side[i] = finite(p) ? std::int8_t(query.classify(p)) : not_finite;
            shell_side[i] = finite(p) ? std::int8_t(query.classify_shell(p)) : not_finite;
            bound[i] = finite(p) ? query.signed_distance_bound(p) : Interval{nan, nan};
        }
        for (const int threads : {1, 2, 0}) {
            its::Run options;
            options.threads = threads;
            std::vector<std::int8_t> sides(n), shell_sides(n);
            std::vector<double> values(n);
            std::vector<Vec3> gradients(n);
            std::vector<Interval> bounds(n);
            query.classify(points, sides, options);
            query.classify_shell(points, shell_sides, options);
            query.value(points, values, options);
            query.gradient(points, gradients, options);
            query.signed_distance_bound(points, bounds, options);
            EXPECT_EQ(sides, side);
            EXPECT_EQ(shell_sides, shell_side);
            EXPECT_TRUE(same_bits(gradients, gradient));
            EXPECT_TRUE(same_bits(bounds, bound));
            for (std::size_t i = 0; i < n; ++i)
                ASSERT_TRUE(values[i] == value[i] || (std::isnan(values[i]) && std::isnan(value[i]))) << i;
        }
    }
}

TEST(QueryBatch, RefusesWhatMakesNoSense) {
    const Query query(build_shell(zoo::tetrahedron(), 3));
    const std::vector<Vec3> points(10);
    std::vector<std::int8_t> codes(9);
    EXPECT_THROW(query.classify(points, codes), OptionError);
    EXPECT_THROW(query.classify_shell(points, codes), OptionError);
    std::vector<double> values(11);
    EXPECT_THROW(query.value(points, values), OptionError);
    codes.resize(10);
    its::Run options;
    options.threads = -1;
    EXPECT_THROW(query.classify(points, codes, options), OptionError);
    EXPECT_NO_THROW(query.classify({}, {}));
}

TEST(QueryBatch, ReportsProgressAndStops) {
    const Query query(build_shell(zoo::tetrahedron(), 3));
    const std::vector<Vec3> points(200'000);
    std::vector<std::int8_t> codes(points.size());
    double last = 0;
    its::Run options;
    options.progress = [&](std::string_view stage, double fraction) {
        EXPECT_EQ(stage, "query");
        last = std::max(last, fraction);
        return true;
    };
    query.classify(points, codes, options);
    EXPECT_EQ(last, 1.0);
    options.progress = [](std::string_view, double fraction) { return fraction < 0.3; };
    EXPECT_THROW(query.classify(points, codes, options), Cancelled);
    std::vector<double> values(points.size());
    EXPECT_THROW(query.value(points, values, options), Cancelled);
}

TEST(Query, SingleCallsRefusePointsThatAreNotFinite) {
    const Query query(build_shell(zoo::tetrahedron(), 3));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double bad : {nan, infinity, -infinity})
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 p{0, 0, 0};
            p[axis] = bad;
            EXPECT_THROW(static_cast<void>(query.classify(p)), InputError);
            EXPECT_THROW(static_cast<void>(query.classify_shell(p)), InputError);
            EXPECT_THROW(static_cast<void>(query.signed_distance_bound(p)), InputError);
            EXPECT_TRUE(std::isnan(query.value(p)));
            EXPECT_TRUE(std::isnan(query.gradient(p).x));
        }
    EXPECT_EQ(query.classify({1e308, -1e308, 1e308}), Side::outside);
}

}  // namespace
}  // namespace its
