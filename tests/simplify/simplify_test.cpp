#include "its/simplify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "simplify/brute_force.h"
#include "support/zoo.h"

namespace its {
namespace {

using testing::HasSubstr;
using testing::Le;
using testing::ThrowsMessage;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// All distances from points of one mesh to the other, by brute force.
double sampled_distance(const Mesh& from, const Mesh& to, int count) {
    double worst = 0;
    brute_force::for_points(from, count, 7,
                            [&](const Vec3& p) { worst = std::max(worst, brute_force::distance(p, to)); });
    return worst * (1 - 1e-12);  // the rounding of brute force
}

/// What must not change, and must be in order.
void expect_same_topology(const Mesh& mesh, const Mesh& result) {
    const MeshReport before = inspect(mesh), after = inspect(result);
    EXPECT_EQ(after.euler, before.euler);
    EXPECT_EQ(after.components, before.components);
    EXPECT_EQ(after.closed, before.closed);
    EXPECT_EQ(after.oriented, before.oriented);
    EXPECT_LE(after.boundary_edges, before.boundary_edges);
    EXPECT_EQ(after.boundary_edges == 0, before.boundary_edges == 0);
    EXPECT_LE(after.nonmanifold_edges, before.nonmanifold_edges);
    EXPECT_LE(after.duplicate, before.duplicate);
}

std::vector<zoo::Entry> manifold_zoo() {
    std::vector<zoo::Entry> entries;
    for (const zoo::Entry& entry : zoo::all())
        if (const MeshReport r = inspect(entry.mesh); r.nonmanifold_edges == 0 && r.duplicate == 0)
            entries.push_back(entry);
    return entries;
}

double diagonal(const Mesh& mesh) {
    const Box box = inspect(mesh).bounds;
    return norm(box.max - box.min);
}

TEST(Simplify, ToleranceHoldsBothWaysOnTheZoo) {
    for (const zoo::Entry& entry : zoo::all()) {
        SCOPED_TRACE(entry.name);
        if (entry.mesh.triangles.size() > 1500 || diagonal(entry.mesh) == 0) continue;
        for (const double relative : {0.002, 0.02}) {
            const double tolerance = relative * diagonal(entry.mesh);
            const Simplified s = simplify(entry.mesh, {.tolerance = tolerance});
            EXPECT_EQ(s.report.stop, SimplifyStop::tolerance_reached);
            EXPECT_EQ(s.report.proven_bound, tolerance);
            EXPECT_LE(s.report.faces_after, s.report.faces_before);
            EXPECT_EQ(s.report.faces_after, s.mesh.triangles.size());
            EXPECT_LE(sampled_distance(entry.mesh, s.mesh, 1000), tolerance);
            EXPECT_LE(sampled_distance(s.mesh, entry.mesh, 1000), tolerance);
            expect_same_topology(entry.mesh, s.mesh);
        }
    }
}

TEST(Simplify, AFlatSheetNeedsFewTriangles) {
    const Simplified s = simplify(zoo::sheet(20), {.tolerance = 1e-6});
    EXPECT_LE(s.report.faces_after, 12u);  // 2 are enough; the order of collapses may leave a few more
    EXPECT_LE(sampled_distance(zoo::sheet(20), s.mesh, 1000), 1e-6);
}

TEST(Simplify, ABoxKeepsItsCorners) {
    // Every face of the cube in 8 × 8 quads.
    Mesh mesh;
    const int n = 8;
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    const auto corner = [&](int u, int v) {
                        Vec3 p;
                        p[axis] = side;
                        p[(axis + 1) % 3] = double(u) / n;
                        p[(axis + 2) % 3] = double(v) / n;
                        mesh.vertices.push_back(p);
                        return std::uint32_t(mesh.vertices.size() - 1);
                    };
                    const std::uint32_t a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1),
                                        d = corner(i, j + 1);
                    mesh.triangles.push_back(side == 1 ? Triangle{a, b, c} : Triangle{a, c, b});
                    mesh.triangles.push_back(side == 1 ? Triangle{a, c, d} : Triangle{a, d, c});
                }
    const Simplified s = simplify(mesh, {.tolerance = 1e-4});
    EXPECT_EQ(s.report.faces_before, 768u);
    EXPECT_EQ(s.report.vertices_before, 386u);  // identical coordinates are one vertex
    EXPECT_LE(s.report.faces_after, 20u);
    EXPECT_LE(sampled_distance(mesh, s.mesh, 2000), 1e-4);
}

