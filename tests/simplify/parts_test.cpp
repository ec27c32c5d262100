#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "cgal/cgal.h"
#include "its/distance.h"
#include "its/simplify.h"
#include "shell/access.h"
#include "shell/triangle_bounds.h"
#include "simplify/brute_force.h"
#include "simplify/deviation.h"
#include "simplify/hausdorff_bound.h"
#include "simplify/intersections.h"
#include "simplify/rules.h"
#include "support/zoo.h"

namespace its {
namespace {

__extension__ using Quad = __float128;  // slivers need more digits than long double has

TEST(Frame, DistanceIsThatOfBruteForceForEveryShape) {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    const auto point = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
    for (int i = 0; i < 20'000; ++i) {
        const Vec3 a = point(), b = i % 7 == 0 ? a : point();
        Vec3 c = point();
        if (i % 3 == 0) c = a + normal(random) * (b - a);                           // a segment
        if (i % 5 == 0) c = 0.3 * a + 0.7 * b + std::pow(10, -(i % 17)) * point();  // slivers
        const simplifier::Frame f = simplifier::make_frame(a, b, c);
        const simplifier::EdgeTerms e(f);
        for (const Vec3& p : {point(), a + 0.5 * (c - a), b, b + 3.0 * (b - a), 1e-9 * point() + c}) {
            const double expected = brute_force::distance<Quad>(p, a, b, c);
            EXPECT_NEAR(std::sqrt(simplifier::squared_distance(f, e, p)), expected, 256 * unit_roundoff * 20)
                << i;
        }
    }
}

TEST(HausdorffBound, IsAboveDenseSamplesAndTight) {
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    for (const double noise : {1e-3, 0.03, 0.3}) {
        const Mesh m = zoo::sphere({0, 0, 0}, 1, 3);
        Mesh n = zoo::torus(0.8, 0.3, 24, 12);
        for (Vec3& v : n.vertices) v = v + noise * Vec3{normal(random), normal(random), normal(random)};
        for (const auto& [from, to] : {std::pair<const Mesh*, const Mesh*>{&m, &n}, {&n, &m}}) {
            const double bound = simplifier::hausdorff_bound(*from, *to, 1e9, {});
            const double measured = mesh_distance(*from, *to, 400'000).max;
            EXPECT_GE(bound, measured);
            EXPECT_LE(bound, 1.06 * measured);  // a twentieth, and what samples miss
            EXPECT_EQ(simplifier::hausdorff_bound(*from, *to, 0.9 * measured, {}),
                      std::numeric_limits<double>::infinity());
        }
    }
    // Of a triangle to a part of itself, known: corner to edge.
    const Mesh large{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{0, 1, 2}}};
    const Mesh small{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0, 1, 2}}};
    EXPECT_NEAR(simplifier::hausdorff_bound(large, small, 10, {}), 2, 0.1 + 1e-9);
    EXPECT_LE(simplifier::hausdorff_bound(small, large, 10, {}), 1e-12);
}

TEST(Quadric, MinimumOfThreePlanesIsTheirPoint) {
    simplifier::Quadric q = simplifier::plane_quadric({1, 0, 0}, {0.25, 0, 0}, 2);
    q += simplifier::plane_quadric({0, 1, 0}, {0, 0.5, 0}, 1);
    Vec3 x;
    EXPECT_FALSE(simplifier::minimum(q, x));  // a line of minima
    q += simplifier::plane_quadric({0, 0.6, 0.8}, {0, 0.5, -1}, 3);
    ASSERT_TRUE(simplifier::minimum(q, x));
    EXPECT_NEAR(x.x, 0.25, 1e-14);
    EXPECT_NEAR(x.y, 0.5, 1e-14);
    EXPECT_NEAR(x.z, -1, 1e-14);
    EXPECT_NEAR(q(x), 0, 1e-14);
    EXPECT_NEAR(q({1.25, 0.5, -1}), 2, 1e-14);
    EXPECT_NEAR(simplifier::point_quadric({1, 2, 3}, 2)({1, 2, 5}), 8, 1e-14);
}

