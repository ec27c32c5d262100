#include "geometry/predicates.h"

#include <gtest/gtest.h>

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <random>
#include <vector>

#include "geometry/vec3.h"
#include "its/stopwatch.h"
#include "support/zoo.h"

namespace its {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using Point = std::array<Rational, 3>;
using Generator = std::mt19937_64;

Point exact(const Vec3& p) {
    return {Rational(p.x), Rational(p.y), Rational(p.z)};
}

Point minus(const Point& a, const Point& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

int sign_of(const Rational& r) {
    return r.sign();
}

int oracle_2d(const Rational& ax, const Rational& ay, const Rational& bx, const Rational& by,
              const Rational& cx, const Rational& cy) {
    return sign_of((bx - ax) * (cy - ay) - (by - ay) * (cx - ax));
}

Rational determinant(const Point& a, const Point& b, const Point& c, const Point& d) {
    const Point u = minus(b, a), v = minus(c, a), w = minus(d, a);
    return (u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] +
           (u[0] * v[1] - u[1] * v[0]) * w[2];
}

int oracle_3d(const Point& a, const Point& b, const Point& c, const Point& d) {
    return sign_of(determinant(a, b, c, d));
}

// g moved by numbers that really are small: ε_y = 2^-bits is far below any non-zero determinant of the inputs.
Point displaced(const Vec3& g, int bits) {
    const Rational tiny = Rational(1) / (boost::multiprecision::cpp_int(1) << bits);
    return {Rational(g.x) + tiny * tiny * tiny * tiny, Rational(g.y) + tiny, Rational(g.z) + tiny * tiny};
}

// Where the line through p parallel to x meets triangle abc, and in which sense. p is in general position.
int oracle_x_line(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& g, double x1, int bits) {
    const Point p = displaced(g, bits), A = exact(a), B = exact(b), C = exact(c);
    const int ab = oracle_2d(A[1], A[2], B[1], B[2], p[1], p[2]);
    const int bc = oracle_2d(B[1], B[2], C[1], C[2], p[1], p[2]);
    const int ca = oracle_2d(C[1], C[2], A[1], A[2], p[1], p[2]);
    if (ab == 0 || ab != bc || bc != ca) return 0;
    const Point u = minus(B, A), v = minus(C, A), w = minus(p, A);
    const Rational nx = u[1] * v[2] - u[2] * v[1], ny = u[2] * v[0] - u[0] * v[2],
                   nz = u[0] * v[1] - u[1] * v[0];
    const Rational x = A[0] - (ny * w[1] + nz * w[2]) / nx;
    const Rational end = p[0] - Rational(g.x) + Rational(x1);
    return p[0] < x && x < end ? -sign_of(nx) : 0;
}

double nudged(double v, Generator& random) {
    for (auto steps = random() % 3; steps > 0; --steps)
        v = std::nextafter(v, random() % 2 ? HUGE_VAL : -HUGE_VAL);
    return v;
}

enum class Kind { uniform, lattice, scaled_lattice, nudged_lattice, coplanar, tiny_and_huge, extreme, count };

// Points of the kind; hard kinds give many zeros and many determinants of a few units in the last place.
std::vector<Vec3> points(Kind kind, int count, Generator& random) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::uniform_int_distribution<int> small(-3, 3), exponent(-80, 80), far(-1070, 1023);
    const double scale = kind == Kind::scaled_lattice || kind == Kind::nudged_lattice ? uniform(random) : 1;
    const auto coordinate = [&]() -> double {
        switch (kind) {
            case Kind::uniform:
                return uniform(random);
            case Kind::scaled_lattice:
                return 0.1 * scale * small(random);
            case Kind::nudged_lattice:
                return nudged(0.1 * scale * (small(random) + 4), random);
            case Kind::tiny_and_huge:
                return random() % 4 ? std::ldexp(uniform(random), exponent(random)) : 0;
            case Kind::extreme:
                return random() % 4 ? std::ldexp(uniform(random), far(random)) : 0;
            default:
                return small(random);
        }
    };
    std::vector<Vec3> result(count);
    for (Vec3& p : result) p = {coordinate(), coordinate(), coordinate()};
    if (kind == Kind::coplanar) {  // rounded affine combinations of three random points
        for (int i = 0; i < 3; ++i) result[i] = {uniform(random), uniform(random), uniform(random)};
        for (int i = 3; i < count; ++i) {
            const double s = uniform(random), t = uniform(random);
            result[i] = result[0] + s * (result[1] - result[0]) + t * (result[2] - result[0]);
        }
    }
    return result;
}

class Kinds : public testing::TestWithParam<int> {
protected:
    Kind kind() const { return Kind(GetParam()); }
    int rounds() const { return kind() == Kind::lattice ? 1000 : kind() == Kind::extreme ? 30 : 300; }
    /// Non-zero determinants are above 2⁻³²⁰⁰ and below 2³¹⁰⁰, those of other kinds within 2^±400.
    int bits() const { return kind() == Kind::extreme ? 7000 : 600; }
    Generator random{std::uint64_t(GetParam()) + 17};
};

TEST_P(Kinds, Orient2dIsExact) {
    for (int i = 0; i < rounds(); ++i) {
        const auto p = points(kind(), 3, random);
        const int expected = oracle_2d(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y);
        ASSERT_EQ(geometry::orient2d(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y), expected);
        ASSERT_EQ(geometry::orient2d(p[1].x, p[1].y, p[0].x, p[0].y, p[2].x, p[2].y), -expected);
        ASSERT_EQ(geometry::orient2d(p[1].x, p[1].y, p[2].x, p[2].y, p[0].x, p[0].y), expected);
    }
}

TEST_P(Kinds, Orient3dIsExact) {
    int zeros = 0;
    for (int i = 0; i < rounds(); ++i) {
        const auto p = points(kind(), 4, random);
        const int expected = oracle_3d(exact(p[0]), exact(p[1]), exact(p[2]), exact(p[3]));
        zeros += expected == 0;
        ASSERT_EQ(geometry::orient3d(p[0], p[1], p[2], p[3]), expected);
        ASSERT_EQ(geometry::orient3d(p[1], p[0], p[2], p[3]), -expected);
        ASSERT_EQ(geometry::orient3d(p[0], p[1], p[3], p[2]), -expected);
        ASSERT_EQ(geometry::orient3d(p[3], p[0], p[1], p[2]), -expected);
    }
    if (kind() == Kind::lattice) {
        EXPECT_GT(zeros, rounds() / 50);
    }
}

TEST_P(Kinds, DegenerateMeansZeroArea) {
    for (int i = 0; i < rounds(); ++i) {
        auto p = points(kind(), 3, random);
        if (i % 3 == 0) p[2] = p[random() % 2];
        const Point u = minus(exact(p[1]), exact(p[0])), v = minus(exact(p[2]), exact(p[0]));
        const bool expected =
            u[1] * v[2] == u[2] * v[1] && u[2] * v[0] == u[0] * v[2] && u[0] * v[1] == u[1] * v[0];
        ASSERT_EQ(geometry::is_degenerate(p[0], p[1], p[2]), expected);
    }
}

TEST_P(Kinds, PerturbedSignsAreThoseOfASmallDisplacement) {
    for (int i = 0; i < rounds() / 2; ++i) {
        const auto p = points(kind(), 4, random);
        const Point a = exact(p[0]), b = exact(p[1]), c = exact(p[2]), g = displaced(p[3], bits());
        ASSERT_EQ(geometry::perturbed_orient2d_yz(p[0], p[1], p[3]),
                  oracle_2d(a[1], a[2], b[1], b[2], g[1], g[2]));
        ASSERT_EQ(geometry::perturbed_orient3d(p[0], p[1], p[2], p[3]), oracle_3d(a, b, c, g));
        ASSERT_EQ(geometry::perturbed_orient3d(p[0], p[1], p[2], p[3]) == 0,
                  geometry::is_degenerate(p[0], p[1], p[2]));
    }
}

TEST_P(Kinds, LineCrossingsAreThoseOfASmallDisplacement) {
    int crossings = 0;
    for (int i = 0; i < rounds(); ++i) {
        const auto p = points(kind(), 5, random);
        const double x0 = std::min(p[3].x, p[4].x), x1 = std::max(p[3].x, p[4].x);
        if (x0 == x1) continue;
        const Vec3 g{x0, p[3].y, p[3].z};
        const int expected = oracle_x_line(p[0], p[1], p[2], g, x1, bits());
        crossings += expected != 0;
        ASSERT_EQ(geometry::x_line_crossing(p[0], p[1], p[2], g, x1), expected);
        ASSERT_EQ(geometry::x_line_crossing(p[2], p[0], p[1], g, x1), expected);
        ASSERT_EQ(geometry::x_line_crossing(p[1], p[0], p[2], g, x1), -expected);
    }
    if (kind() == Kind::lattice) {
        EXPECT_GT(crossings, rounds() / 100);
    }
}

// Segment and triangle by their parameters, in rationals: which of the three ways they meet.
enum class Meeting { none, transversal, degenerate };

bool oracle_segments_meet(const Point& p, const Point& q, const Point& r, const Point& s) {
    const auto on = [](const Point& x, const Point& y, const Point& z) {  // z on the closed segment xy
        if (x == y) return x == z;
        const Point u = minus(y, x), v = minus(z, x);
        if (u[1] * v[2] != u[2] * v[1] || u[2] * v[0] != u[0] * v[2] || u[0] * v[1] != u[1] * v[0])
            return false;
        const Rational uv = u[0] * v[0] + u[1] * v[1] + u[2] * v[2],
                       uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
        return uv >= 0 && uv <= uu;
    };
    if (on(p, q, r) || on(p, q, s) || on(r, s, p) || on(r, s, q)) return true;
    // Otherwise a common point is interior to both: p + t·u = r + k·v with the lines not parallel.
    const Point u = minus(q, p), v = minus(s, r), w = minus(r, p);
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Rational det = u[i] * v[j] - u[j] * v[i];
        if (det == 0) continue;
        const Rational t = (w[i] * v[j] - w[j] * v[i]) / det, m = (w[i] * u[j] - w[j] * u[i]) / det;
        return t > 0 && t < 1 && m > 0 && m < 1 && t * u[k] - m * v[k] == w[k];
    }
    return false;
}