TEST(Simplify, CertifiedResultsStayInTheShell) {
    for (const zoo::Entry& entry : manifold_zoo()) {
        SCOPED_TRACE(entry.name);
        if (entry.mesh.triangles.size() > 20000 || diagonal(entry.mesh) == 0) continue;
        const ThinShell shell = build(entry.mesh, {.depth = 5});
        const Simplified s = simplify(entry.mesh, {.depth = 5});
        ASSERT_TRUE(s.report.shell.has_value());
        EXPECT_TRUE(s.report.in_shell);
        EXPECT_EQ(s.report.shell->epsilon_outer, shell.info().epsilon_outer);
        double least = 0, most = 0;
        brute_force::for_points(s.mesh, 100'000, 3, [&](const Vec3& p) {
            least = std::min(least, shell.value(p));
            most = std::max(most, shell.value(p));
        });
        EXPECT_GE(least, shell.info().epsilon_inner);
        EXPECT_LE(most, shell.info().epsilon_outer);
        expect_same_topology(entry.mesh, s.mesh);
    }
}

TEST(Simplify, ReachesTheFaceCountWithAProvenBound) {
    const Mesh mesh = zoo::sphere({1, 2, 3}, 2, 4);
    const Simplified plain = simplify(mesh, {.method = SimplifyMethod::qem, .faces = 300});
    const Simplified s = simplify(mesh, {.faces = 300});
    EXPECT_EQ(s.report.stop, SimplifyStop::faces_reached);
    EXPECT_EQ(s.report.faces_after, 300u);
    EXPECT_EQ(plain.report.faces_after, 300u);
    EXPECT_FALSE(plain.report.proven_bound.has_value());
    ASSERT_TRUE(s.report.proven_bound.has_value());
    const double error = std::max(sampled_distance(mesh, s.mesh, 1000), sampled_distance(s.mesh, mesh, 1000));
    EXPECT_LE(error, *s.report.proven_bound);
    EXPECT_GE(error, 0.3 * *s.report.proven_bound);  // and the bound says something
}

TEST(Simplify, ACountOutOfReachStillHasABound) {
    // Seven vertices would do for a torus (Möbius, Császár), but collapses hardly find them.
    const Mesh mesh = zoo::torus(1.0, 0.35, 48, 20);
    const Simplified result = simplify(mesh, {.faces = 14});
    EXPECT_NE(result.report.stop, SimplifyStop::faces_reached);
    ASSERT_TRUE(result.report.proven_bound);
    EXPECT_LE(*result.report.proven_bound, norm(Vec3{2.7, 2.7, 0.7}));
    EXPECT_LE(mesh_distance(mesh, result.mesh).max, *result.report.proven_bound);
    EXPECT_LE(mesh_distance(result.mesh, mesh).max, *result.report.proven_bound);
}

TEST(Simplify, AFaceCountIsNeverWorseThanQuadricsAlone) {
    // Down to counts with which hardly a collapse can be proven on its own.
    std::uint64_t taken = 0;
    for (const Mesh& mesh : {zoo::plate(0.02), zoo::torus(1.0, 0.35, 48, 20), zoo::box({0, 0, 0}, {1, 2, 3}),
                             zoo::sphere({0, 0, 0}, 1, 4)}) {
        for (const std::uint64_t faces : {24, 40, 60}) {
            if (faces >= mesh.triangles.size()) continue;
            const Simplified ours = simplify(mesh, {.faces = faces});
            const Simplified quadrics = simplify(mesh, {.method = SimplifyMethod::qem, .faces = faces});
            const double bound = *ours.report.proven_bound;
            for (const auto& [from, to] :
                 {std::pair<const Mesh*, const Mesh*>{&mesh, &ours.mesh}, {&ours.mesh, &mesh}})
                EXPECT_LE(mesh_distance(*from, *to).max, bound);
            taken += ours.mesh.vertices == quadrics.mesh.vertices ? 1 : 0;
            const double theirs =
                std::max(mesh_distance(mesh, quadrics.mesh).max, mesh_distance(quadrics.mesh, mesh).max);
            if (ours.report.stop == SimplifyStop::faces_reached) {
                EXPECT_LE(std::max(mesh_distance(mesh, ours.mesh).max, mesh_distance(ours.mesh, mesh).max),
                          1.06 * theirs + 1e-12);
            }
        }
    }
    EXPECT_GT(taken, 0u);  // or this test shows nothing
}

