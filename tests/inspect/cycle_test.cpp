// Boundaries that cancel as segments in space: T-junctions are no gaps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "inspect/cycle.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/query.h"
#include "its/shell.h"
#include "its/surface.h"
#include "its/verify.h"
#include "support/zoo.h"

namespace its {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using Point = std::array<Rational, 3>;
using testing::HasSubstr;

Point exact(const Vec3& p) {
    return {Rational(p.x), Rational(p.y), Rational(p.z)};
}

/// A line in space as (p × d, d) divided by d's first coordinate that is not 0: the same for all its segments.
std::array<Rational, 6> line_of(const Point& p, const Point& q) {
    Point d;
    for (std::size_t i = 0; i < 3; ++i) d[i] = q[i] - p[i];
    std::array<Rational, 6> line = {
        p[1] * d[2] - p[2] * d[1], p[2] * d[0] - p[0] * d[2], p[0] * d[1] - p[1] * d[0], d[0], d[1], d[2]};
    const Rational first = d[0] != 0 ? d[0] : d[1] != 0 ? d[1] : d[2];
    for (Rational& r : line) r /= first;
    return line;
}

/// In rational numbers, line by line: what covers each interval between neighbouring ends on the line.
bool cancels_by_oracle(std::span<const Vec3> points, std::span<const inspector::UnbalancedEdge> edges,
                       int modulus) {
    std::map<std::array<Rational, 6>, std::vector<inspector::UnbalancedEdge>> lines;
    for (const auto& e : edges) lines[line_of(exact(points[e.low]), exact(points[e.high]))].push_back(e);
    for (const auto& [line, on_it] : lines) {
        const std::size_t axis = line[3] != 0 ? 0 : line[4] != 0 ? 1 : 2;
        std::vector<Rational> ends;
        for (const auto& e : on_it)
            for (const std::uint32_t v : {e.low, e.high}) ends.push_back(exact(points[v])[axis]);
        std::sort(ends.begin(), ends.end());
        for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
            if (ends[i] == ends[i + 1]) continue;
            const Rational middle = (ends[i] + ends[i + 1]) / 2;
            std::int64_t cover = 0;
            for (const auto& e : on_it) {
                const Rational from = exact(points[e.low])[axis], to = exact(points[e.high])[axis];
                if (from < middle && middle < to) cover += e.excess;
                if (to < middle && middle < from) cover -= e.excess;
            }
            if (modulus == 0 ? cover != 0 : cover % modulus != 0) return false;
        }
    }
    return true;
}

