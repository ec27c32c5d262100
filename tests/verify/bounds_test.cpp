#include <gtest/gtest.h>
#include <cmath>
#include <random>

#include "geometry/vec3.h"
#include "shell/access.h"
#include "shell/shell_data.h"
#include "support/zoo.h"
#include "verify/proof.h"
#include "verify/view.h"

namespace its::verifier {
namespace {

class Random {
public:
    double unit() { return double(engine_() >> 11) * 0x1p-53; }
    double between(double a, double b) { return a + (b - a) * unit(); }

private:
    std::mt19937_64 engine_{20240};
};

/// A random triangle, cut to the unit cell; empty polygons are drawn again.
Polygon random_polygon(Random& random) {
    for (;;) {
        Polygon p, a, b, c;
        p.count = 3;
        for (int i = 0; i < 3; ++i)
            p.vertex[i] = {random.between(-1, 2), random.between(-1, 2), random.between(-1, 2)};
        if (clip_slab(p, 0, 0, 1, a) && clip_slab(a, 1, 0, 1, b) && clip_slab(b, 2, 0, 1, c)) return c;
    }
}

Vec3 random_mean(const Polygon& p, Random& random) {
    Vec3 sum;
    double total = 0;
    for (int i = 0; i < p.count; ++i) {
        const double weight = -std::log(1 - random.unit());
        total += weight;
        sum = sum + weight * p.vertex[i];
    }
    return (1 / total) * sum;
}

TEST(Bounds, EncloseSamplesAndShrinkQuadratically) {
    Random random;
    for (int round = 0; round < 2000; ++round) {
        double v[8];
        for (double& value : v) value = random.between(-1, 1);
        const Polygon polygon = random_polygon(random);
        const Expansion expansion(v, polygon);
        Bounds bounds = expansion.cheap();
        const Bounds cheap = bounds;
        expansion.sharpen(bounds);
        EXPECT_LE(cheap.low, bounds.low);
        EXPECT_GE(cheap.high, bounds.high);
        const double error = evaluation_error(v);
        for (int i = 0; i < 50; ++i) {
            const Vec3 p = random_mean(polygon, random);
            const double f = double(trilinear(v, {p.x, p.y, p.z}));
            EXPECT_LE(bounds.low - error, f);
            EXPECT_GE(bounds.high + error, f);
        }
        EXPECT_LE(bounds.low, bounds.attained_low + error);
        EXPECT_GE(bounds.high, bounds.attained_high - error);
    }
}

TEST(Bounds, ExactWhereTheFunctionDoesNotChange) {
    // f = xy over the triangle x, y ≥ 0, x + y ≤ 1: least on two whole edges.
    const double v[8] = {0, 0, 0, 1, 0, 0, 0, 1};
    Polygon p;
    p.count = 3;
    p.vertex[0] = {0, 0, 0.5}, p.vertex[1] = {1, 0, 0.5}, p.vertex[2] = {0, 1, 0.5};
    const Expansion expansion(v, p);
    Bounds bounds = expansion.cheap();
    EXPECT_LT(bounds.low, -0.1);
    expansion.sharpen(bounds);
    EXPECT_NEAR(bounds.low, 0, 1e-15);
    EXPECT_NEAR(bounds.attained_low, 0, 1e-15);
}

TEST(Bounds, EvaluationErrorHolds) {
    Random random;
    for (int round = 0; round < 20'000; ++round) {
        double v[8];
        for (double& value : v) value = random.between(-1, 1) * std::exp2(random.between(-4, 4));
        const Vec3 c = {random.unit(), random.unit(), random.unit()},
                   p = {random.unit(), random.unit(), random.unit()};
        const Taylor taylor = expand(v, c);
        const DoubleDouble exact = trilinear(v, {p.x, p.y, p.z});
        EXPECT_LE(std::abs(double(DoubleDouble(taylor.at(p - c)) - exact)), evaluation_error(v));
    }
}

TEST(Bounds, ProofFindsTheMaximum) {
    Random random;
    const Lattice lattice(octree::Lattice{.depth = 4, .width = 1, .base = {}});
    for (int round = 0; round < 300; ++round) {
        double v[8];
        for (double& value : v) value = random.between(-1, 1);
        const Polygon polygon = random_polygon(random);
        double highest = -infinity;
        for (int i = 0; i < 2000; ++i) {
            const Vec3 p = random_mean(polygon, random);
            highest = std::max(highest, double(trilinear(v, {p.x, p.y, p.z})));
        }
        const auto run = [&](double outer) {
            Goal goal;
            goal.inner = goal.proven_inner = goal.strict_inner = -10;
            goal.outer = goal.proven_outer = goal.strict_outer = outer;
            ProofTally tally;
            bound_polygon(lattice, goal, {3, 4, 5}, 1, v, -infinity, infinity, polygon, tally);
            return tally;
        };
        EXPECT_GT(run(highest - 1e-3).violations, 0u);  // a witness is found
        const ProofTally some = run(highest);           // all but proves the maximum
        EXPECT_GE(some.high + 1e-12, highest);
        const ProofTally above = run(some.high + 1e-6);
        EXPECT_EQ(above.violations, 0u);
        EXPECT_EQ(above.undecided, 0u);
    }
}

TEST(Clip, KeepsTheRightSide) {
    Random random;
    for (int round = 0; round < 2000; ++round) {
        const Polygon polygon = random_polygon(random);
        const double plane = random.unit();
        Polygon below, above;
        const auto height = [&](const Vec3& p) { return p.y - plane; };
        const bool some = clip(polygon, height, above);
        const bool rest = clip(
            polygon, [&](const Vec3& p) { return -height(p); }, below);
        EXPECT_TRUE(some || rest);
        for (int i = 0; i < above.count; ++i) EXPECT_GE(above.vertex[i].y, plane - 1e-15);
        for (int i = 0; i < below.count; ++i) EXPECT_LE(below.vertex[i].y, plane + 1e-15);
        EXPECT_LE(above.count, polygon.count + 1);
    }
}

/// f by the definition: hats of all levels with coefficients λ_g = D(g) − (sum of the coarser levels at g).
class HatSum {
public:
    explicit HatSum(const shell::ShellData& data) {
        for (int k = data.octree.depth; k >= 0; --k) {
            const std::size_t before = hats_.size();
            std::vector<Hat> fresh;
            for (std::uint64_t g = 0; g < data.octree.levels[k].groups(); ++g) {
                const octree::Cell parent = octree::morton_decode(data.octree.levels[k].parent[g]);
                for (int i = 0; i < octree::group_points; ++i) {
                    const double size = std::ldexp(1.0, k);
                    const Vec3 at = {(2.0 * parent[0] + i % 3) * size, (2.0 * parent[1] + i / 3 % 3) * size,
                                     (2.0 * parent[2] + i / 9) * size};
                    bool known = false;
                    for (const Hat& hat : fresh) known = known || hat.at == at;
                    if (known) continue;
                    const double d = data.field.values[k][octree::group_points * g + std::uint64_t(i)];
                    fresh.push_back({at, size, d - value(at, before)});
                }
            }
            hats_.insert(hats_.end(), fresh.begin(), fresh.end());
        }
    }

    double value(const Vec3& p) const { return value(p, hats_.size()); }

private:
    struct Hat {
        Vec3 at;
        double size, coefficient;
    };

    double value(const Vec3& p, std::size_t count) const {
        double sum = 0;
        for (std::size_t h = 0; h < count; ++h) {
            double b = hats_[h].coefficient;
            for (int axis = 0; axis < 3; ++axis)
                b *= std::max(0.0, 1 - std::abs(p[axis] - hats_[h].at[axis]) / hats_[h].size);
            sum += b;
        }
        return sum;
    }

    std::vector<Hat> hats_;
};

TEST(View, ValueIsTheSumOfHats) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1, 1);
    BuildOptions options;
    options.depth = 3;
    const ThinShell shell = build(mesh, options);
    const HatSum sum(shell::Access::data(shell));
    const View view(shell::Access::data(shell));
    Random random;
    const double n = shell::Access::data(shell).lattice.cells();
    for (int i = 0; i < 300; ++i) {
        const Vec3 p = {n * random.unit(), n * random.unit(), n * random.unit()};
        EXPECT_NEAR(double(view.value({p.x, p.y, p.z})), sum.value(p), 1e-12 * n);
    }
}

}  // namespace
}  // namespace its::verifier