TEST(Simplify, FaceCountToleranceAndShellTogether) {
    const Mesh mesh = zoo::torus(1, 0.4, 40, 20);
    const double tolerance = 0.05;
    const Simplified s = simplify(mesh, {.faces = 40, .tolerance = tolerance, .depth = 6});
    EXPECT_GT(s.report.faces_after, 40u);
    EXPECT_EQ(s.report.stop, SimplifyStop::tolerance_reached);
    EXPECT_TRUE(s.report.in_shell);
    ASSERT_TRUE(s.report.proven_bound.has_value());
    EXPECT_THAT(*s.report.proven_bound, Le(tolerance));
    EXPECT_LE(sampled_distance(mesh, s.mesh, 3000), *s.report.proven_bound);
}

TEST(Simplify, ThePapersWays) {
    const Mesh mesh = zoo::torus(1, 0.4, 60, 30);
    const ThinShell shell = build(mesh, {.depth = 5});
    const Simplified few = simplify(mesh, {.method = SimplifyMethod::vertex, .faces = 100});
    EXPECT_EQ(few.report.stop, SimplifyStop::faces_reached);
    EXPECT_LE(few.report.faces_after, 100u);
    ASSERT_GT(few.report.shell->thickness_asked, 0);
    const auto faces_in = [&](double thickness) {
        return simplify(mesh, {.method = SimplifyMethod::vertex, .faces = 100, .thickness = thickness})
            .report.faces_after;
    };
    EXPECT_LE(faces_in(few.report.shell->thickness_asked), 100u);
    EXPECT_GT(faces_in(0.5 * few.report.shell->thickness_asked), 100u);
    const Simplified vertex = simplify(mesh, {.method = SimplifyMethod::vertex, .depth = 5});
    EXPECT_EQ(vertex.report.stop, SimplifyStop::shell_reached);
    EXPECT_LT(vertex.report.faces_after, mesh.triangles.size() / 2);
    for (const Vec3& v : vertex.mesh.vertices) {
        EXPECT_LE(shell.value(v), shell.info().epsilon_outer);
        EXPECT_GE(shell.value(v), shell.info().epsilon_inner);
    }
    // A large γ keeps vertices at f = 0 that quadrics alone put off the surface.
    const auto worst = [&](const Mesh& m) {
        double f = 0;
        for (const Vec3& v : m.vertices) f = std::max(f, std::abs(shell.value(v)));
        return f;
    };
    const Simplified weak =
        simplify(mesh, {.method = SimplifyMethod::priority, .faces = 100, .depth = 5, .gamma = 0});
    const Simplified strong =
        simplify(mesh, {.method = SimplifyMethod::priority, .faces = 100, .depth = 5, .gamma = 1e4});
    const Simplified plain = simplify(mesh, {.method = SimplifyMethod::qem, .faces = 100});
    EXPECT_EQ(weak.mesh.vertices, plain.mesh.vertices);
    EXPECT_EQ(strong.report.faces_after, 100u);
    EXPECT_LT(worst(strong.mesh), worst(weak.mesh));
}

TEST(Simplify, EveryMethodOnEveryMesh) {
    for (const zoo::Entry& entry : zoo::all())
        for (const SimplifyMethod method : {SimplifyMethod::certified, SimplifyMethod::vertex,
                                            SimplifyMethod::priority, SimplifyMethod::qem}) {
            SCOPED_TRACE(entry.name);
            if (entry.mesh.triangles.size() > 20000) continue;
            SimplifyOptions options;
            options.method = method;
            options.faces = entry.mesh.triangles.size();
            EXPECT_EQ(simplify(entry.mesh, options).report.faces_after, entry.mesh.triangles.size());
            try {
                options.faces = entry.mesh.triangles.size() / 4 + 1;
                const Simplified s = simplify(entry.mesh, options);
                expect_same_topology(entry.mesh, s.mesh);
                EXPECT_LE(s.report.faces_after, entry.mesh.triangles.size());
            } catch (const OptionError& error) {
                EXPECT_THAT(error.what(), HasSubstr("topology"));
            }
        }
}

TEST(Simplify, NonManifoldPartsStay) {
    // Two tetrahedra over one common edge: four triangles meet there.
    Mesh mesh = zoo::tetrahedron();
    mesh.vertices.insert(mesh.vertices.end(), {{-1, 0, 0}, {0, 0, -1}});
    mesh.triangles.insert(mesh.triangles.end(), {{0, 4, 2}, {0, 2, 5}, {0, 5, 4}, {2, 4, 5}});
    ASSERT_GT(inspect(mesh).nonmanifold_edges, 0u);
    const Simplified s = simplify(mesh, {.tolerance = 10});
    const auto kept = [&](const Vec3& p) {
        return std::find(s.mesh.vertices.begin(), s.mesh.vertices.end(), p) != s.mesh.vertices.end();
    };
    EXPECT_TRUE(kept(mesh.vertices[0]));
    EXPECT_TRUE(kept(mesh.vertices[2]));
    EXPECT_EQ(inspect(s.mesh).euler, inspect(mesh).euler);
}

