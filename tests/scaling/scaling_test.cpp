#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "geometry/scaling.h"
#include "geometry/vec3.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/query.h"
#include "its/shell.h"
#include "its/simplify.h"
#include "its/surface.h"
#include "its/verify.h"
#include "its/weld.h"
#include "support/zoo.h"

/// A mesh times a power of two has the same answers, times that power, bit for bit, from the least sizes to the
/// largest; or it is refused, by its size.
namespace its {
namespace {

using geometry::times_power;
using testing::HasSubstr;

/// Sizes of 1e±300, of the thresholds of scaling and of squares (2^±512, 2^±537) and of shells (1e±75), and
/// between.
const int exponents[] = {-1000, -900, -541, -537, -512, -250, -102, -101, -100, -99, 1,
                         99,    100,  101,  102,  249,  510,  512,  900,  990,  1000};
const int exponents_of_shells[] = {-230, -102, -101, -99, 1, 99, 101, 102, 230};

Mesh scaled(const Mesh& mesh, int e) {
    Mesh out = mesh;
    for (Vec3& v : out.vertices) v = times_power(v, e);
    return out;
}

/// Coordinates are multiples of 2⁻²⁰ of the largest, so that 1e-300 times them are numbers.
std::vector<zoo::Entry> meshes() {
    std::vector<zoo::Entry> all = zoo::all();
    for (zoo::Entry& entry : all) entry.mesh = zoo::snapped(entry.mesh);
    return all;
}

std::vector<Vec3> points_around(const Mesh& mesh, int count) {
    std::mt19937_64 random(20240);
    std::uniform_real_distribution<double> uniform(-2, 2);
    std::vector<Vec3> points;
    points.reserve(std::size_t(count));
    for (int i = 0; i < count; ++i) points.push_back({uniform(random), uniform(random), uniform(random)});
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 7) points.push_back(mesh.vertices[i]);
    for (int i = 0; i < 8; ++i) points.push_back(std::ldexp(1.0, 10 * i) * points[std::size_t(i)]);
    return points;
}

std::vector<Vec3> scaled(std::vector<Vec3> points, int e) {
    for (Vec3& p : points) p = times_power(p, e);
    return points;
}

void expect_parts(const PartsReport& parts, const PartsReport& of_one, int e) {
    EXPECT_EQ(parts.closed, of_one.closed);
    EXPECT_EQ(parts.nested, of_one.nested);
    EXPECT_EQ(parts.overlapping, of_one.overlapping);
    EXPECT_EQ(parts.to_turn, of_one.to_turn);
    ASSERT_EQ(parts.wrong.size(), of_one.wrong.size());
    for (std::size_t i = 0; i < parts.wrong.size(); ++i) {
        EXPECT_EQ(parts.wrong[i].fault, of_one.wrong[i].fault);
        EXPECT_EQ(parts.wrong[i].first_triangle, of_one.wrong[i].first_triangle);
        EXPECT_EQ(parts.wrong[i].bounds.max, times_power(of_one.wrong[i].bounds.max, e));
        EXPECT_EQ(parts.wrong[i].volume, std::ldexp(of_one.wrong[i].volume, 3 * e));
    }
}

TEST(Scaling, OfTheReportOfAMesh) {
    for (const zoo::Entry& entry : meshes()) {
        const MeshReport one = inspect(entry.mesh);
        const Mesh oriented_one = oriented(entry.mesh), turned_one = turn_parts(entry.mesh);
        for (const int e : exponents) {
            SCOPED_TRACE(entry.name + " times 2^" + std::to_string(e));
            const Mesh mesh = scaled(entry.mesh, e);
            const MeshReport report = inspect(mesh);
            EXPECT_EQ(report.degenerate, one.degenerate);
            EXPECT_EQ(report.duplicate, one.duplicate);
            EXPECT_EQ(report.open_edges, one.open_edges);
            EXPECT_EQ(report.t_junctions, one.t_junctions);
            EXPECT_EQ(report.components, one.components);
            EXPECT_EQ(report.euler, one.euler);
            EXPECT_EQ(report.closed, one.closed);
            EXPECT_EQ(report.sign, one.sign);
            EXPECT_EQ(report.sign_reason, one.sign_reason);
            EXPECT_EQ(report.turned, one.turned);
            EXPECT_EQ(report.separating, one.separating);
            EXPECT_EQ(report.bounds.min, times_power(one.bounds.min, e));
            EXPECT_EQ(report.bounds.max, times_power(one.bounds.max, e));
            EXPECT_EQ(report.signed_volume, std::ldexp(one.signed_volume, 3 * e));
            expect_parts(report.parts, one.parts, e);
            EXPECT_EQ(oriented(mesh).triangles, oriented_one.triangles);
            EXPECT_EQ(oriented(mesh).vertices, mesh.vertices);
            EXPECT_EQ(turn_parts(mesh).triangles, turned_one.triangles);
        }
    }
}

TEST(Scaling, OfClosestPoints) {
    for (const zoo::Entry& entry : meshes()) {
        const std::vector<Vec3> points = points_around(entry.mesh, 100);
        const ClosestPoints one(entry.mesh);
        for (const int e : exponents) {
            SCOPED_TRACE(entry.name + " times 2^" + std::to_string(e));
            const ClosestPoints closest(scaled(entry.mesh, e));
            for (const Vec3& p : points) {
                if (!finite(times_power(p, e))) continue;
                const ClosestPoint a = one.find(p), b = closest.find(times_power(p, e));
                ASSERT_EQ(b.distance, std::ldexp(a.distance, e));
                ASSERT_EQ(b.point, times_power(a.point, e));
                ASSERT_EQ(b.triangle, a.triangle);
                ASSERT_EQ(b.barycentric, a.barycentric);
            }
        }
    }
}

TEST(Scaling, OfSidesByClosestPoints) {
    for (const Mesh& mesh : {zoo::snapped(zoo::torus(1, 0.3, 20, 10)), zoo::snapped(zoo::hollow_sphere(2))}) {
        const std::vector<Vec3> points = points_around(mesh, 200);
        const ClosestSides one(mesh);
        for (const int e : exponents) {
            const ClosestSides sides(scaled(mesh, e));
            for (const Vec3& p : points) {
                if (!finite(times_power(p, e))) continue;
                ASSERT_EQ(sides.side(times_power(p, e)), one.side(p)) << e;
            }
        }
    }
}

/// The least double of that magnitude or more, in any direction.
const Vec3 far_directions[] = {{1, 0, 0}, {0.5, -1, 0.25}, {-0.75, 0.875, 1}};

TEST(Scaling, ClosestPointsOfFarPoints) {
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 3);
    for (const int size : {0, -1000, 500}) {
        const Mesh mesh = scaled(zoo::snapped(ball), size);
        const ClosestPoints closest(mesh);
        const ClosestSides sides(mesh);
        for (const Vec3& direction : far_directions)
            for (const int e :
                 {size + 20, size + 26, size + 28, size + 60, 512, 513, 520, 700, 1000, 1022, 1023}) {
                if (e < size + 20) continue;
                const Vec3 p = times_power(direction, e);
                const ClosestPoint found = closest.find(p);
                const double wanted = std::ldexp(norm(direction), e);
                EXPECT_NEAR(found.distance / wanted, 1, 1e-5) << e;
                EXPECT_LE(norm(times_power(found.point, -size)), 1.0001);
                EXPECT_GT(dot(times_power(found.point, -size), direction), 0.9 * norm(direction)) << e;
                EXPECT_EQ(sides.side(p), Side::outside);
            }
    }
    // A distance beyond all doubles.
    const double most = std::numeric_limits<double>::max();
    const ClosestPoint found = ClosestPoints(ball).find({most, most, -most});
    EXPECT_EQ(found.distance, std::numeric_limits<double>::infinity());
    EXPECT_TRUE(finite(found.point));
    // The largest meshes: differences of coordinates are beyond all doubles.
    const Mesh largest = scaled(zoo::box({-1, -1, -1}, {1, 1, 1}), 1023);
    EXPECT_EQ(ClosestPoints(largest).find({0, 0, 0}).distance, 0x1p1023);
    EXPECT_EQ(ClosestPoints(largest).find({-most, 0, 0}).distance, most - 0x1p1023);
}

