#include "field/lscg.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <random>

#include "support/edit.h"

namespace its {
namespace {

using Generator = std::mt19937_64;
using Key = std::array<std::int64_t, 4>;  // level, then the position in finest cells

/// A random octree: every cell is subdivided with the given probability, at least one cell of a level.
octree::Octree random_octree(int depth, double probability, Generator& random) {
    octree::Octree octree;
    octree.depth = depth;
    octree.levels.resize(depth + 1);
    std::vector<std::uint64_t> parents{0};
    for (int k = depth; k >= 0; --k) {
        octree::Level& level = octree.levels[k];
        std::vector<std::uint8_t> masks;
        std::vector<std::uint64_t> children;
        for (const std::uint64_t parent : parents) {
            std::uint8_t mask = 0;
            for (int child = 0; child < 8; ++child)
                if (std::bernoulli_distribution(probability)(random)) mask |= 1 << child;
            if (parent == parents.back() && children.empty() && mask == 0) mask |= 1 << random() % 8;
            for (int child = 0; child < 8; ++child)
                if (mask >> child & 1) children.push_back(parent << 3 | child);
            masks.push_back(mask);
        }
        level = {std::move(parents), std::move(masks)};
        parents = std::move(children);
    }
    return octree;
}

template <class Visit>
void for_points(const octree::Octree& octree, int k, Visit&& visit) {
    const octree::Level& level = octree.levels[k];
    for (std::uint64_t group = 0; group < level.groups(); ++group) {
        const octree::Cell parent = octree::morton_decode(level.parent[group]);
        for (std::int64_t z = 0; z < 3; ++z)
            for (std::int64_t y = 0; y < 3; ++y)
                for (std::int64_t x = 0; x < 3; ++x)
                    visit(Key{k, (2 * parent[0] + x) << k, (2 * parent[1] + y) << k, (2 * parent[2] + z) << k},
                          27 * group + x + 3 * y + 9 * z);
    }
}

/// D by position alone: two grid points at the same place have the same distance.
struct Distances {
    std::map<std::array<std::int64_t, 3>, double> at;
    field::Field field;

    Distances(const octree::Octree& octree, Generator& random) {
        std::uniform_real_distribution<double> uniform(-1, 1);
        for (int k = 0; k <= octree.depth; ++k) {
            std::vector<double> values;
            for_points(octree, k, [&](const Key& g, std::uint64_t) {
                const auto [entry, added] = at.try_emplace({g[1], g[2], g[3]}, uniform(random));
                values.push_back(entry->second);
            });
            field.values.emplace_back(std::move(values));
        }
    }
};

double hat(double t) {
    return std::max(0.0, 1 - std::abs(t));
}

/// All coefficients, and f as the sum over all hats: the definition.
struct Spline {
    std::map<Key, double> coefficient;

    double operator()(double x, double y, double z, int from_level = 0) const {
        double sum = 0;
        for (const auto& [h, c] : coefficient) {
            const double w = std::ldexp(1.0, int(h[0]));
            if (h[0] >= from_level)
                sum +=
                    c * hat((x - double(h[1])) / w) * hat((y - double(h[2])) / w) * hat((z - double(h[3])) / w);
        }
        return sum;
    }
};

/// Coefficients from cumulative values, or, if these are D, the direct solution.
Spline spline_of(const octree::Octree& octree, const field::Field& field) {
    Spline spline;
    for (int k = octree.depth; k >= 0; --k) {
        const Spline coarser = spline;
        for_points(octree, k, [&](const Key& g, std::uint64_t i) {
            if (!spline.coefficient.contains(g))
                spline.coefficient[g] = field.values[k][i] - coarser(double(g[1]), double(g[2]), double(g[3]));
        });
    }
    return spline;
}

double trilinear(const field::Field& field, std::uint64_t group, int child, double x, double y, double z) {
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner)
        sum += field.values[0][27 * group + octree::group_point(child, corner)] * (corner & 1 ? x : 1 - x) *
               (corner & 2 ? y : 1 - y) * (corner & 4 ? z : 1 - z);
    return sum;
}

class Lscg : public testing::TestWithParam<int> {};

TEST_P(Lscg, SatisfiesEveryEquation) {
    Generator random(100 + GetParam());
    const octree::Octree octree = random_octree(GetParam(), GetParam() < 3 ? 0.4 : 0.2, random);
    const Distances distances(octree, random);
    field::LscgReport report;
    const field::Field field = field::solve_lscg(octree, distances.field, 1e-10, {}, &report);
    std::printf("depth %d: %llu equations, %llu iterations, residual %.1e\n", GetParam(),
                static_cast<unsigned long long>(report.equations),
                static_cast<unsigned long long>(report.iterations), report.residual);
    EXPECT_LE(report.residual, 1e-10);

    const Spline spline = spline_of(octree, field), direct = spline_of(octree, distances.field);
    EXPECT_EQ(report.equations, spline.coefficient.size());
    ASSERT_EQ(field.values.size(), octree.levels.size());
    for (const auto& [position, d] : distances.at) {
        const auto [x, y, z] = position;
        ASSERT_NEAR(spline(double(x), double(y), double(z)), d, 1e-9);
        ASSERT_NEAR(direct(double(x), double(y), double(z)), d, 1e-12);
    }
    // The cumulative values are what they claim to be.
    for (int k = 0; k <= octree.depth; ++k)
        for_points(octree, k, [&](const Key& g, std::uint64_t i) {
            ASSERT_NEAR(field.values[k][i], spline(double(g[1]), double(g[2]), double(g[3]), k), 1e-12);
        });
    // Inside the finest cells every solution is the trilinear interpolation of D.
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < 200; ++i) {
        const std::uint64_t group = random() % octree.levels[0].groups();
        const int child = int(random() % 8);
        const octree::Cell cell =
            octree::morton_decode(octree.levels[0].parent[group] << 3 | std::uint64_t(child));
        const double x = uniform(random), y = uniform(random), z = uniform(random);
        const double expected = trilinear(distances.field, group, child, x, y, z);
        ASSERT_NEAR(spline(cell[0] + x, cell[1] + y, cell[2] + z), expected, 1e-8);
        ASSERT_NEAR(direct(cell[0] + x, cell[1] + y, cell[2] + z), expected, 1e-12);
    }
}

