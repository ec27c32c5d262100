// What each kind of input means: the rule that `auto` takes, and where inside is. docs/meshes.md says the same
// in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/shell.h"
#include "its/verify.h"
#include "support/zoo.h"

namespace its {
namespace {

using testing::HasSubstr;

constexpr Vec3 origin{0, 0, 0};

/// The mesh with each of its triangles turned around with probability ½.
Mesh shuffled_directions(Mesh mesh, std::uint32_t seed) {
    std::mt19937 random(seed);
    for (Triangle& t : mesh.triangles)
        if (random() % 2 == 0) std::swap(t[1], t[2]);
    return mesh;
}

Mesh at(const Mesh& mesh, const Vec3& shift) {
    const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    return zoo::transformed(mesh, same, shift, 1);
}

Mesh box_without_top() {
    Mesh mesh = zoo::box({-1, -1, -1}, {1, 1, 1});
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return mesh.vertices[t[0]].z == 1 && mesh.vertices[t[1]].z == 1 && mesh.vertices[t[2]].z == 1;
    });
    return mesh;
}

struct Probe {
    Vec3 point;
    bool inside;
};

/// Builds the mesh, expects f < 0 exactly at the probes that are inside, and that the verifier agrees.
ThinShell expect_meaning(const Mesh& mesh, SignRule rule, std::uint64_t turned,
                         const std::vector<Probe>& probes, std::optional<SignRule> asked = {}) {
    BuildOptions options;
    options.depth = 5;
    options.sign = asked;
    const MeshReport report = inspect(mesh);
    if (!asked) {
        EXPECT_EQ(report.sign, rule) << report.sign_reason;
        EXPECT_EQ(report.turned, turned) << report.sign_reason;
    }
    const ThinShell shell = build(mesh, options);
    EXPECT_EQ(shell.info().sign, rule);
    EXPECT_EQ(shell.info().sign_reason, asked ? "asked for" : report.sign_reason);
    for (const Probe& probe : probes)
        EXPECT_EQ(shell.value(probe.point) < 0, probe.inside)
            << probe.point.x << ' ' << probe.point.y << ' ' << probe.point.z;
    VerifyOptions verifying;
    verifying.samples = 20'000;
    verifying.grid_samples = 500;
    for (const VerifyCheck& check : verify(shell, mesh, verifying).checks)
        EXPECT_TRUE(check.passed) << check.name << ": " << check.detail;
    return shell;
}

TEST(Meaning, ClosedSolid) {
    expect_meaning(zoo::sphere(origin, 1, 3), SignRule::winding, 0, {{origin, true}, {{1.2, 0, 0}, false}});
}

TEST(Meaning, NestedShellsAreCavities) {
    // Outward, inward, outward: a ball in a hollow ball.
    const Mesh nested =
        zoo::joined(zoo::joined(zoo::sphere(origin, 1, 3), zoo::reversed(zoo::sphere(origin, 0.7, 3))),
                    zoo::sphere(origin, 0.3, 3));
    expect_meaning(nested, SignRule::winding, 0,
                   {{origin, true}, {{0.5, 0, 0}, false}, {{0.85, 0, 0}, true}, {{1.2, 0, 0}, false}});
    // A shell in a shell that both face outward is no cavity: winding number 2.
    expect_meaning(zoo::joined(zoo::sphere(origin, 1, 3), zoo::sphere(origin, 0.5, 3)), SignRule::winding, 0,
                   {{origin, true}, {{0.75, 0, 0}, true}});
}

TEST(Meaning, SeveralSolidsAreTheirUnion) {
    expect_meaning(zoo::joined(zoo::sphere(origin, 1, 3), zoo::sphere({3, 0, 0}, 1, 3)), SignRule::winding, 0,
                   {{origin, true}, {{3, 0, 0}, true}, {{1.5, 0, 0}, false}});
    expect_meaning(zoo::joined(zoo::sphere(origin, 1, 3), zoo::sphere({1, 0, 0}, 1, 3)), SignRule::winding, 0,
                   {{{-0.5, 0, 0}, true}, {{0.5, 0, 0}, true}, {{1.5, 0, 0}, true}, {{0.5, 1.2, 0}, false}});
}