TEST(Scaling, OfDistancesBetweenMeshes) {
    const Mesh a = zoo::snapped(zoo::torus(1, 0.3, 20, 10)), b = zoo::snapped(zoo::sphere({0.5, 0, 0}, 1, 2));
    const MeshDistance one = mesh_distance(a, b, 2000);
    for (const int e : exponents) {
        const MeshDistance d = mesh_distance(scaled(a, e), scaled(b, e), 2000);
        EXPECT_EQ(d.max, std::ldexp(one.max, e)) << e;
        EXPECT_EQ(d.mean, std::ldexp(one.mean, e)) << e;
        EXPECT_EQ(d.root_mean_square, std::ldexp(one.root_mean_square, e)) << e;
    }
    // One so small beside the other that it is a point.
    EXPECT_NEAR(mesh_distance(scaled(a, 1000), scaled(b, -1000), 2000).max / 0x1p1000, 1.3, 1e-3);
    EXPECT_NEAR(mesh_distance(scaled(b, -1000), scaled(a, 1000), 2000).max / 0x1p1000, 0.7, 0.02);
}

TEST(Scaling, OfWelding) {
    const Mesh mesh = zoo::snapped(zoo::joined(zoo::sphere({0, 0, 0}, 1, 2), zoo::sphere({0.01, 0, 0}, 1, 2)));
    const Welded one = weld(mesh, 0.125);
    EXPECT_GT(one.report.corners, 0);
    for (const int e : exponents) {
        const Welded welded = weld(scaled(mesh, e), std::ldexp(0.125, e));
        EXPECT_EQ(welded.mesh.triangles, one.mesh.triangles) << e;
        EXPECT_EQ(welded.report.corners, one.report.corners);
        EXPECT_EQ(welded.report.largest_move, std::ldexp(one.report.largest_move, e));
    }
}

