// Meshes of extreme size and shape: each is built and verified, and its thickness is what geometry says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/shell.h"
#include "its/verify.h"
#include "support/zoo.h"

namespace its {
namespace {

std::string failures(const VerifyReport& report) {
    std::string text;
    for (const VerifyCheck& check : report.checks) {
        if (!check.passed) text += check.name + ": " + check.detail + "\n";
    }
    return text;
}

/// Builds and verifies. \return thickness relative to s
double relative_thickness(const Mesh& mesh, int depth) {
    const ThinShell shell = build(mesh, {.depth = depth});
    const VerifyReport report = verify(shell, mesh, {.samples = 5000});
    EXPECT_TRUE(report.passed()) << "K = " << depth << "\n" << failures(report);
    const ShellInfo& info = shell.info();
    EXPECT_LE(info.epsilon_inner, 0);
    EXPECT_GE(info.epsilon_outer, 0);
    return (info.epsilon_outer - info.epsilon_inner) / info.scale;
}

Mesh scaled(Mesh mesh, const Vec3& factor, const Vec3& shift = {}) {
    for (Vec3& p : mesh.vertices)
        p = {p.x * factor.x + shift.x, p.y * factor.y + shift.y, p.z * factor.z + shift.z};
    return mesh;
}

/// So many cell widths, relative to s.
double cells(double count, int depth) {
    return count * std::ldexp(1.0, -depth);
}

TEST(ExtremeSizes, TinyAndHugeCoordinatesGiveTheSameShell) {
    const Mesh ball = zoo::sphere({0.3, 0.1, -0.2}, 1, 2);
    for (const int depth : {0, 3, 5}) {
        const double usual = relative_thickness(ball, depth);
        EXPECT_EQ(relative_thickness(scaled(ball, {0x1p30, 0x1p30, 0x1p30}), depth), usual);
        EXPECT_EQ(relative_thickness(scaled(ball, {0x1p-200, 0x1p-200, 0x1p-200}), depth), usual);
        for (const double factor : {1e9, 1e-9, 1e70, 1e-70})
            EXPECT_NEAR(relative_thickness(scaled(ball, {factor, factor, factor}), depth), usual, 0.1 * usual);
    }
}

TEST(ExtremeSizes, BeyondWhatPredicatesCanDoIsRefused) {
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 1);
    for (const double factor : {1e-80, 1e80})
        EXPECT_THROW(build(scaled(ball, {factor, factor, factor}), {.depth = 3}), InputError);
    EXPECT_THROW(build(scaled(ball, {1, 1, 1}, {1e13, 0, 0}), {.depth = 6}), InputError);
}

TEST(ExtremeSizes, FarFromTheOriginOnlyRoundingGrows) {
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 2);
    for (const int depth : {0, 3, 5}) {
        const double usual = relative_thickness(ball, depth);
        for (const double away : {1e6, 1e9})
            EXPECT_NEAR(relative_thickness(scaled(ball, {1, 1, 1}, {away, -away, away}), depth), usual,
                        0.2 * usual);
    }
}

TEST(ExtremeSizes, NeedlesCostNoMoreThanTheirLength) {
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 3);
    const Mesh needle = scaled(ball, {1e4, 1, 1});
    Mesh slanted = needle;
    for (Vec3& p : slanted.vertices) p = {p.x + 0.5 * p.y, p.x - 0.5 * p.y, p.x + p.z};
    for (const int depth : {0, 3, 6, 8}) {
        EXPECT_LE(relative_thickness(needle, depth), cells(1, depth));
        EXPECT_LE(relative_thickness(slanted, depth), cells(1, depth));
        EXPECT_LE(build(needle, {.depth = depth}).info().surface_cells, 8u * (1u << depth));
    }
}

TEST(ExtremeSizes, FlatSheets) {
    Mesh tilted = zoo::sheet(16);
    for (Vec3& p : tilted.vertices) p.z += 0.3 * p.x + 0.7 * p.y;
    for (const int depth : {3, 6}) {
        EXPECT_LE(relative_thickness(zoo::sheet(16), depth), 1e-12) << "in a lattice plane, f = 0 on it";
        EXPECT_LE(relative_thickness(tilted, depth), cells(0.7, depth));
    }
}