TEST(Intersections, AgreeWithCgal) {
    // Small integers: all kinds of contact.
    std::mt19937_64 random(2);
    const auto point = [&] { return Vec3{double(random() % 4), double(random() % 4), double(random() % 4)}; };
    int met = 0, tested = 0;
    for (int i = 0; i < 30'000; ++i) {
        const std::array<Vec3, 3> s = {point(), point(), point()}, t = {point(), point(), point()};
        if (cgal::is_degenerate(s) || cgal::is_degenerate(t)) continue;
        const bool expected = cgal::do_intersect(s, t);
        EXPECT_EQ(simplifier::intersect({{0, 1, 2}, s}, {{3, 4, 5}, t}), expected) << i;
        met += expected ? 1 : 0;
        ++tested;
    }
    EXPECT_GT(met, tested / 10);
    EXPECT_LT(met, 9 * tested / 10);
}

TEST(Intersections, SharedCornersAndEdges) {
    const Vec3 a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0};
    const simplifier::NumberedTriangle t{{0, 1, 2}, {a, b, c}};
    EXPECT_FALSE(simplifier::intersect(t, {{1, 0, 3}, {b, a, {0, -1, 0}}}));      // flat neighbours
    EXPECT_FALSE(simplifier::intersect(t, {{1, 0, 3}, {b, a, {0, 1, 1e-300}}}));  // nearly folded, not quite
    EXPECT_TRUE(simplifier::intersect(t, {{1, 0, 3}, {b, a, {0.5, 0.5, 0}}}));    // folded
    EXPECT_FALSE(simplifier::intersect(t, {{0, 3, 4}, {a, {-1, 0, 0}, {0, -1, 0}}}));
    EXPECT_TRUE(
        simplifier::intersect(t, {{0, 3, 4}, {a, {1, 1, -1}, {1, 1, 1}}}));  // through it, from the corner
    EXPECT_TRUE(
        simplifier::intersect(t, {{0, 3, 4}, {a, {0.5, 0.25, 0}, {0.25, 0.5, 0}}}));  // in its plane, on it
    EXPECT_TRUE(simplifier::intersect(t, {{2, 0, 1}, {c, a, b}}));
}

TEST(Intersections, CountedInAWholeMesh) {
    EXPECT_EQ(simplifier::count_intersections(simplifier::Complex(zoo::sphere({0, 0, 0}, 1, 3))), 0u);
    const Mesh two = zoo::overlapping_spheres(2);
    std::uint64_t expected = 0;
    const auto numbered = [&](std::size_t t) {
        const Triangle& c = two.triangles[t];
        return simplifier::NumberedTriangle{c, {two.vertices[c[0]], two.vertices[c[1]], two.vertices[c[2]]}};
    };
    for (std::size_t i = 0; i < two.triangles.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) expected += simplifier::intersect(numbered(i), numbered(j)) ? 1 : 0;
    EXPECT_GT(expected, 0u);
    EXPECT_EQ(simplifier::count_intersections(simplifier::Complex(two)), expected);
}

TEST(Intersections, NoneInAResultThatMustHaveNone) {
    // A shell of a hundredth of its radius: careless simplification runs its sides into each other.
    const Mesh mesh = zoo::joined(zoo::sphere({0, 0, 0}, 1, 3), zoo::reversed(zoo::sphere({0, 0, 0}, 0.99, 3)));
    const Simplified careless = simplify(mesh, {.method = SimplifyMethod::qem, .faces = 120});
    EXPECT_GT(simplifier::count_intersections(simplifier::Complex(careless.mesh)), 0u);
    const Simplified careful =
        simplify(mesh, {.method = SimplifyMethod::qem, .faces = 120, .no_self_intersections = true});
    EXPECT_LT(careful.report.faces_after, mesh.triangles.size() / 2);
    std::vector<cgal::Corners> triangles;
    for (const Triangle& t : careful.mesh.triangles)
        triangles.push_back(
            {careful.mesh.vertices[t[0]], careful.mesh.vertices[t[1]], careful.mesh.vertices[t[2]]});
    for (std::size_t i = 0; i < triangles.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            bool shared = false;
            for (const std::uint32_t v : careful.mesh.triangles[i])
                for (const std::uint32_t w : careful.mesh.triangles[j]) shared |= v == w;
            if (!shared) {
                EXPECT_FALSE(cgal::do_intersect(triangles[i], triangles[j]));
            }
        }
}

TEST(Complex, EveryCollapseKeepsTheInvariants) {
    for (const zoo::Entry& entry : zoo::all()) {
        SCOPED_TRACE(entry.name);
        if (entry.mesh.triangles.size() > 6000) continue;
        simplifier::Complex complex(entry.mesh);
        complex.validate();
        simplifier::AnyCollapse rule;
        simplifier::Decimator decimator(complex, rule);
        std::uint64_t left = complex.living_triangles();
        while (left > 0) {
            left -= std::max<std::uint64_t>(left / 8, 1);
            const bool reached = decimator.run(left, 0, [](std::uint64_t) {});
            complex.validate();
            if (!reached) break;
            left = complex.living_triangles();
        }
    }
}

