// The defect report, and the generated meshes that all tests build on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "its/inspect.h"
#include "mesh/point_index.h"
#include "support/zoo.h"

namespace its {
namespace {

using testing::HasSubstr;

TEST(Inspect, TheZooIsWhatItSays) {
    for (const zoo::Entry& entry : zoo::all()) {
        const MeshReport report = inspect(entry.mesh);
        EXPECT_EQ(report.sign == SignRule::winding, entry.closed_oriented)
            << entry.name << ": " << report.sign_reason;
        EXPECT_EQ(report.triangles, entry.mesh.triangles.size());
        if (entry.closed_oriented) {
            EXPECT_TRUE(report.closed && report.oriented) << entry.name;
            EXPECT_EQ(report.signed_volume < 0, entry.name == "inside_out_sphere") << entry.name;
        }
    }
}

TEST(Inspect, KnownShapes) {
    const MeshReport box = inspect(zoo::box({-1, -2, -3}, {1, 2, 3}));
    EXPECT_EQ(box.vertices, 8u);
    EXPECT_EQ(box.euler, 2);
    EXPECT_EQ(box.components, 1u);
    EXPECT_DOUBLE_EQ(box.signed_volume, 48);
    EXPECT_EQ(box.bounds.min, (Vec3{-1, -2, -3}));
    EXPECT_EQ(box.bounds.max, (Vec3{1, 2, 3}));
    EXPECT_EQ(inspect(zoo::torus(1, 0.3, 20, 10)).euler, 0);
    EXPECT_EQ(inspect(zoo::twisted_knot(600, 25)).euler, 0);
    const MeshReport hollow = inspect(zoo::hollow_sphere(3));
    EXPECT_EQ(hollow.components, 2u);
    EXPECT_EQ(hollow.euler, 4);
    EXPECT_NEAR(hollow.signed_volume, 4 * 3.14159 / 3 * (1 - 0.6 * 0.6 * 0.6), 0.1);
    const MeshReport strip = inspect(zoo::moebius_strip(40));
    EXPECT_EQ(strip.euler, 0);
    EXPECT_EQ(strip.boundary_edges, 80u);
    EXPECT_EQ(strip.inconsistent_edges, 4u);
    EXPECT_FALSE(strip.oriented);
    const MeshReport sheet = inspect(zoo::sheet(5));
    EXPECT_EQ(sheet.boundary_edges, 20u);
    EXPECT_EQ(sheet.unbalanced_edges, 20u);
    EXPECT_EQ(sheet.euler, 1);
    EXPECT_EQ(sheet.sign, SignRule::unsigned_rule);
    // Few triangles, on the lattice: the hardest for samples.
    for (const Mesh& solid : {zoo::tetrahedron(), zoo::box({0, 0, 0}, {1, 1, 1}), zoo::plate(0.01)}) {
        EXPECT_EQ(inspect(solid).turned, 0u);
        const MeshReport inverted = inspect(zoo::reversed(solid));
        EXPECT_EQ(inverted.turned, solid.triangles.size());
        EXPECT_THAT(inverted.sign_reason, HasSubstr("turned around"));
    }
}

TEST(Inspect, DoesNotDependOnTheOrderOfTriangles) {
    const Mesh mesh = zoo::joined(zoo::torus(1, 0.3, 20, 10), zoo::sheet(4));
    const MeshReport a = inspect(mesh), b = inspect(zoo::shuffled(mesh, 3));
    EXPECT_EQ(a.euler, b.euler);
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.boundary_edges, b.boundary_edges);
    EXPECT_EQ(a.unbalanced_edges, b.unbalanced_edges);
    EXPECT_EQ(a.components, b.components);
    EXPECT_NEAR(a.signed_volume, b.signed_volume, 1e-12);
}

TEST(Inspect, VerticesAtOnePlaceAreOne) {
    Mesh apart;  // a tetrahedron whose triangles share no index, with a −0 among its zeros
    const Mesh whole = zoo::tetrahedron();
    for (const Triangle& t : whole.triangles) {
        const auto first = std::uint32_t(apart.vertices.size());
        for (const std::uint32_t v : t) apart.vertices.push_back(whole.vertices[v]);
        apart.triangles.push_back({first, first + 1, first + 2});
    }
    apart.vertices[0].x = -0.0;
    apart.vertices.push_back({7, 7, 7});  // unused: no part of the surface
    const MeshReport report = inspect(apart);
    EXPECT_EQ(report.vertices, 4u);
    EXPECT_EQ(report.sign, SignRule::winding);
    EXPECT_EQ(report.bounds.max, (Vec3{1, 1, 1}));
}

TEST(Inspect, DegenerateIsExact) {
    const auto degenerate = [](Vec3 a, Vec3 b, Vec3 c) {
        return inspect(Mesh{{a, b, c}, {{0, 1, 2}}}).degenerate;
    };
    EXPECT_EQ(degenerate({0.25, 0.5, 0.75}, {0.5, 1, 1.5}, {0.75, 1.5, 2.25}), 1u);
    EXPECT_EQ(degenerate({0, 0, 0}, {0.1, 0.1, 0.1}, {0.3, 0.3, 0.3}), 1u);
    EXPECT_EQ(degenerate({0, 0, 0}, {0.1, 0.3, 0}, {0.3, 0.9, 0}), 0u)
        << "the doubles next to these decimals are not in proportion";
    EXPECT_EQ(degenerate({0, 0, 0}, {1e-200, 0, 0}, {0, 1e-200, 0}), 0u) << "the product underflows";
    EXPECT_EQ(degenerate({0, 0, 0}, {1e200, 0, 0}, {0, 1e200, 0}), 0u) << "the product overflows";
    EXPECT_EQ(degenerate({1e6, 1e6, 0}, {1e6 + 1, 1e6 + 1, 0}, {1e6 + 2, std::nextafter(1e6 + 2, 2e6), 0}), 0u);
}

TEST(Inspect, CountsDuplicatesAndWhatRunsTheSameWay) {
    Mesh mesh = zoo::tetrahedron();
    mesh.triangles.push_back({mesh.triangles[0][1], mesh.triangles[0][2], mesh.triangles[0][0]});
    MeshReport report = inspect(mesh);
    EXPECT_EQ(report.duplicate, 1u);
    EXPECT_EQ(report.nonmanifold_edges, 3u);
    EXPECT_EQ(report.unbalanced_edges, 3u);
    EXPECT_EQ(report.odd_edges, 3u);
    EXPECT_EQ(report.sign, SignRule::generalized);
    mesh.triangles.push_back(
        {mesh.triangles[0][0], mesh.triangles[0][2], mesh.triangles[0][1]});  // both ways: a cycle again
    report = inspect(mesh);
    EXPECT_EQ(report.duplicate, 2u);
    EXPECT_EQ(report.unbalanced_edges, 0u);
    EXPECT_EQ(report.sign, SignRule::winding);
    mesh = zoo::tetrahedron();
    std::swap(mesh.triangles[0][1], mesh.triangles[0][2]);
    report = inspect(mesh);
    EXPECT_EQ(report.inconsistent_edges, 3u);
    EXPECT_FALSE(report.oriented);
    EXPECT_TRUE(report.closed);
    EXPECT_EQ(report.sign, SignRule::winding) << "repaired";
    EXPECT_EQ(report.turned, 1u);
}

TEST(Inspect, ZeroAreaTrianglesNeitherOpenAMeshNorFailToCloseIt) {
    Mesh mesh = zoo::box({0, 0, 0}, {1, 1, 1});
    mesh.triangles.push_back({0, 0, 1});  // a segment
    const auto middle = std::uint32_t(mesh.vertices.size());
    mesh.vertices.push_back({0.5, 0, 0});
    mesh.triangles.push_back({0, middle, 1});  // a needle on an edge, attached to nothing
    EXPECT_EQ(inspect(mesh).degenerate, 2u);
    EXPECT_EQ(inspect(mesh).sign, SignRule::winding);
    // A T-junction that a needle closes: one triangle at the edge 0 1 is cut at its middle.
    Mesh cut = zoo::box({0, 0, 0}, {1, 1, 1});
    cut.vertices.push_back({0.5, 0, 0});
    bool done = false;
    for (Triangle& t : cut.triangles) {
        for (std::size_t k = 0; k < 3 && !done; ++k) {
            const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
            if (a != 0 || b != 1) continue;
            t = {a, middle, c};
            cut.triangles.push_back({middle, b, c});
            cut.triangles.push_back({a, b, middle});
            done = true;
            break;
        }
        if (done) break;
    }
    ASSERT_TRUE(done);
    EXPECT_EQ(inspect(cut).sign, SignRule::winding);
    cut.triangles.pop_back();
    EXPECT_EQ(inspect(cut).sign, SignRule::winding) << "a point exactly on the edge leaves no gap";
    cut.vertices.back() = {0.5, 0, 0x1p-60};
    EXPECT_EQ(inspect(cut).sign, SignRule::generalized) << "but one beside it does";
}

TEST(Inspect, RefusesWhatIsNoMesh) {
    EXPECT_THROW(inspect({}), InputError);
    EXPECT_THROW(inspect(Mesh{{{0, 0, 0}}, {{0, 0, 1}}}), InputError);
    EXPECT_THROW(inspect(Mesh{{{0, 0, 0}, {1, 0, 0}, {0, NAN, 0}}, {{0, 1, 2}}}), InputError);
    EXPECT_THROW(inspect(Mesh{{{0, 0, 0}, {1, 0, 0}, {0, INFINITY, 0}}, {{0, 1, 2}}}), InputError);
}

TEST(Inspect, NamesOfSignRules) {
    EXPECT_EQ(name(SignRule::winding), "winding");
    EXPECT_EQ(name(SignRule::generalized), "generalized");
    EXPECT_EQ(name(SignRule::unsigned_rule), "unsigned");
    EXPECT_EQ(name(SignRule::even_odd), "even-odd");
}

TEST(PointIndex, AgreesWithAnOrderedMap) {
    mesh::PointIndex index;
    std::vector<Vec3> seen;
    std::uint64_t state = 1;
    for (int i = 0; i < 5000; ++i) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        const auto coordinate = [&](int shift) {
            return double(state >> shift & 7) / 4 - (state >> 40 & 1 ? 0.0 : 1.0);
        };
        const Vec3 p{coordinate(33), coordinate(45), coordinate(51)};
        const auto found = std::find(seen.begin(), seen.end(), p);  // −0 == +0
        const std::uint32_t expected = std::uint32_t(found - seen.begin());
        if (found == seen.end()) seen.push_back(p);
        ASSERT_EQ(index.insert(p), expected);
    }
    EXPECT_EQ(index.points(), seen);
}

}  // namespace
}  // namespace its