TEST(Meaning, AnInvertedMeshIsTurnedAroundUnlessAskedNotTo) {
    const Mesh inverted = zoo::reversed(zoo::sphere(origin, 1, 3));
    const ThinShell shell = expect_meaning(inverted, SignRule::winding, inverted.triangles.size(),
                                           {{origin, true}, {{1.2, 0, 0}, false}});
    EXPECT_THAT(shell.info().sign_reason, HasSubstr("inside out"));
    EXPECT_EQ(shell.mesh().triangles, zoo::sphere(origin, 1, 3).triangles);
    expect_meaning(inverted, SignRule::winding, 0, {{origin, false}, {{1.2, 0, 0}, false}}, SignRule::winding);
    EXPECT_EQ(oriented(inverted).triangles, zoo::sphere(origin, 1, 3).triangles);
}

TEST(Meaning, AnInvertedSolidAmongOthersIsTakenAway) {
    const Mesh small = zoo::reversed(zoo::sphere({0.9, 0, 0}, 0.5, 3));
    expect_meaning(zoo::joined(zoo::sphere(origin, 1, 3), small), SignRule::winding, 0,
                   {{{-0.5, 0, 0}, true}, {{0.7, 0, 0}, false}, {{1.2, 0, 0}, false}});
    // Even where it is the greater one, as long as something is inside.
    const Mesh mostly = zoo::joined(zoo::sphere({3, 0, 0}, 0.5, 3), zoo::reversed(zoo::sphere(origin, 1, 3)));
    ASSERT_LT(inspect(mostly).signed_volume, 0);
    expect_meaning(mostly, SignRule::winding, 0, {{origin, false}, {{3, 0, 0}, true}});
}

TEST(Meaning, DuplicatedTrianglesCountTwice) {
    const Mesh ball = zoo::sphere(origin, 1, 2);
    expect_meaning(zoo::joined(ball, ball), SignRule::winding, 0, {{origin, true}, {{1.2, 0, 0}, false}});
    Mesh once_more = ball;
    once_more.triangles.push_back(once_more.triangles[10]);
    const ThinShell shell =
        expect_meaning(once_more, SignRule::generalized, 0, {{origin, true}, {{1.2, 0, 0}, false}});
    EXPECT_THAT(shell.info().sign_reason, HasSubstr("separates inside from outside"));
}

TEST(Meaning, OppositeDuplicatesCancel) {
    // A wall between two chambers, as two coincident triangles that face each other: it has no volume.
    Mesh mesh = zoo::box({-1, -1, -1}, {1, 1, 1});
    const auto first = std::uint32_t(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {{0, -1, -1}, {0, 1, -1}, {0, 0, 1}});
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 1});
    expect_meaning(mesh, SignRule::winding, 0,
                   {{{-0.5, 0, 0}, true}, {{0.5, 0, 0}, true}, {{1.2, 0, 0}, false}});
}

TEST(Meaning, PointsAndSegmentsHaveNoInsideAndNoEffectOnIt) {
    const Mesh isolated = zoo::joined(zoo::sphere(origin, 1, 3), at(zoo::degenerate(), {1.5, 0, 0}));
    const ThinShell shell =
        expect_meaning(isolated, SignRule::winding, 0, {{origin, true}, {{1.4, 0, 0}, false}});
    EXPECT_LE(shell.value({1.75, 0.5, 0.75}), shell.info().epsilon_outer) << "the point belongs to M";
    expect_meaning(zoo::degenerate(), SignRule::unsigned_rule, 0, {{{0.5, 0.25, 0.125}, false}});
}

TEST(Meaning, AnIsolatedTriangleBesideASolidHasNoInside) {
    const Mesh beside = zoo::joined(zoo::sphere(origin, 1, 3), at(zoo::single_triangle(), {1.5, 0, 0}));
    expect_meaning(
        beside, SignRule::generalized, 0,
        {{origin, true}, {{1.9, 0.4, 0.25}, false}, {{1.9, 0.4, -0.25}, false}, {{1.2, 0, 0}, false}});
    expect_meaning(zoo::single_triangle(), SignRule::unsigned_rule, 0, {{{0.4, 0.3, 0.1}, false}});
}