void expect_simplified(const Simplified& result, const Simplified& one, int e) {
    EXPECT_EQ(result.mesh.triangles, one.mesh.triangles);
    EXPECT_EQ(result.mesh.vertices, scaled(one.mesh.vertices, e));
    EXPECT_EQ(result.report.collapses, one.report.collapses);
    EXPECT_EQ(result.report.stop, one.report.stop);
    ASSERT_EQ(result.report.proven_bound.has_value(), one.report.proven_bound.has_value());
    if (one.report.proven_bound) {
        EXPECT_EQ(*result.report.proven_bound, std::ldexp(*one.report.proven_bound, e));
    }
    ASSERT_EQ(result.report.shell.has_value(), one.report.shell.has_value());
    if (one.report.shell) {
        EXPECT_EQ(result.report.shell->epsilon_outer, std::ldexp(one.report.shell->epsilon_outer, e));
        EXPECT_EQ(result.report.shell->root.max, times_power(one.report.shell->root.max, e));
    }
}

TEST(Scaling, OfSimplification) {
    const Mesh mesh = zoo::snapped(zoo::twisted_knot(80, 16));
    const std::function<SimplifyOptions(int)> ways[] = {
        [](int e) { return SimplifyOptions{.tolerance = std::ldexp(0.02, e)}; },
        [](int) { return SimplifyOptions{.faces = 300}; },
        [](int e) { return SimplifyOptions{.faces = 500, .tolerance = std::ldexp(0.5, e), .depth = 5}; },
        [](int) { return SimplifyOptions{.depth = 6}; },
        [](int) { return SimplifyOptions{.method = SimplifyMethod::vertex, .depth = 5}; },
        [](int) { return SimplifyOptions{.method = SimplifyMethod::priority, .faces = 300, .depth = 5}; },
        [](int) { return SimplifyOptions{.method = SimplifyMethod::qem, .faces = 300}; },
        [](int e) { return SimplifyOptions{.tolerance = std::ldexp(0.02, e), .no_self_intersections = true}; }};
    int number = 0;
    for (const auto& way : ways) {
        const Simplified one = simplify(mesh, way(0));
        EXPECT_LT(one.report.faces_after, one.report.faces_before);
        for (const int e : {-900, -541, -101, -99, 101, 510, 990}) {
            SCOPED_TRACE("way " + std::to_string(number) + " times 2^" + std::to_string(e));
            expect_simplified(simplify(scaled(mesh, e), way(e)), one, e);
        }
        ++number;
    }
}