TEST_P(Lscg, SharedGridPointsHaveTheSameBits) {
    Generator random(200 + GetParam());
    const octree::Octree octree = random_octree(GetParam(), 0.3, random);
    const Distances distances(octree, random);
    const field::Field field = field::solve_lscg(octree, distances.field, 1e-10, {});
    const field::Field again = field::solve_lscg(octree, distances.field, 1e-10, {});
    EXPECT_EQ(field.values, again.values);
    for (int k = 0; k <= octree.depth; ++k) {
        std::map<Key, double> seen;
        for_points(octree, k, [&](const Key& g, std::uint64_t i) {
            const double& first = seen.try_emplace(g, field.values[k][i]).first->second;
            EXPECT_EQ(std::memcmp(&first, &field.values[k][i], sizeof first), 0);
        });
    }
}

INSTANTIATE_TEST_SUITE_P(Depth, Lscg, testing::Values(0, 1, 2, 3, 4));

TEST(LscgErrors, ToleranceThatCannotBeReached) {
    Generator random(1);
    const octree::Octree octree = random_octree(2, 0.4, random);
    const Distances distances(octree, random);
    field::LscgReport report;
    EXPECT_THROW(field::solve_lscg(octree, distances.field, 1e-30, {}, &report), Error);
    EXPECT_GT(report.residual, 0);
    EXPECT_LT(report.residual, 1e-12);

    // Two levels that disagree at the same place, on a root with all of its children: no solution.
    const octree::Octree full = random_octree(2, 1, random);
    Distances inconsistent(full, random);
    test::edit(inconsistent.field.values[full.depth])[13] += 1;
    EXPECT_THROW(field::solve_lscg(full, inconsistent.field, 1e-10, {}, &report), Error);
    EXPECT_GT(report.residual, 0.01);

    Distances broken = distances;
    test::edit(broken.field.values[octree.depth])[13] = NAN;
    EXPECT_THROW(field::solve_lscg(octree, broken.field, 1e-10, {}), Error);
}

TEST(LscgErrors, StopsWhenAsked) {
    Generator random(1);
    const octree::Octree octree = random_octree(3, 0.3, random);
    const Distances distances(octree, random);
    int calls = 0;
    const Progress stop = [&](std::string_view stage, double) {
        ++calls;
        return stage != "coefficients";
    };
    EXPECT_THROW(field::solve_lscg(octree, distances.field, 1e-10, stop), Cancelled);
    EXPECT_LE(calls, 110);
}

TEST(Lscg, Zero) {
    Generator random(1);
    const octree::Octree octree = random_octree(2, 0.3, random);
    Distances distances(octree, random);
    for (auto& level : distances.field.values) level = std::vector<double>(level.size());
    field::LscgReport report;
    const field::Field field = field::solve_lscg(octree, distances.field, 1e-10, {}, &report);
    EXPECT_EQ(report.residual, 0);
    EXPECT_EQ(field.values, distances.field.values);
}

}  // namespace
}  // namespace its
