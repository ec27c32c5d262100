#include "its/shell.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "geometry/vec3.h"
#include "its/inspect.h"
#include "shell/access.h"
#include "shell/budget.h"
#include "shell/shell_data.h"
#include "support/zoo.h"

namespace its {
namespace {

ThinShell build_at(const Mesh& mesh, int depth, Extrema extrema = Extrema::certified, int threads = 0) {
    BuildOptions options;
    options.depth = depth;
    options.extrema = extrema;
    options.run.threads = threads;
    return build(mesh, options);
}

/// Points of M: all vertices, edge midpoints and centroids, then `count` random ones.
template <class F>
void for_samples(const Mesh& mesh, int count, F&& fn) {
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
        for (const Vec3& p : {a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (1.0 / 3.0) * (a + b + c)})
            fn(p);
    }
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < count; ++i) {
        const Triangle& t = mesh.triangles[random() % mesh.triangles.size()];
        double u = unit(random), v = unit(random);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const Vec3 a = mesh.vertices[t[0]];
        fn(a + u * (mesh.vertices[t[1]] - a) + v * (mesh.vertices[t[2]] - a));
    }
}

void expect_contained(const ThinShell& shell, const Mesh& mesh, int samples) {
    double least = 1e300, most = -1e300;
    for_samples(mesh, samples, [&](const Vec3& p) {
        const double f = shell.value(p);
        least = std::min(least, f);
        most = std::max(most, f);
    });
    EXPECT_GE(least, shell.info().epsilon_inner);
    EXPECT_LE(most, shell.info().epsilon_outer);
}

TEST(Shell, ContainsEveryMeshOfTheZoo) {
    for (const auto& entry : zoo::all())
        for (const int depth : {0, 1, 3, 6}) {
            SCOPED_TRACE(entry.name + " K=" + std::to_string(depth));
            const ThinShell shell = build_at(entry.mesh, depth);
            EXPECT_LE(shell.info().epsilon_inner, 0);
            EXPECT_GE(shell.info().epsilon_outer, 0);
            EXPECT_EQ(shell.info().sign, entry.closed_oriented ? SignRule::winding : SignRule::unsigned_rule);
            expect_contained(shell, entry.mesh, 20000);
        }
}

TEST(Shell, OfACubeAlignedWithTheLatticeHasNoThickness) {
    for (int depth = 1; depth <= 7; ++depth) {
        const ThinShell shell = build_at(zoo::box({0, 0, 0}, {1, 1, 1}), depth);
        EXPECT_LE(shell.info().thickness(), 1e-12 * shell.info().scale) << "K=" << depth;
    }
    const ThinShell moved = build_at(zoo::box({-3, 5, 1.5}, {5, 13, 9.5}), 5);
    EXPECT_LE(moved.info().thickness(), 1e-12 * moved.info().scale);
}

TEST(Shell, OfASphereHasTheThicknessOfTrilinearInterpolation) {
    // On a cell of width w the trilinear interpolant of a function with second derivatives bounded by 1/r
    // differs from it by at most 3·w²/8r; the distance to a sphere has them bounded so near the sphere (r ≥ R −
    // 2w), and the mesh lies within R(1 − cos(largest edge angle / 2)) of the sphere.
    const double radius = 1;
    const Mesh mesh = zoo::sphere({0.1, 0.2, 0.3}, radius, 5);
    for (const int depth : {3, 4, 5, 6}) {
        const ThinShell shell = build_at(mesh, depth);
        const double w = shell.info().cell_width;
        const double facets = radius * (1 - std::cos(0.5 * 1.2 / 32));  // icosahedron edges: 1.107 rad over 2⁵
        EXPECT_LE(shell.info().epsilon_outer, 3 * w * w / (8 * (radius - 2 * w)) + 4 * facets);
        EXPECT_GE(shell.info().epsilon_inner, -3 * w * w / (8 * (radius - 2 * w)) - 4 * facets);
        expect_contained(shell, mesh, 10000);
    }
    // Outside a convex body the distance is convex, and interpolation from above: f ≥ 0 nearly everywhere on M.
    const ThinShell shell = build_at(mesh, 4);
    EXPECT_GT(shell.info().epsilon_outer, 10 * -shell.info().epsilon_inner);
}

TEST(Shell, CertifiedAndCandidatesAgree) {
    std::vector<std::pair<Mesh, int>> cases;
    for (const auto& entry : zoo::all())
        for (const int depth : {2, 5}) cases.emplace_back(entry.mesh, depth);
    for (const auto& [mesh, depth] : cases) {
        const ThinShell a = build_at(mesh, depth), b = build_at(mesh, depth, Extrema::candidates);
        const double tolerance = 1e-9 * a.info().cell_width;
        EXPECT_NEAR(a.info().epsilon_inner, b.info().epsilon_inner, tolerance);
        EXPECT_NEAR(a.info().epsilon_outer, b.info().epsilon_outer, tolerance);
        EXPECT_GE(a.info().epsilon_outer, b.info().epsilon_outer - 1e-13 * a.info().cell_width) << "a bound";
    }
}

