#include <gtest/gtest.h>

#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <tuple>
#include <vector>

#include "geometry/vec3.h"
#include "octree/lattice.h"
#include "support/zoo.h"
#include "verify/boundary.h"
#include "verify/columns.h"
#include "verify/nearest.h"

/// The verifier's own parts, each against brute force or what is known of a shape: distances, crossings of
/// lattice lines, boundaries and the boundary's part of winding numbers.
namespace its::verifier {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// With more digits than a double has: all that needles need, or as many as are fast.
using Digits50 = boost::multiprecision::cpp_bin_float_50;

template <class Number>
struct Wide {
    Number x, y, z;

    explicit Wide(const Vec3& v) : x(v.x), y(v.y), z(v.z) {}
    Wide(Number a, Number b, Number c) : x(a), y(b), z(c) {}

    friend Wide operator-(const Wide& a, const Wide& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Wide operator+(const Wide& a, const Wide& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Wide operator*(const Number& s, const Wide& a) { return {s * a.x, s * a.y, s * a.z}; }
    friend Number dot(const Wide& a, const Wide& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    friend Wide cross(const Wide& a, const Wide& b) {
        return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
};

template <class Number>
Number to_segment(const Wide<Number>& p, const Wide<Number>& a, const Wide<Number>& b) {
    const Wide<Number> d = b - a;
    const Number length2 = dot(d, d);
    Number t = length2 > 0 ? Number(dot(p - a, d) / length2) : Number(0);
    if (t < 0) t = 0;
    if (t > 1) t = 1;
    const Wide<Number> gap = p - (a + t * d);
    return sqrt(Number(dot(gap, gap)));
}

template <class Number>
double to_triangle(const Vec3& point, const Vec3& first, const Vec3& second, const Vec3& third) {
    const Wide<Number> p(point), a(first), b(second), c(third);
    Number least = std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
    const Wide<Number> n = cross(b - a, c - a);
    const bool over =
        dot(cross(b - a, n), p - a) < 0 && dot(cross(c - b, n), p - b) < 0 && dot(cross(a - c, n), p - c) < 0;
    if (over) {
        const Number height = dot(n, p - a), length = sqrt(Number(dot(n, n)));
        least = std::min<Number>(least, abs(height) / length);
    }
    return double(least);
}

double brute_force(const Mesh& mesh, const Vec3& p) {
    double least = infinite;
    for (const auto& [a, b, c] : mesh.triangles)
        least =
            std::min(least, to_triangle<long double>(p, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]));
    return least;
}

std::vector<Vec3> points(int count, double reach) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(-reach, reach);
    std::vector<Vec3> out;
    out.reserve(std::size_t(count));
    for (int i = 0; i < count; ++i) out.push_back({uniform(random), uniform(random), uniform(random)});
    return out;
}

// ---- Nearest ----

TEST(Nearest, IsTheLeastDistanceOfAllTriangles) {
    for (const zoo::Entry& entry : zoo::all()) {
        if (entry.mesh.triangles.size() > 3000) continue;
        double size = 0;
        for (const Triangle& t : entry.mesh.triangles)
            for (const std::uint32_t v : t) size = std::max(size, norm(entry.mesh.vertices[v]));
        const Nearest nearest(entry.mesh);
        for (const Vec3& p : points(60, 1.5 * size)) {
            const double wanted = brute_force(entry.mesh, p), found = nearest.distance(p, infinite);
            EXPECT_NEAR(found, wanted, 64 * roundoff * 4 * size) << entry.name;
            EXPECT_EQ(nearest.distance(p, found), found) << "the limit itself is within it";
            EXPECT_EQ(nearest.distance(p, 2 * found), found);
            EXPECT_EQ(nearest.distance(p, 0.99 * found), infinite);
        }
        for (std::size_t i = 0; i < entry.mesh.triangles.size(); i += 17) {
            const Vec3 corner = entry.mesh.vertices[entry.mesh.triangles[i][0]];
            EXPECT_LE(nearest.distance(corner, infinite), 64 * roundoff * size) << entry.name;
        }
    }
}

/// Needles and caps of any height: the error is that of the coordinates, not of the shape.
TEST(Nearest, ShapeDoesNotMatter) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (double height = 1; height > 1e-18; height /= 8)
        for (int i = 0; i < 60; ++i) {
            const Vec3 a{uniform(random), uniform(random), uniform(random)},
                b{uniform(random), uniform(random), uniform(random)}, up{uniform(random), uniform(random), 1};
            const double at = uniform(random);
            const Vec3 c = a + at * (b - a) + height * up;
            for (const double reach : {1.0, 3 * height}) {
                const Vec3 p =
                    a + 0.3 * (b - a) + reach * Vec3{uniform(random), uniform(random), uniform(random)};
                const double wanted = to_triangle<Digits50>(p, a, b, c);
                const double found = distance_to_triangle(a - p, b - p, c - p, infinite);
                // The differences from p are rounded before.
                EXPECT_NEAR(found, wanted, 80 * roundoff * 4) << height;
            }
        }
}

TEST(Nearest, OfTrianglesWithoutArea) {
    const Mesh mesh{{{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {5, 5, 5}}, {{0, 1, 2}, {3, 3, 3}}};
    const Nearest nearest(mesh);
    EXPECT_EQ(nearest.distance({1.5, 3, 0}, infinite), 3);
    EXPECT_EQ(nearest.distance({-3, 4, 0}, infinite), 5);
    EXPECT_EQ(nearest.distance({5, 5, 7}, infinite), 2);
    EXPECT_EQ(nearest.distance({1, 0, 0}, infinite), 0);
}

TEST(Nearest, ScalesExactly) {
    const Mesh mesh = zoo::snapped(zoo::torus(1, 0.3, 12, 8));
    const Nearest one(mesh);
    for (const int e : {-900, -300, -101, 101, 240, 900}) {
        Mesh sized = mesh;
        for (Vec3& v : sized.vertices) v = {std::ldexp(v.x, e), std::ldexp(v.y, e), std::ldexp(v.z, e)};
        const Nearest nearest(sized);
        for (const Vec3& p : points(40, 2)) {
            const Vec3 q{std::ldexp(p.x, e), std::ldexp(p.y, e), std::ldexp(p.z, e)};
            EXPECT_EQ(nearest.distance(q, infinite), std::ldexp(one.distance(p, infinite), e));
            EXPECT_EQ(nearest.distance(q, std::ldexp(0.4, e)), std::ldexp(one.distance(p, 0.4), e));
        }
    }
}

// ---- Columns ----

/// Of a box a little larger than [−1, 1]³, for meshes in it.
octree::Lattice lattice_of(int depth) {
    return octree::make_lattice({{-1.0625, -1.0625, -1.0625}, {1.0625, 1.0625, 1.0625}}, depth);
}

/// The winding number of a point off M, or the generalised one.
double solid_angle(const Mesh& mesh, const Vec3& point) {
    long double sum = 0;
    for (const auto& [i, j, k] : mesh.triangles) {
        const Wide<long double> p(point), a = Wide<long double>(mesh.vertices[i]) - p,
                                          b = Wide<long double>(mesh.vertices[j]) - p,
                                          c = Wide<long double>(mesh.vertices[k]) - p;
        const long double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
        sum += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return double(sum / (2 * std::numbers::pi_v<long double>));
}

/// Faces on lattice planes: points on the lower ones count as inside, on the upper ones as outside, since
/// lattice points are displaced upwards along all axes.
TEST(Columns, OfABoxOnLatticePlanes) {
    const octree::Lattice of_box = lattice_of(4);
    const Lattice lattice(of_box);
    const std::array<std::int64_t, 3> low{9, 10, 11}, high{20, 22, 19};
    const Mesh box = zoo::box(of_box.position(low), of_box.position(high));
    const auto expect = [&](const Mesh& mesh, std::int32_t inside, std::uint64_t layers) {
        const Columns columns(mesh, lattice, {});
        EXPECT_EQ(columns.crossings(), layers * 2 * 11 * 12) << "two for each line through the box";
        for (std::int64_t x = 0; x <= lattice.cells(); ++x)
            for (std::int64_t y = 0; y <= lattice.cells(); ++y)
                for (std::int64_t z = 0; z <= lattice.cells(); ++z) {
                    const bool in =
                        low[0] <= x && x < high[0] && low[1] <= y && y < high[1] && low[2] <= z && z < high[2];
                    ASSERT_EQ(columns.above(x, y, z), in ? inside : 0) << x << ' ' << y << ' ' << z;
                }
    };
    expect(box, 1, 1);
    expect(zoo::reversed(box), -1, 1);
    expect(zoo::joined(box, box), 2, 2);
    expect(zoo::joined(box, zoo::reversed(box)), 0, 2);
    expect(zoo::shuffled(box, 3), 1, 1);
}

TEST(Columns, AreWindingNumbers) {
    for (const Mesh& mesh : {zoo::sphere({0.1, 0.05, 0}, 0.8, 2), zoo::torus(0.7, 0.25, 16, 9),
                             zoo::hollow_sphere(2), zoo::overlapping_spheres(2)}) {
        Mesh small = mesh;
        double size = 0;
        for (const Vec3& v : small.vertices)
            size = std::max({size, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
        for (Vec3& v : small.vertices) v = (1 / size) * v;
        const octree::Lattice of_mesh = lattice_of(4);
        const Lattice lattice(of_mesh);
        const Columns columns(small, lattice, {});
        int inside = 0;
        for (std::int64_t x = 0; x <= lattice.cells(); x += 2)
            for (std::int64_t y = 0; y <= lattice.cells(); ++y)
                for (std::int64_t z = 0; z <= lattice.cells(); z += 3) {
                    const double winding = solid_angle(small, of_mesh.position({x, y, z}));
                    if (std::abs(winding - std::round(winding)) > 1e-6) continue;  // on M
                    ASSERT_EQ(columns.above(x, y, z), std::lround(winding)) << x << ' ' << y << ' ' << z;
                    inside += winding > 0.5;
                }
        EXPECT_GT(inside, 50);
    }
}

TEST(Columns, OfOneTriangle) {
    const octree::Lattice of_triangle = lattice_of(3);
    const Lattice lattice(of_triangle);
    const auto at = [&](double x, double y, double z) { return lattice.from_lattice({x, y, z}); };
    const Mesh mesh{{at(4, 4, 6.5), at(8, 4, 6.5), at(4, 8, 6.5)}, {{0, 1, 2}}};
    const Columns columns(mesh, lattice, {});
    // A line is displaced along y first, then x: points on the lower edges are in, on the long edge out.
    std::uint64_t lines = 0;
    for (std::int64_t x = 0; x <= 16; ++x)
        for (std::int64_t y = 0; y <= 16; ++y) {
            const bool in = x >= 4 && y >= 4 && x + y < 12;
            lines += in;
            EXPECT_EQ(columns.above(x, y, 6), in) << x << ' ' << y;
            EXPECT_EQ(columns.above(x, y, 7), 0);
            EXPECT_EQ(columns.above(x, y, 0), in);
        }
    EXPECT_EQ(columns.crossings(), lines);
    const Columns turned(zoo::reversed(mesh), lattice, {});
    EXPECT_EQ(turned.above(5, 5, 6), -1);
}

// ---- Boundary ----

TEST(Boundary, NumbersPositionsOnce) {
    const Mesh mesh{{{1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0, 0, 0}, {9, 9, 9}},
                    {{0, 1, 3}, {2, 3, 4}}};
    const Positions positions = number_positions(mesh);
    EXPECT_EQ(positions.at, (std::vector<Vec3>{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}));
    EXPECT_EQ(positions.number[0], 2);
    EXPECT_EQ(positions.number[2], 2);
    EXPECT_EQ(positions.number[1], 0);
    EXPECT_EQ(positions.number[4], 0);
    EXPECT_EQ(positions.number[3], 1);
}

/// Of each position, how often more edges begin there than end: 0 of any boundary.
void expect_cycle(const std::vector<BoundaryEdge>& edges) {
    std::map<std::tuple<double, double, double>, std::int64_t> sum;
    for (const BoundaryEdge& edge : edges) {
        EXPECT_NE(edge.excess, 0);
        sum[{edge.a.x, edge.a.y, edge.a.z}] += edge.excess;
        sum[{edge.b.x, edge.b.y, edge.b.z}] -= edge.excess;
    }
    for (const auto& [position, excess] : sum) EXPECT_EQ(excess, 0);
}

double length_of(const std::vector<BoundaryEdge>& edges) {
    double sum = 0;
    for (const BoundaryEdge& edge : edges) sum += std::abs(double(edge.excess)) * norm(edge.b - edge.a);
    return sum;
}

TEST(Boundary, OfClosedMeshesIsEmpty) {
    for (const zoo::Entry& entry : zoo::all()) {
        const Boundary boundary = find_boundary(entry.mesh);
        expect_cycle(boundary.edges);
        if (!entry.closed_oriented) continue;
        EXPECT_TRUE(boundary.edges.empty()) << entry.name;
        EXPECT_TRUE(boundary.odd_edges.empty()) << entry.name;
    }
    EXPECT_EQ(find_boundary(zoo::box({0, 0, 0}, {1, 1, 1})).vertices, 8);
    EXPECT_FALSE(find_boundary(zoo::box({0, 0, 0}, {1, 1, 1})).single_edges);
}

TEST(Boundary, AnEdgeThatIsSplitOnOneSideIsNone) {
    for (const Mesh& mesh : {zoo::slab_t_junction(), zoo::cube_t_junction(),
                             zoo::split_on_one_side(zoo::box({0, 0, 0}, {1, 1, 1}), 20, 5)}) {
        const Boundary boundary = find_boundary(mesh);
        EXPECT_TRUE(boundary.single_edges);
        EXPECT_TRUE(boundary.edges.empty());
        EXPECT_TRUE(boundary.odd_edges.empty());
    }
    // A point beside the edge, by one unit in the last place, leaves a gap.
    Mesh mesh = zoo::cube_t_junction();
    std::uint64_t gaps = 0;
    for (Vec3& v : mesh.vertices) {
        const Vec3 before = v;
        v.x = std::nextafter(v.x, 10.0);
        gaps += !find_boundary(mesh).edges.empty();
        v = before;
    }
    EXPECT_GE(gaps, 1);
}

TEST(Boundary, OfOpenMeshes) {
    const Mesh sheet = zoo::sheet(5);
    const Boundary once = find_boundary(sheet), twice = find_boundary(zoo::joined(sheet, sheet)),
                   both_ways = find_boundary(zoo::joined(sheet, zoo::reversed(sheet)));
    EXPECT_EQ(once.edges.size(), 20);
    EXPECT_EQ(once.odd_edges.size(), 20);
    EXPECT_TRUE(once.single_edges);
    expect_cycle(once.edges);
    EXPECT_EQ(twice.edges.size(), 20);
    EXPECT_NEAR(length_of(twice.edges), 2 * length_of(once.edges), 1e-12);
    EXPECT_TRUE(twice.odd_edges.empty()) << "every edge has an even number of triangles";
    EXPECT_TRUE(both_ways.edges.empty());
    // Round a Moebius strip triangles disagree somewhere, which is a boundary of directions and none of parity.
    const Boundary strip = find_boundary(zoo::moebius_strip(30));
    EXPECT_GT(length_of(strip.edges), length_of(strip.odd_edges));
    expect_cycle(strip.edges);
}

/// Crossings upwards and the boundary's term make the generalised winding number.
TEST(Boundary, TermCompletesTheCrossings) {
    Mesh cup = zoo::sphere({0.02, 0.01, 0}, 0.9, 3);
    std::erase_if(cup.triangles, [&](const Triangle& t) { return cup.vertices[t[0]].z > 0.4; });
    const Mesh meshes[] = {cup, zoo::reversed(cup), zoo::joined(cup, cup), zoo::single_triangle()};
    for (const Mesh& mesh : meshes) {
        const octree::Lattice of_mesh = lattice_of(4);
        const Lattice lattice(of_mesh);
        const Columns columns(mesh, lattice, {});
        const Boundary boundary = find_boundary(mesh);
        ASSERT_FALSE(boundary.edges.empty());
        const Nearest nearest(mesh);
        int tested = 0;
        for (std::int64_t x = 0; x <= lattice.cells(); x += 2)
            for (std::int64_t y = 1; y <= lattice.cells(); y += 2)
                for (std::int64_t z = 0; z <= lattice.cells(); z += 3) {
                    const Vec3 p = of_mesh.position({x, y, z});
                    if (nearest.distance(p, infinite) < 1e-6) continue;
                    const Estimate term = boundary_term(boundary.edges, p);
                    EXPECT_LT(term.error, 1e-9);
                    EXPECT_NEAR(columns.above(x, y, z) + term.value, solid_angle(mesh, p), term.error + 1e-14)
                        << x << ' ' << y << ' ' << z;
                    ++tested;
                }
        EXPECT_GT(tested, 1000);
    }
}

}  // namespace
}  // namespace its::verifier
