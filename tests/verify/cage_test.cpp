#include "its/verify_cage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "geometry/triangle_pair.h"
#include "its/wrap.h"
#include "octree/lattice.h"
#include "support/zoo.h"
#include "verify/pairs.h"

// The checker of cages: it passes what is right, and sees each thing that is wrong.

namespace its {
namespace {

using testing::IsEmpty;
using testing::UnorderedElementsAre;

std::vector<std::string> failed_checks(const Mesh& cage, const Mesh& mesh,
                                       const VerifyCageOptions& options = {}) {
    std::vector<std::string> names;
    const VerifyCageReport report = verify_cage(cage, mesh, options);
    for (const VerifyCheck& check : report.checks)
        if (!check.passed) names.push_back(check.name);
    EXPECT_EQ(report.passed(), names.empty());
    return names;
}

double longest_side(const Mesh& mesh) {
    const Box box = octree::bounds(mesh);
    return std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
}

TEST(VerifyCage, PassesWrapsOfEveryMeshWithTheirBounds) {
    for (const zoo::Entry& entry : zoo::all()) {
        const double side = longest_side(entry.mesh);
        if (!(side > 0)) continue;
        for (const WrapSide where : {WrapSide::outer, WrapSide::inner}) {
            SCOPED_TRACE(entry.name + " " + std::string(name(where)));
            const WrapOptions wrapping{.clearance = 0.03 * side, .slack = 0.06 * side, .side = where};
            const Wrap result = wrap(entry.mesh, wrapping);
            // Inside, M must face outward.
            const bool turned = entry.name == "inside_out_sphere" || !entry.closed_oriented;
            if (result.report.empty || (where == WrapSide::inner && turned)) continue;
            VerifyCageOptions options;
            options.inner = where == WrapSide::inner;
            options.clearance = wrapping.clearance;
            options.distance = wrapping.clearance + wrapping.slack;
            EXPECT_THAT(failed_checks(result.mesh, entry.mesh, options), IsEmpty());
            const VerifyCageReport report = verify_cage(result.mesh, entry.mesh);
            EXPECT_EQ(report.cage_components, result.report.components);
            EXPECT_LE(report.farthest, 1.01 * result.report.highest);
        }
    }
}

TEST(VerifyCage, KnowsTheDistancesOfBoxes) {
    const Mesh small = zoo::box({0, 0, 0}, {1, 1, 1}), large = zoo::box({-1, -2, -3}, {2, 3, 4});
    const VerifyCageReport report = verify_cage(large, small);
    EXPECT_TRUE(report.passed());
    EXPECT_LE(report.nearest, 1);
    EXPECT_GE(report.nearest, 1 - 1e-12);
    EXPECT_GE(report.farthest, std::sqrt(14.0));
    EXPECT_LE(report.farthest, 1.001 * std::sqrt(14.0));
    VerifyCageOptions inner{.inner = true};
    EXPECT_THAT(failed_checks(small, large, inner), IsEmpty());
    EXPECT_THAT(failed_checks(large, small, inner), UnorderedElementsAre("enclosed"));
    EXPECT_THAT(failed_checks(small, large), UnorderedElementsAre("enclosing"));
    EXPECT_THAT(failed_checks(large, small, {.clearance = 1.01}), UnorderedElementsAre("clearance"));
    EXPECT_THAT(failed_checks(large, small, {.distance = 3.7}), UnorderedElementsAre("distance"));
    EXPECT_THAT(failed_checks(large, small, {.clearance = 0.999, .distance = 3.75}), IsEmpty());
}

TEST(VerifyCage, SizesDoNotMatter) {
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const Mesh small = zoo::sphere({0, 0, 0}, 1, 1), large = zoo::sphere({0, 0, 0}, 2, 1);
    const VerifyCageReport one = verify_cage(large, small);
    for (const int exponent : {-600, -200, 200, 600}) {
        const double scale = std::ldexp(1.0, exponent);
        const VerifyCageReport other = verify_cage(zoo::transformed(large, identity, {0, 0, 0}, scale),
                                                   zoo::transformed(small, identity, {0, 0, 0}, scale));
        EXPECT_TRUE(other.passed());
        EXPECT_NEAR(other.nearest / scale, one.nearest, 1e-12);
        EXPECT_NEAR(other.farthest / scale, one.farthest, 1e-12);
    }
}

/// Of features so small that squares of their sizes underflow, beside coordinates of ordinary size.
TEST(VerifyCage, BoundsHoldForTheTiniestFeatures) {
    const Mesh box = zoo::box({-3, -3, -8}, {3, 3, 1});
    for (const double tiny : {4.5e-163, 1e-160, 1e-200, 5e-324, 1e-100}) {
        const Mesh needle{{{0, 0, 0}, {tiny, 0, 0}, {0, 0, -5}}, {{0, 1, 2}}};
        const VerifyCageReport report = verify_cage(box, needle);
        EXPECT_LE(report.nearest, 1) << tiny;
        EXPECT_GE(report.nearest, 0.999) << tiny;
    }
    const Mesh spike{{{2, 0, 0}, {-1, 2, 0}, {-1, -2, 0}, {0, 0, 10}, {0, 0, -1}},
                     {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {1, 0, 4}, {2, 1, 4}, {0, 2, 4}}};
    for (const double tiny : {1.26e-81, 1e-80, 1e-160, 1e-300, 5e-324, 1e-30}) {
        const Mesh micro{{{0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}}, {{0, 1, 2}}};
        const VerifyCageReport report = verify_cage(spike, micro);
        EXPECT_GE(report.farthest, 10 - tiny) << tiny;
        EXPECT_LE(report.farthest, 10.01) << tiny;
    }
}

/// Where corners of a triangle are one, the shortest way from its inside is found all the same.
TEST(VerifyCage, WhichCornersAreOneDoesNotMatter) {
    const std::vector<Vec3> ends = {{-2, 0.3, 0}, {2, -0.3, 0}};
    Mesh dent = zoo::box({-3, -3, -3}, {3, 3, 3});
    for (const Triangle& t : {Triangle{0, 0, 1}, Triangle{0, 1, 0}, Triangle{1, 0, 0}, Triangle{0, 1, 1},
                              Triangle{1, 0, 1}, Triangle{1, 1, 0}}) {
        const VerifyCageReport report = verify_cage(dent, Mesh{ends, {t}});
        EXPECT_GE(report.nearest, 1 - 1e-9);
        EXPECT_LE(report.nearest, 1);
    }
    for (Vec3& v : dent.vertices)
        if (v.z > 0) v.z = 3 + 0.3 * v.x + 0.1 * v.y;
    const auto v = std::uint32_t(dent.vertices.size());
    dent.vertices.push_back({0, 0, 1});  // a dent towards the middle of the segment
    std::vector<Triangle> triangles;
    for (const Triangle& t : dent.triangles) {
        const bool top = dent.vertices[t[0]].z > 0 && dent.vertices[t[1]].z > 0 && dent.vertices[t[2]].z > 0;
        if (!top) {
            triangles.push_back(t);
            continue;
        }
        triangles.push_back({t[0], t[1], v});
        triangles.push_back({t[1], t[2], v});
        triangles.push_back({t[2], t[0], v});
    }
    const std::vector<Triangle> all = triangles;
    std::erase_if(triangles, [&](const Triangle& t) {  // the diagonal, both ways
        return std::ranges::count_if(all, [&](const Triangle& o) {
                   return o[2] == v && t[2] == v && o[0] == t[1] && o[1] == t[0];
               }) > 0;
    });
    dent.triangles = triangles;
    const VerifyCageReport reference = verify_cage(dent, Mesh{ends, {{0, 1, 1}}});
    const VerifyCageReport other = verify_cage(dent, Mesh{ends, {{0, 0, 1}}});
    EXPECT_GT(reference.nearest, 0.99);
    EXPECT_NEAR(other.nearest, reference.nearest, 1e-9);
}

TEST(VerifyCage, SeesWhatIsWrong) {
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 2), cage = zoo::sphere({0, 0, 0}, 2, 2);
    EXPECT_THAT(failed_checks(cage, ball), IsEmpty());
    Mesh wrong = cage;
    wrong.triangles.pop_back();
    EXPECT_THAT(failed_checks(wrong, ball), testing::Contains("closed"));
    wrong = cage;
    std::swap(wrong.triangles[5][0], wrong.triangles[5][1]);
    EXPECT_THAT(failed_checks(wrong, ball), testing::Contains("closed"));
    wrong = cage;
    wrong.triangles.push_back(wrong.triangles[3]);
    EXPECT_THAT(failed_checks(wrong, ball), testing::Contains("closed"));
    EXPECT_THAT(failed_checks(zoo::reversed(cage), ball), UnorderedElementsAre("enclosing"));
    wrong = cage;
    for (double* x : {&wrong.vertices[0].x, &wrong.vertices[0].y, &wrong.vertices[0].z}) *x *= 0.3;
    EXPECT_THAT(failed_checks(wrong, ball), testing::Contains("disjoint"));
    wrong = cage;
    for (double* x : {&wrong.vertices[0].x, &wrong.vertices[0].y, &wrong.vertices[0].z}) *x *= -1.5;
    EXPECT_THAT(failed_checks(wrong, ball), testing::Contains("no self-intersections"));
    // Each part must be enclosed, and once.
    const Mesh two = zoo::joined(ball, zoo::sphere({5, 0, 0}, 0.5, 1));
    EXPECT_THAT(failed_checks(cage, two), UnorderedElementsAre("enclosing"));
    EXPECT_THAT(failed_checks(zoo::joined(cage, zoo::sphere({0, 0, 0}, 3, 2)), ball),
                UnorderedElementsAre("enclosing"));
    // Two that touch in a vertex.
    const Mesh left = zoo::box({-2, -2, -2}, {2, 2, 2}), right = zoo::box({2, 2, 2}, {3, 3, 3});
    EXPECT_THAT(failed_checks(zoo::joined(left, right), ball), testing::Contains("2-manifold"));
    // Two that touch in a face, and in a point within faces.
    EXPECT_THAT(failed_checks(zoo::joined(left, zoo::box({2, -1, -1}, {3, 1, 1})), ball),
                UnorderedElementsAre("no self-intersections"));
    Mesh spike = zoo::tetrahedron();
    for (Vec3& v : spike.vertices) v.x += 3;
    spike.vertices[0] = {2, 0.25, 0.125};
    EXPECT_THAT(failed_checks(zoo::joined(left, spike), ball), testing::Contains("no self-intersections"));
    // An inner cage needs an inside.
    EXPECT_THAT(failed_checks(zoo::sphere({0, 0, 5}, 0.1, 1), zoo::sheet(3), {.inner = true}),
                UnorderedElementsAre("mesh closed", "enclosed"));
}

TEST(VerifyCage, RefusesWhatItCannotRead) {
    const Mesh box = zoo::box({0, 0, 0}, {1, 1, 1});
    EXPECT_THROW(verify_cage(Mesh{}, box), InputError);
    EXPECT_THROW(verify_cage(box, Mesh{}), InputError);
    Mesh wrong = box;
    wrong.triangles[0][0] = 99;
    EXPECT_THROW(verify_cage(wrong, box), InputError);
    wrong = box;
    wrong.vertices[0].x = NAN;
    EXPECT_THROW(verify_cage(box, wrong), InputError);
    EXPECT_THROW(verify_cage(box, box, {.clearance = -1}), OptionError);
    EXPECT_THROW(verify_cage(box, box, {.clearance = 2, .distance = 1}), OptionError);
}

// Small whole numbers: all that can be degenerate is.
TEST(VerifyCagePairs, AgreeWithTheLibrarysOwnTest) {
    std::mt19937_64 random(5);
    std::uniform_int_distribution<int> small(0, 3);
    const auto point = [&] {
        return Vec3{double(small(random)), double(small(random)), double(small(random))};
    };
    int met = 0, shared = 0;
    for (int i = 0; i < 100'000; ++i) {
        const verifier::Corners s{point(), point(), point()}, t{point(), point(), point()};
        if (verifier::is_degenerate(s) || verifier::is_degenerate(t)) continue;
        geometry::NumberedTriangle ns{{0, 1, 2}, s}, nt{{3, 4, 5}, t};
        ASSERT_EQ(verifier::meet(s, t), geometry::intersect(ns, nt));
        met += verifier::meet(s, t);
        int common = 0;
        for (std::uint32_t a = 0; a < 3; ++a)
            for (std::uint32_t b = 0; b < 3; ++b)
                if (s[a] == t[b]) nt.number[b] = a, ++common;
        if (common == 3) continue;
        ASSERT_EQ(verifier::meet_beside_shared(s, t), geometry::intersect(ns, nt)) << common;
        shared += common > 0;
    }
    EXPECT_GT(met, 1000);
    EXPECT_GT(shared, 1000);
}

}  // namespace
}  // namespace its