TEST(Shell, LocalBoundsHoldOnSamples) {
    for (const auto& entry : zoo::all()) {
        const ThinShell shell = build_at(entry.mesh, 5);
        const shell::ShellData& data = shell::Access::data(shell);
        for_samples(entry.mesh, 5000, [&](const Vec3& p) {
            const Vec3 u = data.lattice.to_lattice(p);
            const std::uint64_t cell =
                octree::morton_encode({std::uint32_t(u.x), std::uint32_t(u.y), std::uint32_t(u.z)});
            const std::uint64_t group = data.octree.find(0, cell >> 3);
            ASSERT_NE(group, octree::no_group) << entry.name;
            const unsigned mask = data.octree.levels[0].mask[group];
            ASSERT_TRUE(mask >> (cell & 7) & 1) << entry.name;
            const std::uint64_t index = data.octree.levels[0].first[group] +
                                        std::uint64_t(std::popcount(mask & ((1u << (cell & 7)) - 1)));
            const double f = shell.value(p) / data.lattice.width;
            ASSERT_GE(f, data.surface.lower[index] - 1e-15) << entry.name;
            ASSERT_LE(f, data.surface.upper[index] + 1e-15) << entry.name;
        });
    }
}

TEST(Shell, EpsilonsAreAttained) {
    for (const auto& entry : zoo::all()) {
        const ThinShell shell = build_at(entry.mesh, 4),
                        attained = build_at(entry.mesh, 4, Extrema::candidates);
        const double w = shell.info().cell_width, rounding = shell.info().rounding;
        const double outer = attained.info().epsilon_outer - rounding,
                     inner = attained.info().epsilon_inner + rounding;
        EXPECT_LE(shell.info().epsilon_outer, std::max(outer + 1e-6 * w, 2 * rounding)) << entry.name;
        EXPECT_GE(shell.info().epsilon_inner, std::min(inner - 1e-6 * w, -2 * rounding)) << entry.name;
    }
}

void expect_same_bits(const ThinShell& a, const ThinShell& b, double scale = 1) {
    EXPECT_EQ(a.info().epsilon_inner * scale, b.info().epsilon_inner);
    EXPECT_EQ(a.info().epsilon_outer * scale, b.info().epsilon_outer);
    EXPECT_EQ(shell::Access::data(a).field.values, shell::Access::data(b).field.values);
    EXPECT_EQ(shell::Access::data(a).surface.lower, shell::Access::data(b).surface.lower);
    EXPECT_EQ(shell::Access::data(a).surface.upper, shell::Access::data(b).surface.upper);
    EXPECT_EQ(shell::Access::data(a).surface.lists.offset, shell::Access::data(b).surface.lists.offset);
    EXPECT_EQ(shell::Access::data(a).surface.lists.bytes, shell::Access::data(b).surface.lists.bytes);
    for (std::size_t k = 0; k < shell::Access::data(a).octree.levels.size(); ++k)
        EXPECT_EQ(shell::Access::data(a).octree.levels[k].parent,
                  shell::Access::data(b).octree.levels[k].parent);
}

TEST(Invariance, AnyNumberOfThreadsGivesTheSameBits) {
    const Mesh mesh = zoo::twisted_knot(200, 12);
    for (const int depth : {3, 6}) {
        const ThinShell one = build_at(mesh, depth, Extrema::certified, 1);
        expect_same_bits(one, build_at(mesh, depth, Extrema::certified, 2));
        expect_same_bits(one, build_at(mesh, depth, Extrema::certified, 5));
    }
}

constexpr double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

TEST(Invariance, ScalingByPowersOfTwoGivesTheSameBits) {
    for (const auto& entry : zoo::all())
        for (const double scale : {0.25, 1024.0})
            expect_same_bits(build_at(entry.mesh, 4),
                             build_at(zoo::transformed(entry.mesh, identity, {0, 0, 0}, scale), 4), scale);
}

TEST(Invariance, TriangleOrderDoesNotMatter) {
    for (const auto& entry : zoo::all()) {
        const ThinShell a = build_at(entry.mesh, 4), b = build_at(zoo::shuffled(entry.mesh, 3), 4);
        // The order of the corners may change the last bits of distances.
        const double tolerance = 1e-12 * a.info().scale;
        EXPECT_NEAR(a.info().epsilon_inner, b.info().epsilon_inner, tolerance) << entry.name;
        EXPECT_NEAR(a.info().epsilon_outer, b.info().epsilon_outer, tolerance) << entry.name;
        EXPECT_EQ(shell::Access::data(a).octree.levels[0].parent,
                  shell::Access::data(b).octree.levels[0].parent)
            << entry.name;
        EXPECT_EQ(shell::Access::data(a).octree.levels[0].mask, shell::Access::data(b).octree.levels[0].mask)
            << entry.name;
    }
}