Meeting oracle_segment(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p, const Vec3& q) {
    const Point A = exact(a), B = exact(b), C = exact(c), P = exact(p), Q = exact(q);
    const Rational at_p = determinant(A, B, C, P), at_q = determinant(A, B, C, Q);
    const auto barycentric = [&](const Point& x, bool& inside, bool& boundary) {
        const Point u = minus(B, A), v = minus(C, A), w = minus(x, A);
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            const Rational det = u[i] * v[j] - u[j] * v[i];
            if (det == 0) continue;
            const Rational s = (w[i] * v[j] - w[j] * v[i]) / det, t = (u[i] * w[j] - u[j] * w[i]) / det;
            inside = s >= 0 && t >= 0 && s + t <= 1;
            boundary = s == 0 || t == 0 || s + t == 1;
            return;
        }
        inside = boundary = false;
    };
    bool inside = false, boundary = false;
    if (at_p != at_q) {
        const Rational t = at_p / (at_p - at_q);
        if (t < 0 || t > 1) return Meeting::none;
        const Point u = minus(Q, P);
        barycentric({P[0] + t * u[0], P[1] + t * u[1], P[2] + t * u[2]}, inside, boundary);
        if (!inside) return Meeting::none;
        return boundary || t == 0 || t == 1 ? Meeting::degenerate : Meeting::transversal;
    }
    if (at_p != 0) return Meeting::none;
    barycentric(P, inside, boundary);
    return inside || oracle_segments_meet(P, Q, A, B) || oracle_segments_meet(P, Q, B, C) ||
                   oracle_segments_meet(P, Q, C, A)
               ? Meeting::degenerate
               : Meeting::none;
}