/// Where coordinates have fewer digits than usual, what is proven is of those that are returned.
TEST(Scaling, BoundsOfTheSmallestHold) {
    const Mesh ball = zoo::snapped(zoo::sphere({0.25, 0, 0}, 1, 4));
    for (const int e : {-1000, -1030, -1050, -541}) {
        const Mesh mesh = scaled(ball, e);  // exact down to 2⁻¹⁰⁵⁰: multiples of 2⁻²⁰
        const double tolerance = std::ldexp(0.03, e);
        const Simplified result = simplify(mesh, {.tolerance = tolerance});
        ASSERT_LE(*result.report.proven_bound, tolerance);
        EXPECT_LT(result.report.faces_after, 600);
        const Mesh back = scaled(result.mesh, -e);
        EXPECT_LE(mesh_distance(back, ball, 20000).max, 0.03);
        EXPECT_LE(mesh_distance(ball, back, 20000).max, 0.03);
        const Simplified counted = simplify(mesh, {.faces = 200});
        const double bound = std::ldexp(*counted.report.proven_bound, -e);
        EXPECT_LE(mesh_distance(scaled(counted.mesh, -e), ball, 20000).max, bound);
        EXPECT_LE(mesh_distance(ball, scaled(counted.mesh, -e), 20000).max, bound);
    }
}

TEST(Scaling, SimplificationRefusesWhatNumbersCannotTell) {
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 2);
    SimplifyOptions options{.faces = 100, .coordinates = Coordinates::single};
    try {
        simplify(scaled(ball, 300), options);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("beyond all 32-bit numbers"));
    }
    EXPECT_THROW(simplify(scaled(ball, 900), {.tolerance = 1e-300}), OptionError);
    const Simplified most = simplify(scaled(ball, -900), {.tolerance = 1e300});
    EXPECT_LT(most.report.faces_after, 30);
}

TEST(Scaling, RefusesCoordinatesThatNoPowerOfTwoBrings) {
    Mesh mesh = scaled(zoo::box({0, 0, 0}, {1, 1, 1}), 1000);
    mesh.vertices[0].x = 1e-100;
    for (const auto& call :
         {std::function<void()>([&] { inspect(mesh); }), std::function<void()>([&] { ClosestPoints{mesh}; }),
          std::function<void()>([&] { simplify(mesh, {.faces = 6}); })}) {
        try {
            call();
            FAIL();
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr("too small beside the mesh's largest"));
        }
    }
    mesh.vertices[0].x = 0;
    mesh.vertices.push_back({1e-100, 0, std::numeric_limits<double>::infinity()});  // of no triangle
    EXPECT_NO_THROW(inspect(mesh));
    EXPECT_NO_THROW(ClosestPoints{mesh});
}

// ---- shells ----

void expect_info(const ShellInfo& info, const ShellInfo& one, int e) {
    EXPECT_EQ(info.sign, one.sign);
    EXPECT_EQ(info.surface_cells, one.surface_cells);
    EXPECT_EQ(info.cells, one.cells);
    EXPECT_EQ(info.cell_width, std::ldexp(one.cell_width, e));
    EXPECT_EQ(info.root.min, times_power(one.root.min, e));
    EXPECT_EQ(info.epsilon_inner, std::ldexp(one.epsilon_inner, e));
    EXPECT_EQ(info.epsilon_outer, std::ldexp(one.epsilon_outer, e));
    EXPECT_EQ(info.rounding, std::ldexp(one.rounding, e));
}

void expect_answers(const Query& query, const Query& one, const std::vector<Vec3>& points, int e) {
    const bool bounds = one.shell().info().sign != SignRule::generalized;
    for (const Vec3& p : points) {
        const Vec3 q = times_power(p, e);
        ASSERT_EQ(query.classify(q), one.classify(p));
        ASSERT_EQ(query.classify_shell(q), one.classify_shell(p));
        ASSERT_EQ(query.value(q), std::ldexp(one.value(p), e));
        ASSERT_EQ(query.gradient(q), one.gradient(p));
        ASSERT_EQ(query.shell().value(q), std::ldexp(one.shell().value(p), e));
        ASSERT_EQ(query.shell().gradient(q), one.shell().gradient(p));
        if (!bounds) continue;
        ASSERT_EQ(query.signed_distance_bound(q).lower, std::ldexp(one.signed_distance_bound(p).lower, e));
        ASSERT_EQ(query.signed_distance_bound(q).upper, std::ldexp(one.signed_distance_bound(p).upper, e));
    }
    const std::vector<Vec3> queries = scaled(points, e);
    std::vector<std::int8_t> sides(points.size());
    std::vector<double> values(points.size());
    query.classify(queries, sides);
    query.value(queries, values);
    for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_EQ(sides[i], std::int8_t(one.classify(points[i])));
        ASSERT_EQ(values[i], query.value(queries[i]));
    }
}