TEST(Meaning, HolesAreFilled) {
    const Mesh open = box_without_top();
    expect_meaning(open, SignRule::generalized, 0,
                   {{origin, true}, {{0, 0, 0.8}, true}, {{0, 0, 1.2}, false}, {{1.2, 0, 0}, false}});
    const Mesh inverted = zoo::reversed(open);
    const ThinShell shell = expect_meaning(inverted, SignRule::generalized, inverted.triangles.size(),
                                           {{origin, true}, {{0, 0, 1.2}, false}});
    EXPECT_THAT(shell.info().sign_reason, HasSubstr("inside out"));
    expect_meaning(open, SignRule::unsigned_rule, 0, {{origin, false}}, SignRule::unsigned_rule);
}

/// Sum of signed solid angles over 4π (Van Oosterom and Strackee 1983).
double solid_angle_winding(const Mesh& mesh, const Vec3& p) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - p, b = mesh.vertices[t[1]] - p, c = mesh.vertices[t[2]] - p;
        const double la = norm(a), lb = norm(b), lc = norm(c);
        sum += 2 *
               std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (4 * 3.14159265358979323846);
}

/// Where a function that changes sign from a to b does so.
template <class F>
double root(F&& f, double a, double b) {
    const bool sign = f(a) < 0;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (a + b);
        ((f(middle) < 0) == sign ? a : b) = middle;
    }
    return a;
}

TEST(Meaning, TheSurfaceThroughAHoleRunsWhereTheWindingNumberIsOneHalf) {
    // A ball with its cap cut off along an oblique plane, so that nothing is aligned with the lattice.
    const double turn[9] = {2.0 / 3, -1.0 / 3, 2.0 / 3, 2.0 / 3, 2.0 / 3, -1.0 / 3, -1.0 / 3, 2.0 / 3, 2.0 / 3};
    Mesh mesh = zoo::sphere(origin, 1, 4);
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return mesh.vertices[t[0]].z + mesh.vertices[t[1]].z + mesh.vertices[t[2]].z > 1.2;
    });
    mesh = zoo::transformed(mesh, turn, {0.1, 0.2, 0.3}, 1);
    BuildOptions options;
    options.depth = 5;
    const ThinShell shell = build(mesh, options);
    const Vec3 up{turn[2], turn[5], turn[8]}, right{turn[0], turn[3], turn[6]}, back{turn[1], turn[4], turn[7]};
    const Vec3 centre{0.1, 0.2, 0.3};
    double worst = 0;
    for (int i = -10; i <= 10; ++i)
        for (int j = -10; j <= 10; ++j) {
            const Vec3 across = centre + (0.06 * i) * right + (0.06 * j) * back;
            if (norm(across - centre) > 0.75) continue;  // the hole's radius is some 0.92
            const auto on_ray = [&](double h) { return across + h * up; };
            const double filled =
                root([&](double h) { return 0.5 - solid_angle_winding(mesh, on_ray(h)); }, 0.1, 0.9);
            const double zero = root([&](double h) { return shell.value(on_ray(h)); }, 0.1, 0.9);
            worst = std::max(worst, std::abs(filled - zero));
        }
    // Half a cell and more if it ran in steps.
    EXPECT_LT(worst, 0.1 * shell.info().cell_width);
}

TEST(Meaning, FlatAndSoupHaveNoInside) {
    EXPECT_THAT(inspect(zoo::sheet(5)).sign_reason, HasSubstr("only 0 %"));
    EXPECT_THAT(inspect(zoo::soup(50, 3)).sign_reason, HasSubstr("soup"));
    expect_meaning(zoo::sheet(5), SignRule::unsigned_rule, 0,
                   {{{0.5, 0.5, 0.1}, false}, {{0.5, 0.5, -0.1}, false}});
    expect_meaning(zoo::soup(50, 3), SignRule::unsigned_rule, 0, {});
    expect_meaning(zoo::moebius_strip(40), SignRule::unsigned_rule, 0, {{{0.9, 0, 0.2}, false}});
    EXPECT_EQ(inspect(zoo::moebius_strip(40)).sign_advice, SignAdvice::generalized_as_it_is);
}