TEST_P(Kinds, SegmentCrossings) {
    int count[3] = {};
    for (int i = 0; i < rounds(); ++i) {
        auto p = points(kind(), 5, random);
        if (i % 5 == 0) p[2] = p[random() % 2];
        if (i % 7 == 0) p[4] = p[3];
        if (i % 11 == 0) p[3] = p[random() % 3];
        const Meeting expected = oracle_segment(p[0], p[1], p[2], p[3], p[4]);
        ++count[int(expected)];
        bool degenerate = false, again = false;
        const int crossing = geometry::segment_crossing(p[0], p[1], p[2], p[3], p[4], degenerate);
        ASSERT_EQ(degenerate, expected == Meeting::degenerate);
        ASSERT_EQ(crossing != 0, expected == Meeting::transversal);
        if (crossing != 0) {
            ASSERT_EQ(crossing, oracle_3d(exact(p[0]), exact(p[1]), exact(p[2]), exact(p[3])));
        }
        ASSERT_EQ(geometry::segment_crossing(p[0], p[1], p[2], p[4], p[3], again), -crossing);
        ASSERT_EQ(again, degenerate);
        ASSERT_EQ(geometry::segment_crossing(p[1], p[0], p[2], p[3], p[4], again), -crossing);
        ASSERT_EQ(again, degenerate);
    }
    if (kind() == Kind::lattice) {
        for (const int n : count) EXPECT_GT(n, rounds() / 200);
    }
}