TEST(Scaling, OfShellsAndTheirAnswers) {
    for (const zoo::Entry& entry : meshes()) {
        if (entry.mesh.triangles.size() > 3000) continue;
        const std::vector<Vec3> points = points_around(entry.mesh, 200);
        const ThinShell one = build(entry.mesh, {.depth = 4});
        for (const int e : exponents_of_shells) {
            SCOPED_TRACE(entry.name + " times 2^" + std::to_string(e));
            const ThinShell shell = build(scaled(entry.mesh, e), {.depth = 4});
            expect_info(shell.info(), one.info(), e);
            expect_answers(Query(shell), Query(one), points, e);
        }
    }
}

TEST(Scaling, OfSurfacesAndVerification) {
    for (const Mesh& mesh :
         {zoo::snapped(zoo::torus(1, 0.35, 24, 12)), zoo::slab_t_junction(), zoo::snapped(zoo::sheet(6))}) {
        const ThinShell shell_one = build(mesh, {.depth = 5});
        const Surface one = extract_surface(shell_one, {.measure = true});
        for (const int e : exponents_of_shells) {
            SCOPED_TRACE(e);
            const Mesh sized = scaled(mesh, e);
            const ThinShell shell = build(sized, {.depth = 5});
            const Surface surface = extract_surface(shell, {.measure = true});
            EXPECT_EQ(surface.report.certified, one.report.certified);
            EXPECT_EQ(surface.report.level, std::ldexp(one.report.level, e));
            EXPECT_EQ(surface.report.margin, std::ldexp(one.report.margin, e));
            EXPECT_EQ(surface.mesh.triangles, one.mesh.triangles);
            EXPECT_EQ(surface.mesh.vertices, scaled(one.mesh.vertices, e));
            EXPECT_EQ(*surface.report.to_mesh, std::ldexp(*one.report.to_mesh, e));
            const VerifyReport report = verify(shell, sized, {.samples = 20000});
            for (const VerifyCheck& check : report.checks)
                EXPECT_TRUE(check.passed) << check.name << check.detail;
        }
    }
}

TEST(Scaling, ShellsRefuseOtherSizesByTheSize) {
    const Mesh ball = zoo::snapped(zoo::sphere({0, 0, 0}, 1, 2));
    const ThinShell shell = build(ball, {.depth = 3});
    for (const int e : {-1000, -541, -252, 252, 510, 1000}) {
        const Mesh mesh = scaled(ball, e);
        for (const auto& call : {std::function<void()>([&] { build(mesh); }),
                                 std::function<void()>([&] { build(mesh, {.depth = 3, .turn_parts = true}); }),
                                 std::function<void()>([&] { estimate_memory(mesh, 4); })}) {
            try {
                call();
                ADD_FAILURE() << e;
            } catch (const InputError& error) {
                EXPECT_THAT(error.what(), HasSubstr("must lie in [1e-75, 1e+75]"));
            }
        }
        // Another mesh than the shell's: refused, or found to differ.
        bool passed = false;
        try {
            passed = verify(shell, mesh, {.samples = 1000}).passed();
        } catch (const InputError&) {
        }
        EXPECT_FALSE(passed) << e;
    }
}

