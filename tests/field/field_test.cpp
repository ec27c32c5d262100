#include "field/field.h"

#include <gtest/gtest.h>
#include <cmath>
#include <map>
#include <random>

#include "field/lscg.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "its/shell.h"
#include "shell/access.h"
#include "shell/shell_data.h"
#include "support/zoo.h"

namespace its {
namespace {

ThinShell build_at(const Mesh& mesh, int depth, Solver solver = Solver::direct) {
    BuildOptions options;
    options.depth = depth;
    options.solver = solver;
    return build(mesh, options);
}

double evaluate(const shell::ShellData& shell, const Vec3& u) {
    const field::TrilinearCell cell = field::locate(shell.octree, shell.field, u);
    return geometry::trilinear(cell.value, (1.0 / cell.width) * (u - cell.corner));
}

struct GridPoint {
    Vec3 at;
    int level;
    double coefficient;
};

/// Every grid point of every level once, with its coefficient.
std::vector<GridPoint> grid_points(const shell::ShellData& shell) {
    std::vector<GridPoint> result;
    for (int k = 0; k <= shell.octree.depth; ++k) {
        const double step = std::ldexp(1.0, k);
        std::map<std::array<double, 3>, double> known;
        for (std::uint64_t group = 0; group < shell.octree.levels[k].groups(); ++group) {
            const octree::Cell at = octree::morton_decode(shell.octree.levels[k].parent[group]);
            for (int child = 0; child < 8; ++child)
                for (int corner = 0; corner < 8; ++corner) {
                    const int p = octree::group_point(child, corner);
                    const std::array position = {step * (2.0 * at[0] + p % 3), step * (2.0 * at[1] + p / 3 % 3),
                                                 step * (2.0 * at[2] + p / 9)};
                    const double c = field::coefficient(shell.octree, shell.field, k, group, child, corner);
                    const auto [it, is_new] = known.emplace(position, c);
                    if (is_new)
                        result.push_back({{position[0], position[1], position[2]}, k, c});
                    else
                        EXPECT_NEAR(it->second, c, 1e-12) << "one coefficient for all cells that share a point";
                }
        }
    }
    return result;
}

/// The definition: Σ λ_g B((u − g)/w_k) over all grid points of all levels.
double sum_of_hats(const std::vector<GridPoint>& points, const Vec3& u) {
    double sum = 0;
    for (const GridPoint& g : points) {
        const double w = std::ldexp(1.0, g.level);
        double product = g.coefficient;
        for (int axis = 0; axis < 3; ++axis) product *= std::max(0.0, 1 - std::abs(u[axis] - g.at[axis]) / w);
        sum += product;
    }
    return sum;
}

class FieldOfTheZoo : public testing::TestWithParam<Solver> {};

TEST_P(FieldOfTheZoo, EvaluationIsTheSumOfAllHats) {
    std::mt19937_64 random(1);
    for (const auto& entry : zoo::all()) {
        if (GetParam() == Solver::lscg && entry.mesh.triangles.size() > 1000) continue;
        const ThinShell shell = build_at(entry.mesh, 4, GetParam());
        const auto points = grid_points(shell::Access::data(shell));
        const double cells = shell::Access::data(shell).lattice.cells();
        std::uniform_real_distribution<double> anywhere(0, cells);
        for (int i = 0; i < 300; ++i) {
            Vec3 u{anywhere(random), anywhere(random), anywhere(random)};
            if (i % 3 == 1) u = {std::round(u.x), std::round(u.y), u.z};  // on lattice lines
            if (i % 3 == 2) u = {0.5 * std::round(2 * u.x), u.y, u.z};
            ASSERT_NEAR(evaluate(shell::Access::data(shell), u), sum_of_hats(points, u), 1e-10) << entry.name;
        }
    }
}

TEST_P(FieldOfTheZoo, EveryEquationHolds) {
    for (const auto& entry : zoo::all()) {
        if (GetParam() == Solver::lscg && entry.mesh.triangles.size() > 1000) continue;
        const ThinShell direct = build_at(entry.mesh, 4);
        const ThinShell shell = build_at(entry.mesh, 4, GetParam());
        const double tolerance = 1e-9 * std::ldexp(1.0, 4);  // of s, in cell widths
        for (int k = 0; k <= 4; ++k) {
            const double step = std::ldexp(1.0, k);
            const octree::Level& level = shell::Access::data(shell).octree.levels[k];
            for (std::uint64_t group = 0; group < level.groups(); ++group) {
                const octree::Cell at = octree::morton_decode(level.parent[group]);
                for (int p = 0; p < octree::group_points; ++p) {
                    const Vec3 u{step * (2.0 * at[0] + p % 3), step * (2.0 * at[1] + p / 3 % 3),
                                 step * (2.0 * at[2] + p / 9)};
                    const double d =
                        shell::Access::data(direct).field.values[k][octree::group_points * group + p];  // D(g)
                    ASSERT_NEAR(evaluate(shell::Access::data(shell), u), d, tolerance)
                        << entry.name << " level " << k;
                }
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Solvers, FieldOfTheZoo, testing::Values(Solver::direct, Solver::lscg),
                         [](const auto& solver) { return solver.param == Solver::direct ? "direct" : "lscg"; });

TEST(Field, BothSolversAgreeInTheFinestCells) {
    for (const auto& entry : zoo::all()) {
        if (entry.mesh.triangles.size() > 1000) continue;
        const ThinShell direct = build_at(entry.mesh, 4), lscg = build_at(entry.mesh, 4, Solver::lscg);
        const auto &a = shell::Access::data(direct).field.values[0],
                   &b = shell::Access::data(lscg).field.values[0];
        ASSERT_EQ(a.size(), b.size());
        for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-8) << entry.name;
    }
}

TEST(Field, IsContinuousEverywhere) {
    std::mt19937_64 random(2);
    for (const auto& entry : zoo::all()) {
        const ThinShell shell = build_at(entry.mesh, 5);
        const double s = shell.info().scale;
        const Box root = shell.info().root;
        std::uniform_real_distribution<double> anywhere(-0.2, 1.2);
        for (int i = 0; i < 2000; ++i) {
            Vec3 p = root.min + 2 * s * Vec3{anywhere(random), anywhere(random), anywhere(random)};
            const int axis = int(random() % 3);  // across a lattice plane
            const auto plane = std::int64_t(std::round(shell::Access::data(shell).lattice.to_lattice(p)[axis]));
            p[axis] = shell::Access::data(shell).lattice.position(axis, plane);
            Vec3 before = p, after = p;
            before[axis] -= 1e-9 * s;
            after[axis] += 1e-9 * s;
            // Slopes: at most √3 for distances, a few where hats of several levels meet.
            ASSERT_NEAR(shell.value(before), shell.value(after), 2e-8 * s) << entry.name;
        }
    }
}

TEST(Field, GradientIsTheSlopeWithinACell) {
    std::mt19937_64 random(3);
    const ThinShell shell = build_at(zoo::torus(1, 0.4, 24, 12), 5);
    std::uniform_real_distribution<double> anywhere(-0.1, 1.1);
    int compared = 0;
    for (int i = 0; i < 3000; ++i) {
        const Vec3 p = shell.info().root.min +
                       2 * shell.info().scale * Vec3{anywhere(random), anywhere(random), anywhere(random)};
        const Vec3 g = shell.gradient(p);
        for (int axis = 0; axis < 3; ++axis) {
            const double h = 1e-6 * shell.info().cell_width;
            Vec3 a = p, b = p;
            a[axis] -= h;
            b[axis] += h;
            if (shell.gradient(a) == g || norm(shell.gradient(a) - shell.gradient(b)) < 1e-4) {
                EXPECT_NEAR((shell.value(b) - shell.value(a)) / (b[axis] - a[axis]), g[axis], 1e-4);
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 8000);
}

TEST(Field, OutsideTheRootItGrowsWithTheDistance) {
    const ThinShell shell = build_at(zoo::sphere({0, 0, 0}, 1, 2), 4);
    const Vec3 face{shell.info().root.max.x, 0.1, 0.2};
    EXPECT_NEAR(shell.value(face + Vec3{5, 0, 0}), shell.value(face) + 5, 1e-12);
    EXPECT_NEAR(shell.gradient(face + Vec3{5, 0, 0}).x, 1, 1e-12);
    EXPECT_TRUE(std::isnan(shell.value({std::nan(""), 0, 0})));
    EXPECT_TRUE(std::isnan(shell.gradient({0, INFINITY, 0}).x));
}

}  // namespace
}  // namespace its