INSTANTIATE_TEST_SUITE_P(All, Kinds, testing::Range(0, int(Kind::count)));

TEST(Predicates, Conventions) {
    const Vec3 o{0, 0, 0}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    EXPECT_EQ(geometry::orient2d(0, 0, 1, 0, 0, 1), 1);
    EXPECT_EQ(geometry::orient3d(o, x, y, z), 1);
    EXPECT_EQ(geometry::orient3d(o, x, y, {0.3, 0.3, -1}), -1);
    // yzo has its normal towards +x: walking along +x one leaves; zyo is entered.
    EXPECT_EQ(geometry::x_line_crossing(y, z, o, {-1, 0.25, 0.25}, 1), -1);
    EXPECT_EQ(geometry::x_line_crossing(z, y, o, {-1, 0.25, 0.25}, 1), 1);
    bool degenerate = true;
    EXPECT_EQ(geometry::segment_crossing(z, y, o, {-1, 0.25, 0.25}, {1, 0.25, 0.25}, degenerate), 1);
    EXPECT_FALSE(degenerate);
    // The line is displaced by +ε: on the lower edge in, on the upper edge out; touching counts by the end x0.
    EXPECT_EQ(geometry::x_line_crossing(z, y, o, {-1, 0, 0}, 1), 1);
    EXPECT_EQ(geometry::x_line_crossing(z, y, o, {-1, 0.5, 0.5}, 1), 0);
    EXPECT_EQ(geometry::x_line_crossing(z, y, o, {0, 0.25, 0.25}, 1), 0);
    EXPECT_EQ(geometry::x_line_crossing(z, y, o, {-1, 0.25, 0.25}, 0), 1);
}

// A sum of solid angles over 4π: the winding number of any point that is not very close to the mesh.
int winding_number(const Mesh& mesh, const Vec3& p) {
    double angle = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - p, b = mesh.vertices[t[1]] - p, c = mesh.vertices[t[2]] - p;
        const double la = norm(a), lb = norm(b), lc = norm(c);
        angle += 2 * std::atan2(dot(a, cross(b, c)),
                                la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return int(std::lround(angle / (4 * std::acos(-1.0))));
}

bool in_bounds(const Mesh& mesh, const Vec3& p, double margin) {  // p is near some triangle's box
    for (const Triangle& t : mesh.triangles) {
        bool near = true;
        for (int i = 0; i < 3 && near; ++i) {
            const double a = mesh.vertices[t[0]][i], b = mesh.vertices[t[1]][i], c = mesh.vertices[t[2]][i];
            near = p[i] >= std::min({a, b, c}) - margin && p[i] <= std::max({a, b, c}) + margin;
        }
        if (near) return true;
    }
    return false;
}

// Walks along lines of a lattice that the mesh's own vertices are part of, from left of the mesh to right of
// it.
void expect_consistent(const Mesh& mesh, Generator& random, int lines) {
    Vec3 low = mesh.vertices[0], high = low;
    for (const Vec3& v : mesh.vertices)
        for (int i = 0; i < 3; ++i) low[i] = std::min(low[i], v[i]), high[i] = std::max(high[i], v[i]);
    const auto vertex = [&]() -> const Vec3& { return mesh.vertices[random() % mesh.vertices.size()]; };
    for (int line = 0; line < lines; ++line) {
        Vec3 g = vertex();  // through a vertex, or along faces and edges that are parallel to an axis
        if (line % 3 == 1) g.z = vertex().z;
        if (line % 3 == 2) g.y = 0.5 * (vertex().y + vertex().y);
        std::vector<double> x{low.x - 1, high.x + 1};
        for (int i = 0; i < 6; ++i) x.push_back(i % 2 ? vertex().x : 0.5 * (vertex().x + vertex().x));
        std::ranges::sort(x);
        x.erase(std::unique(x.begin(), x.end()), x.end());
        int sum = 0;
        for (std::size_t i = 0; i + 1 < x.size(); ++i) {
            for (const Triangle& t : mesh.triangles)
                sum += geometry::x_line_crossing(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]],
                                                 {x[i], g.y, g.z}, x[i + 1]);
            const Vec3 p{x[i + 1], g.y, g.z};
            if (!in_bounds(mesh, p, 1e-9)) {
                ASSERT_EQ(sum, winding_number(mesh, p));
            }
        }
        ASSERT_EQ(sum, 0);
    }
}