TEST(Scaling, FarPointsHaveFiniteAnswers) {
    for (const zoo::Entry& entry : zoo::all()) {
        if (entry.mesh.triangles.size() > 2000) continue;
        const ThinShell shell = build(entry.mesh, {.depth = 3});
        const Query query(shell);
        std::vector<Vec3> points;
        for (const Vec3& direction : far_directions)
            for (const int e : {60, 390, 395, 400, 405, 508, 509, 512, 700, 1000, 1020, 1023})
                points.push_back(times_power(direction, e));
        std::vector<double> values(points.size());
        std::vector<Vec3> gradients(points.size());
        std::vector<Interval> bounds(points.size());
        const bool bounded = shell.info().sign != SignRule::generalized;
        query.value(points, values);
        query.gradient(points, gradients);
        if (bounded) query.signed_distance_bound(points, bounds);
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Vec3& p = points[i];
            const int e = geometry::exponent_of(p);
            const double distance = norm(times_power(p, -e));  // in units of 2^e, from the origin
            EXPECT_NEAR(std::ldexp(query.value(p), -e), distance, 1e-14 * distance) << entry.name << e;
            EXPECT_EQ(values[i], query.value(p));
            EXPECT_NEAR(std::ldexp(shell.value(p), -e), distance, 1e-14 * distance);
            for (int axis = 0; axis < 3; ++axis)
                if (p[axis] != 0) {
                    EXPECT_NEAR(gradients[i][axis], std::ldexp(p[axis], -e) / distance, 1e-14);
                    EXPECT_EQ(shell.gradient(p)[axis], gradients[i][axis]);
                }
            EXPECT_EQ(query.classify(p), Side::outside);
            EXPECT_EQ(query.classify_shell(p), ShellSide::outside);
            if (!bounded) continue;
            EXPECT_LE(std::ldexp(bounds[i].lower, -e), distance * (1 + 1e-15));
            EXPECT_GE(std::ldexp(bounds[i].upper, -e), distance * (1 - 1e-15));
            EXPECT_GT(bounds[i].lower, 0);
        }
        const double most = std::numeric_limits<double>::max();
        EXPECT_EQ(query.value({most, -most, most}), std::numeric_limits<double>::infinity());
        EXPECT_NEAR(query.gradient({most, -most, most}).y, -1 / std::sqrt(3.0), 1e-15);
        if (bounded) {
            EXPECT_EQ(query.signed_distance_bound({most, most, most}).upper,
                      std::numeric_limits<double>::infinity());
            EXPECT_LE(query.signed_distance_bound({most, most, most}).lower, most);
        }
    }
}

// ---- the helpers ----

TEST(Scaling, NormsAtAnySize) {
    using geometry::distance_at_any_size;
    using geometry::norm_at_any_size;
    const double most = std::numeric_limits<double>::max(), least = std::numeric_limits<double>::denorm_min();
    EXPECT_EQ(norm_at_any_size({0, 0, 0}), 0);
    for (const int e : {-1074, -1000, -537, 0, 512, 1020})
        EXPECT_EQ(norm_at_any_size(times_power({3, 0, 4}, e)), std::ldexp(5.0, e));
    EXPECT_EQ(norm_at_any_size({most, 0, 0}), most);
    EXPECT_EQ(norm_at_any_size({most, most, 0}), std::numeric_limits<double>::infinity());
    EXPECT_EQ(norm_at_any_size({least, 0, 0}), least);
    EXPECT_EQ(distance_at_any_size({most, 0, 0}, {most / 2, 0, 0}), most / 2);
    EXPECT_EQ(distance_at_any_size({0x1p1023, 0, 0}, {-0x1p1022, 0, 0}), 1.5 * 0x1p1023);
    EXPECT_EQ(distance_at_any_size({most, 0, 0}, {-most, 0, 0}), std::numeric_limits<double>::infinity());
    EXPECT_EQ(distance_at_any_size({least, 0, 0}, {3 * least, 0, 0}), 2 * least);
}

TEST(Scaling, BoundsAreRoundedUpwards) {
    const geometry::Scaling down{-1060};
    for (const double x : {1.0, 1.3, 0.7, 1e-3, 1e-10, 3e-5}) {
        EXPECT_GE(down.in(down.out_upwards(x)), x);
        EXPECT_LE(down.out_upwards(x), std::nextafter(down.out(x), 1.0));
    }
    EXPECT_EQ(geometry::scaling_for(1).exponent, 0);
    EXPECT_EQ(geometry::scaling_for(0).exponent, 0);
    EXPECT_EQ(geometry::scaling_for(0x1p101).exponent, 102);
    EXPECT_EQ(geometry::scaling_for(std::numeric_limits<double>::denorm_min()).exponent, -1073);
}

}  // namespace
}  // namespace its