TEST(Invariance, TurningAboutAnAxisTurnsTheShell) {
    constexpr double quarter[9] = {0, -1, 0, 1, 0,
                                   0, 0,  0, 1};  // (x, y, z) to (−y, x, z): the lattice turns with it
    for (const auto& entry : zoo::all()) {
        const ThinShell a = build_at(entry.mesh, 4);
        const ThinShell b = build_at(zoo::transformed(entry.mesh, quarter, {0, 0, 0}, 1), 4);
        const double tolerance = 1e-12 * a.info().scale;
        EXPECT_NEAR(a.info().epsilon_inner, b.info().epsilon_inner, tolerance) << entry.name;
        EXPECT_NEAR(a.info().epsilon_outer, b.info().epsilon_outer, tolerance) << entry.name;
    }
}

TEST(Invariance, AnyRigidMotionIsContained) {
    constexpr double turned[9] = {0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6};
    for (const auto& entry : zoo::all()) {
        SCOPED_TRACE(entry.name);
        const Mesh mesh = zoo::transformed(entry.mesh, turned, {17.3, -5.1, 1e3}, 1);
        expect_contained(build_at(mesh, 5), mesh, 5000);
    }
}

TEST(Build, RefusesWhatItCannotDo) {
    const Mesh sphere = zoo::sphere({0, 0, 0}, 1, 2);
    BuildOptions options;
    options.depth = max_depth + 1;
    EXPECT_THROW(build(sphere, options), OptionError);
    options.depth = -1;
    EXPECT_THROW(build(sphere, options), OptionError);
    options.depth = 3;
    options.run.threads = -2;
    EXPECT_THROW(build(sphere, options), OptionError);
    options.run.threads = 0;
    options.sign = SignRule::winding;
    EXPECT_THROW(build(zoo::sheet(4), options), OptionError) << "an open mesh has no winding numbers";
    EXPECT_THROW(build(Mesh{}, BuildOptions{}), InputError);
    Mesh broken = sphere;
    broken.triangles[3][1] = 1u << 30;
    EXPECT_THROW(build(broken, BuildOptions{}), InputError);
    broken = sphere;
    broken.vertices[5].y = std::nan("");
    EXPECT_THROW(build(broken, BuildOptions{}), InputError);
}

TEST(Build, OverTheMemoryLimitItNamesTheLargestDepthThatFits) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1, 4);
    BuildOptions options;
    options.depth = 12;
    options.max_memory = 20'000'000;
    try {
        build(mesh, options);
        FAIL() << "must be refused";
    } catch (const MemoryError& e) {
        ASSERT_THAT(e.what(), testing::HasSubstr("largest depth that fits is "));
        const std::string text = e.what();
        options.depth = text.back() - '0';
        EXPECT_NO_THROW(build(mesh, options)) << text;
    }
    options.depth = std::nullopt;
    EXPECT_NO_THROW(build(mesh, options)) << "auto stays within the limit";
    options.max_memory = 1000;
    options.depth = 3;
    EXPECT_THROW(build(mesh, options), MemoryError);
}

std::uint64_t pairs_of(const ThinShell& shell) {
    const shell::ShellData& data = shell::Access::data(shell);
    return shell::unpack_lists(data.octree.levels[0], data.surface.lists, data.mesh.triangles.size())
        .triangle.size();
}

TEST(Build, TheEstimateCoversWhatTheShellTakes) {
    for (const auto& entry : zoo::all())
        for (const int depth : {2, 4, 6, 7}) {
            const ThinShell shell = build_at(entry.mesh, depth);
            const std::uint64_t exact = shell::build_bytes({entry.mesh.triangles.size(), shell.info().cells / 8,
                                                            shell.info().surface_cells, pairs_of(shell)});
            EXPECT_GE(exact, shell.info().memory_bytes) << entry.name << ' ' << depth;
            const double ratio =
                double(estimate_memory(entry.mesh, depth) - shell::program_pages) / double(exact);
            EXPECT_GT(ratio, 0.6) << entry.name << ' ' << depth;
            EXPECT_LT(ratio, 1.7) << entry.name << ' ' << depth;
        }
}

TEST(Build, WithoutADepthItIsAsThinAsTheDefaultSays) {
    for (const zoo::Entry& entry : zoo::all()) {
        SCOPED_TRACE(entry.name);
        const ThinShell shell = build(entry.mesh);
        EXPECT_TRUE(shell.info().adaptive);
        EXPECT_EQ(shell.info().coarse_cells, 0u);
        EXPECT_LE(shell.info().thickness(), default_thickness * shell.info().scale);
    }
}

TEST(Build, CanBeStoppedAtAnyPoint) {
    const Mesh mesh = zoo::torus(1, 0.4, 48, 24);
    int calls = 0;
    BuildOptions options;
    options.depth = 5;
    options.run.progress = [&](std::string_view, double fraction) {
        EXPECT_GE(fraction, 0);
        EXPECT_LE(fraction, 1);
        ++calls;
        return true;
    };
    build(mesh, options);
    EXPECT_GT(calls, 5);
    for (int stop_at = 1; stop_at <= calls; stop_at += std::max(1, calls / 20)) {
        int seen = 0;
        options.run.progress = [&](std::string_view, double) { return ++seen < stop_at; };
        EXPECT_THROW(build(mesh, options), Cancelled) << "stopped at call " << stop_at << " of " << calls;
    }
}

}  // namespace
}  // namespace its