TEST(Complex, FewestTriangles) {
    EXPECT_EQ(simplifier::Complex(zoo::sphere({0, 0, 0}, 1, 2)).fewest_triangles(), 4u);
    EXPECT_EQ(simplifier::Complex(zoo::torus(1, 0.3, 12, 8)).fewest_triangles(), 14u);
    EXPECT_EQ(simplifier::Complex(zoo::hollow_sphere(2)).fewest_triangles(), 8u);
    EXPECT_EQ(simplifier::Complex(zoo::sheet(4)).fewest_triangles(), 1u);
}

/// Exhausts a tolerance and checks the bookkeeping after every stage.
TEST(Deviation, WitnessesAreKeptInOrder) {
    for (const Mesh& mesh : {zoo::sphere({0, 0, 0}, 1, 3), zoo::torus(1, 0.3, 40, 20), zoo::sheet(12)}) {
        simplifier::Complex complex(mesh);
        simplifier::Certified rule(complex, true, nullptr);
        simplifier::Decimator decimator(complex, rule);
        for (std::uint64_t left = complex.living_triangles(); left > 0; left = left * 3 / 4) {
            const bool reached = decimator.run(left, 0.03, [](std::uint64_t) {});
            rule.deviation()->validate(complex, 0.03);
            if (!reached) break;
        }
        EXPECT_LT(complex.living_triangles(), mesh.triangles.size() / 2);
    }
}

TEST(Deviation, RefusesWhatIsNotNear) {
    // The apex of a low pyramid over a hexagon: flattening it moves it by its height.
    Mesh mesh;
    mesh.vertices.push_back({0, 0, 0.1});
    for (int i = 0; i < 6; ++i)
        mesh.vertices.push_back({std::cos(i * 1.0471975512), std::sin(i * 1.0471975512), 0});
    for (std::uint32_t i = 0; i < 6; ++i) mesh.triangles.push_back({0, i + 1, (i + 1) % 6 + 1});
    const auto faces = [&](double tolerance) {
        return simplify(mesh, {.tolerance = tolerance}).report.faces_after;
    };
    EXPECT_EQ(faces(0.02), 6u);
    EXPECT_LT(faces(0.11), 6u);
}

TEST(TriangleBounds, WhatIsProvenIsSo) {
    const Mesh mesh = zoo::torus(1, 0.4, 40, 20);
    std::mt19937_64 random(9);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> unit(0, 1);
    for (const int depth : {3, 5, 7}) {
        const ThinShell shell = build(mesh, {.depth = depth});
        const shell::TriangleBounds bounds(shell::Access::data(shell));
        int proven = 0, refuted = 0;
        for (int i = 0; i < 3000; ++i) {
            const Triangle& t = mesh.triangles[random() % mesh.triangles.size()];
            Vec3 c[3];
            const double off = (i % 4) * 0.2 * shell.info().thickness(), stretch = 0.2 + 2 * unit(random);
            const Vec3 middle = (1.0 / 3.0) * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]);
            for (int k = 0; k < 3; ++k)
                c[k] = middle + stretch * (mesh.vertices[t[std::size_t(k)]] - middle) +
                       off * Vec3{normal(random), normal(random), normal(random)};
            double least = 1e300, most = -1e300;
            for (int s = 0; s < 300; ++s) {
                double u = unit(random), v = unit(random);
                if (u + v > 1) u = 1 - u, v = 1 - v;
                const double f = shell.value(c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]));
                least = std::min(least, f);
                most = std::max(most, f);
            }
            const bool sampled = least >= shell.info().epsilon_inner && most <= shell.info().epsilon_outer;
            const bool claimed = bounds.in_shell(c[0], c[1], c[2]);
            if (claimed) {
                EXPECT_TRUE(sampled) << i;
            }
            proven += claimed ? 1 : 0;
            refuted += sampled ? 0 : 1;
        }
        EXPECT_GT(proven, 300);   // it proves something
        EXPECT_GT(refuted, 300);  // and there was something to refuse
        EXPECT_FALSE(bounds.in_shell({0, 0, 0}, {10, 0, 0}, {0, 10, 0}));
    }
}

}  // namespace
}  // namespace its