TEST(Meaning, MixedDirectionsAreRepaired) {
    const Mesh ball = zoo::sphere(origin, 1, 3);
    const Mesh mixed = shuffled_directions(ball, 1);
    const ThinShell shell =
        expect_meaning(mixed, SignRule::winding, inspect(mixed).turned, {{origin, true}, {{1.2, 0, 0}, false}});
    EXPECT_GT(inspect(mixed).turned, 100u);
    EXPECT_EQ(inspect(mixed).sign_advice, SignAdvice::crossings_as_it_is);
    const Mesh& repaired = shell.mesh();
    EXPECT_EQ(inspect(repaired).unbalanced_edges, 0u);
    EXPECT_GT(inspect(repaired).signed_volume, 4);
    EXPECT_EQ(inspect(repaired).turned, 0u);
    expect_meaning(mixed, SignRule::even_odd, 0, {{origin, true}, {{1.2, 0, 0}, false}}, SignRule::even_odd);
}

TEST(Meaning, RepairKeepsCavitiesAndUnions) {
    const Mesh hollow =
        shuffled_directions(zoo::joined(zoo::sphere(origin, 1, 3), zoo::sphere({0.1, 0, 0}, 0.5, 3)), 2);
    expect_meaning(hollow, SignRule::winding, inspect(hollow).turned, {{origin, false}, {{-0.7, 0, 0}, true}});
    // Overlapping: most of each faces outward, so the overlap counts twice and stays inside.
    const Mesh overlapping =
        shuffled_directions(zoo::joined(zoo::sphere(origin, 1, 3), zoo::sphere({1.4, 0, 0}, 1, 3)), 3);
    expect_meaning(overlapping, SignRule::winding, inspect(overlapping).turned,
                   {{{0.7, 0, 0}, true}, {{-0.5, 0, 0}, true}, {{2, 0, 0}, true}});
    // By even-odd it is outside.
    expect_meaning(overlapping, SignRule::even_odd, 0, {{{0.7, 0, 0}, false}, {{-0.5, 0, 0}, true}},
                   SignRule::even_odd);
    // A part that already agrees keeps its directions, here those of a cavity that faces outward: no cavity.
    const Mesh half =
        zoo::joined(shuffled_directions(zoo::sphere(origin, 1, 3), 4), zoo::sphere(origin, 0.5, 3));
    expect_meaning(half, SignRule::winding, inspect(half).turned, {{origin, true}, {{0.75, 0, 0}, true}});
}

/// A Klein bottle that passes through itself: every edge has two triangles, but it has one side only.
Mesh klein_bottle(int n, int m) {
    Mesh mesh;
    const double turn = 2 * 3.14159265358979323846;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            const double u = turn * i / n, v = turn * j / m;
            const double across = std::cos(u / 2) * std::sin(v) - std::sin(u / 2) * std::sin(2 * v);
            const double up = std::sin(u / 2) * std::sin(v) + std::cos(u / 2) * std::sin(2 * v);
            mesh.vertices.push_back({(2 + across) * std::cos(u), (2 + across) * std::sin(u), up});
        }
    const auto index = [&](int i, int j) {  // after a turn, v → −v
        return i < n ? std::uint32_t(i * m + (j % m)) : std::uint32_t((2 * m - j) % m);
    };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            const std::uint32_t a = index(i, j), b = index(i + 1, j), c = index(i + 1, j + 1),
                                d = index(i, j + 1);
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
        }
    return mesh;
}

TEST(Meaning, OneSidedClosedMeshesGoByEvenOdd) {
    const Mesh mesh = klein_bottle(40, 24);
    const MeshReport report = inspect(mesh);
    EXPECT_TRUE(report.closed);
    EXPECT_EQ(report.odd_edges, 0u);
    // The section of the tube at y = 0 is a lying figure eight: inside is in its lobes.
    expect_meaning(mesh, SignRule::even_odd, 0,
                   {{{2.6, 0, 0}, true}, {{1.4, 0, 0}, true}, {{2, 0, 0.5}, false}, {origin, false}});
    EXPECT_THAT(report.sign_reason, HasSubstr("Klein bottle"));
}

