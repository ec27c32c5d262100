#include "its/wrap.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "cgal/cgal.h"
#include "its/distance.h"
#include "octree/lattice.h"
#include "support/zoo.h"

// Wraps, judged by CGAL and by distances at random points.

namespace its {
namespace {

double longest_side(const Mesh& mesh) {
    const Box box = octree::bounds(mesh);
    return std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
}

struct Span {
    double least, most;
};

/// Of the distances to a mesh at random points of another.
Span sampled_distances(const Mesh& from, const Mesh& to, int per_triangle) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    const ClosestPoints closest(to);
    Span span{1e300, 0};
    const auto look = [&](const Vec3& p) {
        const double d = closest.find(p).distance;
        span.least = std::min(span.least, d);
        span.most = std::max(span.most, d);
    };
    for (const Triangle& t : from.triangles) {
        const Vec3 &a = from.vertices[t[0]], &b = from.vertices[t[1]], &c = from.vertices[t[2]];
        look(a);
        for (int i = 0; i < per_triangle; ++i) {
            double u = unit(random), v = unit(random);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            Vec3 p;
            for (int k = 0; k < 3; ++k) p[k] = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
            look(p);
        }
    }
    return span;
}

/// All that is promised of a wrap. An inner one may be empty.
void expect_sound(const Mesh& mesh, const WrapOptions& options) {
    const Wrap result = wrap(mesh, options);
    const WrapReport& report = result.report;
    SCOPED_TRACE(fmt::format("{} wrap, clearance {}, slack {}: {} triangles", name(report.side),
                             report.clearance, report.slack, result.mesh.triangles.size()));
    EXPECT_EQ(report.empty, result.mesh.triangles.empty());
    if (report.empty) {
        EXPECT_EQ(report.side, WrapSide::inner);
        EXPECT_NE(report.reason, "");
        return;
    }
    EXPECT_EQ(report.reason, "");
    EXPECT_GE(report.lowest, report.clearance);
    EXPECT_LE(report.highest, report.clearance + report.slack);
    EXPECT_EQ(cgal::surface_defects(result.mesh), "");
    EXPECT_EQ(cgal::triangles_meeting(mesh, result.mesh), 0u);
    const Span span = sampled_distances(result.mesh, mesh, 3);
    EXPECT_GE(span.least, report.lowest * (1 - 1e-12));
    EXPECT_LE(span.most, report.highest * (1 + 1e-12));
    if (report.side == WrapSide::outer) {
        EXPECT_EQ(cgal::vertices_not_inside(mesh, result.mesh), 0u);
    }
}

TEST(Wrap, IsSoundAroundAndInsideOfEveryMesh) {
    for (const zoo::Entry& entry : zoo::all()) {
        SCOPED_TRACE(entry.name);
        const double side = longest_side(entry.mesh);
        if (!(side > 0)) continue;
        for (const WrapSide where : {WrapSide::outer, WrapSide::inner}) {
            expect_sound(entry.mesh, {.clearance = 0.02 * side, .slack = 0.04 * side, .side = where});
            expect_sound(entry.mesh, {.clearance = 0.3 * side, .slack = 0.05 * side, .side = where});
        }
    }
}

TEST(Wrap, IsSoundWithoutClearance) {
    for (const Mesh& mesh : {zoo::tetrahedron(), zoo::sphere({1, 2, 3}, 2, 2), zoo::overlapping_spheres(2)})
        for (const WrapSide where : {WrapSide::outer, WrapSide::inner})
            expect_sound(mesh, {.clearance = 0, .slack = 0.01 * longest_side(mesh), .side = where});
    expect_sound(zoo::single_triangle(), {.clearance = 0, .slack = 0.05});
}

TEST(Wrap, DefaultSlackIsTheLargerOfTwo) {
    const Mesh box = zoo::box({0, 0, 0}, {10, 5, 5});
    EXPECT_DOUBLE_EQ(wrap(box, {.clearance = 0.1}).report.slack, 0.01);
    EXPECT_DOUBLE_EQ(wrap(box, {.clearance = 5}).report.slack, 0.1);
}

TEST(Wrap, IsSoundFarFromTheOriginAndInSingles) {
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const Mesh near = zoo::torus(1, 0.3, 24, 12);
    for (const double shift : {0.0, 50.0, 1e4}) {
        SCOPED_TRACE(shift);
        const Mesh mesh = zoo::transformed(near, identity, {shift, -shift, shift}, 1);
        WrapOptions options{.clearance = 0.1, .slack = 0.05};
        expect_sound(mesh, options);
        options.coordinates = Coordinates::single_offset;
        expect_sound(mesh, options);
        if (shift > 100) continue;
        options.coordinates = Coordinates::single;
        expect_sound(mesh, options);
        for (const Vec3& v : wrap(mesh, options).mesh.vertices)
            for (int k = 0; k < 3; ++k) EXPECT_EQ(double(float(v[k])), v[k]);
    }
}

TEST(Wrap, EnclosesPartsThatAreSmallerThanACell) {
    const Mesh mesh = zoo::joined(zoo::sphere({0, 0, 0}, 1, 2), zoo::sphere({3, 3, 3}, 1e-4, 1));
    const Wrap result = wrap(mesh, {.clearance = 0.0001, .slack = 0.02});
    EXPECT_EQ(result.report.mesh_components, 2u);
    EXPECT_EQ(result.report.components, 2u);
    EXPECT_EQ(cgal::vertices_not_inside(mesh, result.mesh), 0u);
    EXPECT_EQ(wrap(mesh, {.clearance = 2.5, .slack = 0.1}).report.components, 1u);  // they have grown together
}

TEST(Wrap, HasAWallInEachCavity) {
    const Mesh hollow = zoo::hollow_sphere(2);
    EXPECT_EQ(wrap(hollow, {.clearance = 0.02, .slack = 0.02}).report.components, 2u);
    EXPECT_EQ(wrap(hollow, {.clearance = 0.02, .slack = 0.02, .side = WrapSide::inner}).report.components, 2u);
}

TEST(Wrap, VolumeOfABallGrowsByTheClearance) {
    const double radius = 1, clearance = 0.5, slack = 0.01, pi = 3.14159265358979;
    const Wrap result = wrap(zoo::sphere({0, 0, 0}, radius, 5), {.clearance = clearance, .slack = slack});
    ASSERT_TRUE(result.report.mesh_volume.has_value());
    EXPECT_NEAR(*result.report.mesh_volume, 4.0 / 3 * pi, 0.02);
    EXPECT_GT(result.report.volume, 4.0 / 3 * pi * std::pow(radius + clearance - 0.005, 3));
    EXPECT_LT(result.report.volume, 4.0 / 3 * pi * std::pow(radius + clearance + slack, 3));
}

TEST(Wrap, InnerIsEmptyWhereThereIsNoRoom) {
    const Wrap thin = wrap(zoo::plate(0.01), {.clearance = 0.01, .slack = 0.005, .side = WrapSide::inner});
    EXPECT_TRUE(thin.report.empty);
    EXPECT_NE(thin.report.reason.find("no point inside"), std::string::npos) << thin.report.reason;
    const Wrap open = wrap(zoo::sheet(4), {.clearance = 0.01, .side = WrapSide::inner});
    EXPECT_TRUE(open.report.empty);
    EXPECT_NE(open.report.reason.find("not closed"), std::string::npos) << open.report.reason;
}

TEST(Wrap, DirectionsOfTrianglesDoNotMatter) {
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 2);
    const WrapOptions options{.clearance = 0.1, .slack = 0.05};
    EXPECT_EQ(wrap(ball, options).mesh.triangles, wrap(zoo::reversed(ball), options).mesh.triangles);
}