/// The edges of a mesh without equal vertices, by a map.
std::vector<inspector::UnbalancedEdge> unbalanced_edges(const Mesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::int64_t> excess;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = t[k], b = t[(k + 1) % 3];
            excess[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    std::vector<inspector::UnbalancedEdge> edges;
    for (const auto& [ends, sum] : excess)
        if (sum != 0) edges.push_back({ends.first, ends.second, sum});
    return edges;
}

std::vector<Mesh> solids() {
    return {zoo::box({0, 0, 0}, {1, 1, 1}),
            zoo::box({-1, 2, 0.125}, {3, 2.5, 7}),
            zoo::snapped(zoo::tetrahedron()),
            zoo::snapped(zoo::sphere({0.3, 0.1, 0}, 1, 1)),
            zoo::snapped(zoo::torus(1, 0.4, 9, 5)),
            zoo::joined(zoo::box({0, 0, 0}, {1, 1, 1}), zoo::box({1, 0, 0}, {2, 1, 1}))};
}

TEST(Cycle, EdgesSplitOnOneSideCancel) {
    for (const Mesh& solid : solids())
        for (std::uint64_t seed = 0; seed < 20; ++seed) {
            const Mesh mesh = zoo::split_on_one_side(solid, 1 + int(seed), seed);
            const MeshReport report = inspect(mesh);
            EXPECT_EQ(report.open_edges, 0u);
            EXPECT_EQ(report.open_odd_edges, 0u);
            EXPECT_TRUE(report.closed);
            EXPECT_EQ(report.sign, SignRule::winding) << report.sign_reason;
            EXPECT_EQ(report.t_junctions > 0, report.unbalanced_edges > 0);
            EXPECT_LE(report.t_junctions, 1 + seed);
            EXPECT_EQ(report.turned, 0u);
            const std::vector<inspector::UnbalancedEdge> edges = unbalanced_edges(mesh);
            EXPECT_TRUE(cancels_by_oracle(mesh.vertices, edges, 0));
        }
}

TEST(Cycle, OneSplitIsOneTJunction) {
    for (const Mesh& mesh : {zoo::slab_t_junction(), zoo::cube_t_junction()}) {
        const MeshReport report = inspect(mesh);
        EXPECT_EQ(report.t_junctions, 1u);
        EXPECT_EQ(report.unbalanced_edges, 3u);
        EXPECT_EQ(report.boundary_edges, 3u);
        EXPECT_THAT(report.sign_reason, HasSubstr("T-junction"));
    }
}

/// A point that is off its edge by one unit in the last place leaves a gap. Where it is moved along the edge it
/// does not, and the oracle says which.
TEST(Cycle, OneUnitInTheLastPlaceIsAGap) {
    std::mt19937_64 random(5);
    int gaps = 0, cycles = 0;
    for (const Mesh& solid : solids())
        for (std::uint64_t seed = 0; seed < 60; ++seed) {
            Mesh mesh = zoo::split_on_one_side(solid, 1 + int(seed % 3), seed);
            Vec3& moved = mesh.vertices[solid.vertices.size() + random() % (1 + seed % 3)];
            const int axis = int(random() % 3);
            const double infinity = std::numeric_limits<double>::infinity();
            moved[axis] = std::nextafter(moved[axis], random() % 2 == 0 ? infinity : -infinity);
            const std::vector<inspector::UnbalancedEdge> edges = unbalanced_edges(mesh);
            for (const auto chain : {inspector::Chain::signed_sum, inspector::Chain::modulo_two}) {
                const bool cancels = cancel_segments(mesh.vertices, edges, chain).open == 0;
                EXPECT_EQ(cancels, cancels_by_oracle(mesh.vertices, edges, int(chain) * 2)) << seed;
                ++(cancels ? cycles : gaps);
            }
            if (!cancels_by_oracle(mesh.vertices, edges, 0)) {
                EXPECT_NE(inspect(mesh).sign, SignRule::winding);
                EXPECT_THROW(build(mesh, {.depth = 2, .sign = SignRule::winding}), OptionError);
            }
        }
    EXPECT_GT(gaps, 100);
    EXPECT_GT(cycles, 20);
}

/// Random chains on few lines through few points: the numbers of both methods agree, not only for meshes.
TEST(Cycle, RandomChainsAgreeWithTheOracle) {
    std::mt19937_64 random(9);
    int cancelled = 0;
    for (int round = 0; round < 3000; ++round) {
        std::vector<Vec3> points;
        for (int i = 0; i < 27; ++i) points.push_back({double(i % 3), double(i / 3 % 3), double(i / 9)});
        // Sums of closed walks along lines, so that some vanish.
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::int64_t> excess;
        const auto add = [&](std::uint32_t a, std::uint32_t b) { excess[std::minmax(a, b)] += a < b ? 1 : -1; };
        for (std::uint64_t walks = 1 + random() % 3; walks > 0; --walks) {
            const auto line = std::uint32_t(random() % 9);
            const std::uint32_t steps[] = {1, 3, 9}, step = steps[random() % 3];
            const std::uint32_t first = step == 1 ? 3 * line : step == 3 ? line % 3 + 9 * (line / 3) : line;
            add(first, first + step);
            add(first + step, first + 2 * step);
            add(first + 2 * step, first);
        }
        if (random() % 2 == 0) {
            const auto a = std::uint32_t(random() % 27), b = std::uint32_t((a + 1 + random() % 26) % 27);
            add(a, b);
        }
        std::vector<inspector::UnbalancedEdge> edges;
        for (const auto& [ends, sum] : excess)
            if (sum != 0) edges.push_back({ends.first, ends.second, sum});
        for (const auto chain : {inspector::Chain::signed_sum, inspector::Chain::modulo_two}) {
            const inspector::Remainder rest = cancel_segments(points, edges, chain);
            EXPECT_EQ(rest.open == 0, cancels_by_oracle(points, edges, int(chain) * 2));
            cancelled += rest.open == 0;
        }
    }
    EXPECT_GT(cancelled, 500);
}

TEST(Cycle, TurnedPartsBehindTJunctionsAreTurnedBack) {
    const Mesh solid = zoo::split_on_one_side(zoo::box({0, 0, 0}, {1, 1, 1}), 12, 2);
    Mesh mesh = solid;
    for (std::size_t i = 0; i < 4; ++i) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.open_odd_edges, 0u);
    EXPECT_EQ(report.sign, SignRule::winding) << report.sign_reason;
    EXPECT_EQ(report.turned, 4u);
    EXPECT_EQ(inspect(zoo::reversed(solid)).turned, solid.triangles.size());
}

TEST(Cycle, AHoleBesideTJunctionsStaysAHole) {
    Mesh mesh = zoo::split_on_one_side(zoo::snapped(zoo::sphere({0, 0, 0}, 1, 3)), 20, 6);
    mesh.triangles.erase(mesh.triangles.begin() + 3);
    const MeshReport report = inspect(mesh);
    EXPECT_GT(report.open_edges, 2u);
    EXPECT_LT(report.open_edges, 7u) << "those of the hole, which may be split themselves";
    EXPECT_EQ(report.sign, SignRule::generalized);
}

TEST(Cycle, EveryDepthHasTheRightInsideAndSurfaces) {
    const Vec3 inside_slab[] = {{5, 2, 0.5}, {9, 3, 0.5}, {1, 1, 0.25}, {5, 3.9, 0.9}};
    for (int depth = 0; depth <= 8; ++depth) {
        const Mesh cube_mesh = zoo::cube_t_junction();
        const ThinShell cube = build(cube_mesh, {.depth = depth});
        EXPECT_EQ(Query(cube).classify({0.9, 0.1, 0.2}), Side::inside) << depth;
        EXPECT_EQ(Query(cube).classify({1.01, 0.1, 0.2}), Side::outside) << depth;
        EXPECT_EQ(Query(cube).classify({0.75, 0, 0.75}), Side::on_surface) << depth;
        const Surface outer = extract_surface(cube);
        EXPECT_TRUE(outer.report.certified) << depth;
        EXPECT_FALSE(outer.mesh.triangles.empty()) << depth;
        if (depth <= 6) {
            EXPECT_TRUE(verify(cube, cube_mesh, {.samples = 2000, .grid_samples = 2000}).passed()) << depth;
        }
        const Query slab(build(zoo::slab_t_junction(), {.depth = depth}));
        for (const Vec3& p : inside_slab) EXPECT_EQ(slab.classify(p), Side::inside) << depth;
        EXPECT_EQ(slab.classify({11, 2, 0.5}), Side::outside) << depth;
    }
}

/// Sides by closest points look at the triangles of an edge, which a T-junction hides.
TEST(Cycle, ClosestSidesRefuseTJunctions) {
    EXPECT_THROW(ClosestSides{zoo::cube_t_junction()}, InputError);
    EXPECT_NO_THROW(ClosestSides(zoo::box({0, 0, 0}, {1, 1, 1})));
}

}  // namespace
}  // namespace its