TEST(Meaning, RulesThatAreNotDefinedAreRefused) {
    BuildOptions options;
    options.depth = 3;
    options.sign = SignRule::winding;
    EXPECT_THROW(build(box_without_top(), options), OptionError);
    options.sign = SignRule::even_odd;
    EXPECT_THROW(build(box_without_top(), options), OptionError);
    options.sign = SignRule::generalized;
    EXPECT_NO_THROW(build(box_without_top(), options));
    EXPECT_NO_THROW(build(zoo::moebius_strip(20), options));
    EXPECT_NO_THROW(build(zoo::soup(50, 3), options));
}

TEST(Meaning, GeneralizedOfAClosedMeshIsWinding) {
    for (const auto& entry : zoo::all()) {
        if (!entry.closed_oriented) continue;
        BuildOptions options;
        options.depth = 4;
        options.sign = SignRule::winding;
        const ThinShell whole = build(entry.mesh, options);
        options.sign = SignRule::generalized;
        const ThinShell general = build(entry.mesh, options);
        std::mt19937_64 random(8);
        std::uniform_real_distribution<double> unit(0, 1);
        const Box root = whole.info().root;
        for (int i = 0; i < 500; ++i) {
            Vec3 p;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = root.min[axis] + unit(random) * (root.max[axis] - root.min[axis]);
            ASSERT_EQ(whole.value(p), general.value(p)) << entry.name;
        }
    }
}

TEST(Meaning, UnsignedNeverFallsBelowZero) {
    for (const auto& entry : zoo::all()) {
        BuildOptions options;
        options.depth = 4;
        options.sign = SignRule::unsigned_rule;
        const ThinShell shell = build(entry.mesh, options);
        EXPECT_EQ(shell.info().epsilon_inner, 0) << entry.name;
        std::mt19937_64 random(8);
        std::uniform_real_distribution<double> unit(0, 1);
        const Box root = shell.info().root;
        for (int i = 0; i < 2000; ++i) {
            Vec3 p;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = root.min[axis] + (2 * unit(random) - 0.5) * (root.max[axis] - root.min[axis]);
            ASSERT_GE(shell.value(p), 0) << entry.name;
        }
        for (const Triangle& t : entry.mesh.triangles) {
            double u = unit(random), v = unit(random);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            const Vec3 a = entry.mesh.vertices[t[0]];
            const double f =
                shell.value(a + u * (entry.mesh.vertices[t[1]] - a) + v * (entry.mesh.vertices[t[2]] - a));
            ASSERT_GE(f, 0) << entry.name;
            ASSERT_LE(f, shell.info().epsilon_outer) << entry.name;
        }
    }
}

TEST(Meaning, TheSameForAnyNumberOfThreads) {
    Mesh open = zoo::sphere(origin, 1, 4);
    open.triangles.resize(open.triangles.size() - 200);
    BuildOptions options;
    options.depth = 6;
    std::vector<double> first;
    for (const int threads : {1, 2}) {
        options.run.threads = threads;
        const ThinShell shell = build(open, options);
        std::vector<double> values;
        for (int i = 0; i < 1000; ++i)
            values.push_back(shell.value({0.003 * i - 1.5, 0.0017 * i - 0.8, 1.1 - 0.002 * i}));
        if (first.empty()) first = values;
        EXPECT_EQ(first, values);
    }
}

TEST(Meaning, RealMeshesHaveTheRightRule) {
    const auto files = zoo::real_mesh_files();
    if (files.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    const auto rule_of = [](const std::string& file) {
        for (const char* open : {"stanford-bunny", "lilium", "63465", "modelnet_chair", "Spider"})
            if (file.find(open) != std::string::npos) return SignRule::generalized;
        for (const char* none : {"truck", "soup", "circle", "moebius", "single_triangle"})
            if (file.find(none) != std::string::npos) return SignRule::unsigned_rule;
        return SignRule::winding;
    };
    for (const std::string& file : files) {
        const MeshReport report = inspect(read_mesh(file).mesh);
        EXPECT_EQ(report.sign, rule_of(file)) << file << ": " << report.sign_reason;
        bool turns = false;  // Spider: four triangles that disagree with those around them
        for (const char* name : {"boeing", "inverted", "Spider"}) turns |= file.find(name) != std::string::npos;
        EXPECT_EQ(report.turned > 0, turns) << file << ": " << report.sign_reason;
    }
}

}  // namespace
}  // namespace its