TEST(Predicates, LatticeLinesThroughClosedMeshes) {
    Generator random(5);
    expect_consistent(zoo::box({0, 0, 0}, {1, 2, 3}), random, 300);
    expect_consistent(zoo::box({-0.1, 0.1, 0.3}, {0.7, 0.2, 1.1}), random, 300);
    expect_consistent(zoo::reversed(zoo::box({0, 0, 0}, {1, 1, 1})), random, 50);
    for (const zoo::Entry& entry : zoo::all()) {
        if (!entry.closed_oriented || entry.mesh.vertices.empty()) continue;
        SCOPED_TRACE(entry.name);
        const int lines = int(std::clamp<std::size_t>(200'000 / entry.mesh.triangles.size(), 5, 200));
        expect_consistent(entry.mesh, random, lines);
    }
}

TEST(Predicates, LatticeLinesThroughASteppedBlock) {
    // Unions of unit boxes share faces: walls inside that cancel, and vertices with up to 48 triangles.
    Generator random(9);
    for (int round = 0; round < 20; ++round) {
        Mesh mesh;
        for (int i = 0; i < 12; ++i) {
            const Vec3 corner{double(random() % 3), double(random() % 3), double(random() % 3)};
            mesh = zoo::joined(mesh, zoo::box(corner, corner + Vec3{1, 1, 1}));
        }
        expect_consistent(mesh, random, 30);
    }
}

// Not a test of speed: prints the cost of a call for the curious.
TEST(Predicates, Timing) {
    Generator random(3);
    const auto time = [&](const char* name, Kind kind, auto&& call) {
        const auto p = points(kind, 4096, random);
        long total = 0;
        double best = 1e300;
        for (int round = 0; round < 50; ++round) {
            const Stopwatch watch;
            for (std::size_t i = 0; i + 5 <= p.size(); ++i) total += call(&p[i]);
            best = std::min(best, 1e9 * watch.seconds() / double(p.size()));
        }
        std::printf("%-44s %7.1f ns   (%ld)\n", name, best, total);
        EXPECT_GT(best, 0);
    };
    const auto o2 = [](const Vec3* p) {
        return geometry::orient2d(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y);
    };
    const auto o3 = [](const Vec3* p) { return geometry::orient3d(p[0], p[1], p[2], p[3]); };
    const auto flat = [](const Vec3* p) {  // axis-aligned plane, coordinates of arbitrary binary fractions
        return geometry::orient3d({p[0].x, p[0].y, 0.1}, {p[1].x, p[1].y, 0.1}, {p[2].x, p[2].y, 0.1},
                                  {p[3].x, p[3].y, 0.1});
    };
    const auto line = [](const Vec3* p) {
        return geometry::x_line_crossing(p[0], p[1], p[2], {-2, p[3].y, p[3].z}, 2);
    };
    const auto o2_zero = [](const Vec3* p) {
        return geometry::orient2d(p[0].x, p[0].y, p[1].x, p[1].y, p[0].x, p[0].y);
    };
    time("orient2d, uniform", Kind::uniform, o2);
    time("orient2d, zero (same point)", Kind::uniform, o2_zero);
    time("orient2d, small lattice", Kind::lattice, o2);
    time("orient2d, decimal lattice", Kind::scaled_lattice, o2);
    time("orient3d, uniform", Kind::uniform, o3);
    time("orient3d, small lattice", Kind::lattice, o3);
    time("orient3d, decimal lattice", Kind::scaled_lattice, o3);
    time("orient3d, decimal lattice, nudged", Kind::nudged_lattice, o3);
    time("orient3d, zero (axis-aligned plane)", Kind::uniform, flat);
    time("orient3d, coplanar up to rounding", Kind::coplanar, o3);
    time("x_line_crossing, uniform", Kind::uniform, line);
    time("x_line_crossing, small lattice", Kind::lattice, line);
    time("x_line_crossing, decimal lattice", Kind::scaled_lattice, line);
}

}  // namespace
}  // namespace its