TEST(Simplify, UnitsDoNotMatter) {
    const Mesh mesh = zoo::twisted_knot(120, 20);
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (const double factor : {0x1p10, 0x1p-20}) {
        const Mesh scaled = zoo::transformed(mesh, identity, {}, factor);
        const auto expect_same = [&](SimplifyOptions options) {
            const Simplified s = simplify(mesh, options);
            if (options.tolerance) options.tolerance = factor * *options.tolerance;
            const Simplified t = simplify(scaled, options);
            EXPECT_EQ(t.mesh.triangles, s.mesh.triangles);
            ASSERT_EQ(t.mesh.vertices.size(), s.mesh.vertices.size());
            for (std::size_t i = 0; i < s.mesh.vertices.size(); ++i)
                EXPECT_EQ(t.mesh.vertices[i], factor * s.mesh.vertices[i]);
        };
        expect_same({.tolerance = 0.01 * diagonal(mesh)});
        expect_same({.faces = 1000});
        expect_same({.faces = 1000, .depth = 5});
        expect_same({.method = SimplifyMethod::priority, .faces = 1000, .depth = 5});
        expect_same({.method = SimplifyMethod::qem, .faces = 1000});
    }
}

TEST(Simplify, SameResultForAnyThreads) {
    const Mesh mesh = zoo::twisted_knot(120, 20);
    const Simplified one = simplify(mesh, {.faces = 800, .depth = 5, .run = {.threads = 1}});
    const Simplified two = simplify(mesh, {.faces = 800, .depth = 5, .run = {.threads = 2}});
    EXPECT_EQ(one.mesh.vertices, two.mesh.vertices);
    EXPECT_EQ(one.mesh.triangles, two.mesh.triangles);
}

TEST(Simplify, SinglePrecisionIsProvenToo) {
    const Mesh mesh = zoo::sphere({1e3, 1e3, 1e3}, 1, 3);
    const double tolerance = 0.02;
    const Simplified s = simplify(mesh, {.tolerance = tolerance, .coordinates = Coordinates::single});
    EXPECT_LT(s.report.faces_after, mesh.triangles.size());
    for (const Vec3& v : s.mesh.vertices)
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_EQ(std::fmod(v[axis], 0x1p-14), 0);  // 24 bits of a number below 2¹⁰
    EXPECT_LE(sampled_distance(mesh, s.mesh, 3000), tolerance);
    EXPECT_LE(sampled_distance(s.mesh, mesh, 3000), tolerance);
}

TEST(Simplify, NumbersAboutACentreAreProvenToo) {
    const Mesh mesh = zoo::sphere({1e6, -1e6, 3e5}, 1, 3);  // where 32-bit numbers are 1/16 apart
    const double tolerance = 0.02;
    const Simplified s = simplify(mesh, {.tolerance = tolerance, .coordinates = Coordinates::single_offset});
    EXPECT_LT(s.report.faces_after, mesh.triangles.size());
    EXPECT_NE(s.report.origin, Vec3{});
    for (const Vec3& v : s.mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) {
            const double offset = v[axis] - s.report.origin[axis];
            EXPECT_EQ(double(float(offset)), offset);
            EXPECT_EQ(s.report.origin[axis] + offset, v[axis]);
        }
    EXPECT_LE(sampled_distance(mesh, s.mesh, 3000), tolerance);
    EXPECT_LE(sampled_distance(s.mesh, mesh, 3000), tolerance);
}