TEST(Wrap, IsTheSameForAnyNumberOfThreads) {
    const Mesh mesh = zoo::twisted_knot(40, 12);
    WrapOptions options{.clearance = 0.02, .slack = 0.05};
    options.run.threads = 1;
    const Wrap one = wrap(mesh, options);
    options.run.threads = 3;
    const Wrap three = wrap(mesh, options);
    EXPECT_EQ(one.mesh.vertices, three.mesh.vertices);
    EXPECT_EQ(one.mesh.triangles, three.mesh.triangles);
    EXPECT_EQ(one.report.lowest, three.report.lowest);
    EXPECT_EQ(one.report.highest, three.report.highest);
}

TEST(Wrap, RefusesWhatCannotBe) {
    const Mesh box = zoo::box({0, 0, 0}, {1, 1, 1});
    EXPECT_THROW(wrap(box, {.clearance = -1}), OptionError);
    EXPECT_THROW(wrap(box, {.clearance = std::nan("")}), OptionError);
    EXPECT_THROW(wrap(box, {.clearance = 1, .slack = -1}), OptionError);
    EXPECT_THROW(wrap(box, {.clearance = 1, .slack = 1e-12}), OptionError);
    EXPECT_THROW(wrap(Mesh{}, {}), InputError);
    const Mesh point{{{1, 2, 3}}, {{0, 0, 0}}};
    EXPECT_THROW(wrap(point, {}), OptionError);
    expect_sound(point, {.clearance = 0.5, .slack = 0.1});
    EXPECT_THROW(wrap(box, {.slack = 1e-3, .max_memory = 100'000}), MemoryError);
    WrapOptions stopped{.slack = 0.01};
    stopped.run.progress = [](std::string_view, double fraction) { return fraction < 0.2; };
    EXPECT_THROW(wrap(box, stopped), Cancelled);
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    WrapOptions single{.slack = 1e-3};
    single.coordinates = Coordinates::single;
    EXPECT_THROW(wrap(zoo::transformed(box, identity, {1e6, 0, 0}, 1), single), OptionError);
}

TEST(Wrap, ProgressNeverFalls) {
    double last = 0;
    bool falls = false;
    WrapOptions options{.slack = 0.01};
    options.run.progress = [&](std::string_view, double fraction) {
        falls = falls || fraction < last;
        last = fraction;
        return true;
    };
    wrap(zoo::tetrahedron(), options);
    EXPECT_FALSE(falls);
    EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace its