TEST(ExtremeSizes, NextToNothing) {
    const Mesh triangle = zoo::single_triangle();
    const Mesh sliver{{{0, 0, 0}, {1, 0, 0}, {0.5, 1e-15, 0}}, {{0, 1, 2}}};
    const Mesh two_points{{{0, 0, 0}, {1, 2, 3}}, {{0, 1, 1}}};
    const Mesh point{{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, {{0, 1, 2}}};
    const Mesh origin{{{0, 0, 0}}, {{0, 0, 0}}};
    Mesh many = point;
    many.triangles.assign(20000, {0, 1, 2});
    for (const Mesh& mesh : {triangle, sliver, two_points, point, origin, many}) {
        for (const int depth : {0, 3, 8}) {
            EXPECT_LE(relative_thickness(mesh, depth), cells(0.9, depth));
            EXPECT_EQ(build(mesh, {.depth = depth}).info().sign, SignRule::unsigned_rule);
        }
    }
}

TEST(ExtremeSizes, TwoTrianglesAMillionSizesApart) {
    const Mesh mesh{{{0, 0, 0}, {1e-6, 0, 0}, {0, 1e-6, 0}, {1e6, 0, 0}, {1e6 + 1, 0, 0}, {1e6, 1, 0}},
                    {{0, 1, 2}, {3, 4, 5}}};
    for (const int depth : {3, 8}) EXPECT_LE(relative_thickness(mesh, depth), cells(1, depth));
}

TEST(ExtremeSizes, EdgesThatGrazeAFaceOfTheLattice) {
    // A disc of thin triangles: next to the outermost points its rim is within 1e-13 of a lattice plane for
    // 1e-9.
    Mesh disc{{{0, 0, 0}}, {}};
    constexpr std::uint32_t corners = 6000;
    for (std::uint32_t i = 0; i < corners; ++i) {
        const double angle = 2 * 3.14159265358979323846 * i / corners;
        disc.vertices.push_back({std::cos(angle), std::sin(angle), 0});
        disc.triangles.push_back({0, i + 1, (i + 1) % corners + 1});
    }
    for (const int depth : {3, 5}) EXPECT_LE(relative_thickness(disc, depth), cells(1, depth));
}

TEST(SlowExtremeSizes, FiveMillionTriangles) {
    if (std::getenv("ITS_TEST_LARGE") == nullptr) GTEST_SKIP() << "takes 2 GB: set ITS_TEST_LARGE to run it";
    Mesh mesh = zoo::torus(1, 0.35, 2500, 1000);
    std::uint64_t state = 20240614;
    for (Vec3& p : mesh.vertices) {  // a scan's noise
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        p.z += 1e-5 * double(state >> 40) * 0x1p-24;
    }
    ASSERT_EQ(mesh.triangles.size(), 5000000u);
    for (const int depth : {8, 10}) {
        const ThinShell shell = build(mesh, {.depth = depth});
        const BuildSeconds& times = shell.build_seconds();
        EXPECT_EQ(shell.info().sign, SignRule::winding);
        EXPECT_LE(shell.info().epsilon_outer - shell.info().epsilon_inner, shell.info().cell_width);
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        EXPECT_LE(std::uint64_t(usage.ru_maxrss) * 1024, 2 * estimate_memory(mesh, depth));
        RecordProperty("seconds_at_depth_" + std::to_string(depth), std::to_string(times.total));
        RecordProperty("peak_kilobytes_at_depth_" + std::to_string(depth), std::to_string(usage.ru_maxrss));
    }
}

TEST(SlowExtremeSizes, DepthTwelve) {
    // 16,384 cells a side of the root: a needle, so that surface cells are few.
    const Mesh needle = scaled(zoo::sphere({0, 0, 0}, 1, 2), {1, 3e-3, 3e-3});
    EXPECT_LE(relative_thickness(needle, 12), cells(1, 12));
}

}  // namespace
}  // namespace its