TEST(Simplify, RefusesWhatCannotBe) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1, 3);
    const auto refuses = [&](const SimplifyOptions& options, const char* text) {
        EXPECT_THAT([&] { simplify(mesh, options); }, ThrowsMessage<OptionError>(HasSubstr(text)));
    };
    refuses({.tolerance = 0.0}, "tolerance 0");
    refuses({.tolerance = -1.0}, "tolerance -1");
    refuses({.tolerance = nan}, "tolerance nan");
    refuses({.tolerance = 1e-15}, "below what the mesh's coordinates can resolve");
    refuses({.tolerance = 1e-5, .depth = 3}, "a shell of depth 3 cannot reach it");
    refuses({.method = SimplifyMethod::qem, .faces = 100, .tolerance = 0.1}, "qem proves no distance");
    refuses({.method = SimplifyMethod::qem}, "needs a number of faces");
    refuses({.method = SimplifyMethod::priority}, "needs a number of faces");
    refuses({.method = SimplifyMethod::qem, .faces = 100, .depth = 4}, "uses no shell");
    refuses({.method = SimplifyMethod::qem, .faces = 100, .thickness = 0.1}, "uses no shell");
    refuses({.depth = 4, .thickness = 0.1}, "one of them");
    refuses({.thickness = -1}, "thickness -1");
    refuses({.faces = 0}, "faces 0");
    refuses({.faces = 3}, "needs at least 4");
    refuses({.depth = 99}, "depth 99");
    refuses({.method = SimplifyMethod::priority, .faces = 100, .gamma = -1}, "gamma -1");
    refuses({.faces = 100, .run = {.threads = -1}}, "threads -1");
    EXPECT_THAT([] { simplify(zoo::torus(1, 0.4, 20, 10), {.faces = 13}); },
                ThrowsMessage<OptionError>(HasSubstr("needs at least 14")));
    EXPECT_THROW(simplify({}, {.faces = 10}), InputError);
    EXPECT_THROW(simplify(Mesh{{{0, 0, 0}, {1, 0, 0}, {nan, 1, 0}}, {{0, 1, 2}}}, {.faces = 10}), InputError);
    EXPECT_THROW(simplify(Mesh{{{0, 0, 0}}, {{0, 1, 2}}}, {.faces = 10}), InputError);
    EXPECT_THROW(simplify(zoo::overlapping_spheres(3), {.faces = 100, .no_self_intersections = true}),
                 InputError);
}

TEST(Simplify, CanBeStopped) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1, 5);
    int calls = 0;
    EXPECT_THROW(simplify(mesh, {.tolerance = 0.01,
                                 .run = {.progress = [&](std::string_view, double) { return ++calls < 3; }}}),
                 Cancelled);
    EXPECT_EQ(calls, 3);
}

TEST(SlowSimplify, RealMeshesKeepEveryPromise) {
    for (const std::string& file : zoo::real_mesh_files()) {
        SCOPED_TRACE(file);
        const Mesh mesh = read_mesh(file).mesh;
        if (diagonal(mesh) == 0) continue;
        const double tolerance = 0.002 * diagonal(mesh);
        const Simplified s = simplify(mesh, {.tolerance = tolerance});
        EXPECT_LE(mesh_distance(mesh, s.mesh, 300'000).max, tolerance);
        EXPECT_LE(mesh_distance(s.mesh, mesh, 300'000).max, tolerance);
        expect_same_topology(mesh, s.mesh);
        const ThinShell shell = build(mesh, {.depth = 6});
        const Simplified in_shell = simplify(mesh, {.depth = 6});
        double least = 0, most = 0;
        brute_force::for_points(in_shell.mesh, 1'000'000, 5, [&](const Vec3& p) {
            const double f = shell.value(p);
            least = std::min(least, f);
            most = std::max(most, f);
        });
        EXPECT_GE(least, shell.info().epsilon_inner);
        EXPECT_LE(most, shell.info().epsilon_outer);
    }
}

TEST(SlowSimplify, HausdorffDistanceBelowThatOfQuadrics) {
    std::vector<double> ratios;
    for (const std::string& file : zoo::real_mesh_files()) {
        SCOPED_TRACE(file);
        const Mesh mesh = read_mesh(file).mesh;
        if (mesh.triangles.size() < 5000 || mesh.triangles.size() > 120'000) continue;
        const std::uint64_t faces = mesh.triangles.size() / 25;
        try {
            const Simplified plain = simplify(mesh, {.method = SimplifyMethod::qem, .faces = faces});
            if (plain.report.faces_after > faces + 1) continue;
            const Simplified s = simplify(mesh, {.faces = plain.report.faces_after});
            if (s.report.faces_after > plain.report.faces_after) continue;
            const auto error = [&](const Mesh& m) {
                return std::max(mesh_distance(mesh, m, 200'000).max, mesh_distance(m, mesh, 200'000).max);
            };
            const double ratio = error(s.mesh) / error(plain.mesh);
            EXPECT_LE(ratio, 1.0);
            ratios.push_back(ratio);
        } catch (const OptionError& e) {
            EXPECT_THAT(e.what(), HasSubstr("topology"));
        }
    }
    if (ratios.empty()) GTEST_SKIP() << "no real meshes";
    std::sort(ratios.begin(), ratios.end());
    EXPECT_LE(ratios[ratios.size() / 2], 0.7);
}

}  // namespace
}  // namespace its
