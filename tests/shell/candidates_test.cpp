#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

#include "geometry/vec3.h"
#include "its/stopwatch.h"
#include "shell/candidates.h"

namespace its {
namespace {

using Corners = std::array<double, 8>;
using Polygon = std::vector<Vec3>;
using Generator = std::mt19937_64;

double value(const Corners& c, double x, double y, double z) {
    double sum = 0;
    for (int i = 0; i < 8; ++i) sum += c[i] * (i & 1 ? x : 1 - x) * (i & 2 ? y : 1 - y) * (i & 4 ? z : 1 - z);
    return sum;
}

Corners corners(const std::function<double(double, double, double)>& f) {
    Corners c;
    for (int i = 0; i < 8; ++i) c[i] = f(i & 1, i >> 1 & 1, i >> 2);
    return c;
}

/// Greatest Bernstein coefficient of f on a triangle: an upper bound, by the blossom of the trilinear form.
double upper_bound(const Corners& c, const std::array<Vec3, 3>& t) {
    double bound = -HUGE_VAL;
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j)
            for (int k = j; k < 3; ++k) {
                const Vec3 &p = t[i], &q = t[j], &r = t[k];
                bound = std::max(bound,
                                 (value(c, p.x, q.y, r.z) + value(c, p.x, r.y, q.z) + value(c, q.x, p.y, r.z) +
                                  value(c, q.x, r.y, p.z) + value(c, r.x, p.y, q.z) + value(c, r.x, q.y, p.z)) /
                                     6);
            }
    return bound;
}

/// Tries to disprove f ≤ limit on the polygon by subdivision; returns a value of f above the limit, or the
/// limit once it is proven. Independent of the algebra under test.
double disprove(const Corners& c, const Polygon& polygon, double limit) {
    std::vector<std::array<Vec3, 3>> stack;
    for (std::size_t i = 2; i < polygon.size(); ++i) stack.push_back({polygon[0], polygon[i - 1], polygon[i]});
    for (long steps = 0; !stack.empty(); ++steps) {
        const auto t = stack.back();
        stack.pop_back();
        for (const Vec3& p : t)
            if (const double v = value(c, p.x, p.y, p.z); v > limit) return v;
        if (upper_bound(c, t) <= limit) continue;
        if (steps > 2'000'000) return HUGE_VAL;  // not decided
        int longest = 0;
        for (int i = 1; i < 3; ++i)
            if (norm(t[(i + 1) % 3] - t[i]) > norm(t[(longest + 1) % 3] - t[longest])) longest = i;
        const Vec3 a = t[longest], b = t[(longest + 1) % 3], d = t[(longest + 2) % 3], m = 0.5 * (a + b);
        stack.push_back({a, m, d});
        stack.push_back({m, b, d});
    }
    return limit;
}

constexpr double tolerance = 1e-10;  // for corner values up to about 1

void expect_extremes(const Corners& c, const Polygon& polygon, double slack = tolerance) {
    const shell::Range range = shell::candidate_extremes(c, polygon);
    Corners negative = c;
    for (double& v : negative) v = -v;
    ASSERT_EQ(disprove(c, polygon, range.max + slack), range.max + slack);
    ASSERT_EQ(disprove(negative, polygon, -range.min + slack), -range.min + slack);
    // Attained, at points of the cell.
    ASSERT_NEAR(value(c, range.argmax.x, range.argmax.y, range.argmax.z), range.max, 1e-14);
    ASSERT_NEAR(value(c, range.argmin.x, range.argmin.y, range.argmin.z), range.min, 1e-14);
    for (const Vec3& p : {range.argmin, range.argmax})
        for (int i = 0; i < 3; ++i) {
            ASSERT_GE(p[i], -1e-15);
            ASSERT_LE(p[i], 1 + 1e-15);
        }
}

Vec3 random_point(Generator& random) {
    std::uniform_real_distribution<double> uniform(0, 1);
    const double x = uniform(random), y = uniform(random);
    return {x, y, uniform(random)};
}

/// The part of the cube in the plane through p with normal n, in order.
Polygon section(const Vec3& p, const Vec3& n) {
    Polygon points;
    for (int i = 0; i < 8; ++i)
        for (const int bit : {1, 2, 4}) {
            if (i & bit) continue;
            const auto corner = [](int k) { return Vec3{double(k & 1), double(k >> 1 & 1), double(k >> 2)}; };
            const double a = dot(corner(i) - p, n), b = dot(corner(i | bit) - p, n);
            if ((a < 0) == (b < 0) || a == b) continue;
            points.push_back(corner(i) + (a / (a - b)) * (corner(i | bit) - corner(i)));
        }
    if (points.empty()) return {p};
    Vec3 centre{0, 0, 0};
    for (const Vec3& q : points) centre = centre + (1.0 / double(points.size())) * q;
    const Vec3 u = points[0] - centre, v = cross(n, u);
    std::ranges::sort(points, {}, [&](const Vec3& q) {
        return std::atan2(dot(q - centre, v) / dot(v, v), dot(q - centre, u) / dot(u, u));
    });
    return points;
}

Polygon random_polygon(int kind, Generator& random) {
    const Vec3 p = random_point(random), centre{0.5, 0.5, 0.5};
    switch (kind % 5) {
        case 0:
            return section(p, random_point(random) - centre);
        case 1:
            return {p, random_point(random), random_point(random)};
        case 2: {  // a small triangle
            const double size = std::pow(10, -double(random() % 9));
            return {p, p + size * (random_point(random) - p), p + size * (random_point(random) - p)};
        }
        case 3: {  // a sliver
            const Vec3 q = random_point(random);
            return {
                p, q,
                0.5 * (p + q) + std::pow(10, -double(random() % 17)) * (random_point(random) - 0.5 * (p + q))};
        }
        default: {  // a plane of small integer direction through the centre or a nearby lattice point
            const auto step = [&] { return double(random() % 5) - 2; };
            const Vec3 n{step(), step(), step() + 0.5 * double(random() % 2)};
            return dot(n, n) == 0 ? Polygon{p} : section(centre + 0.125 * Vec3{step(), step(), step()}, n);
        }
    }
}

TEST(Candidates, RandomCellsAndPolygons) {
    Generator random(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 3000; ++i) {
        SCOPED_TRACE(i);
        Corners c;
        for (double& v : c) v = uniform(random);
        expect_extremes(c, random_polygon(i, random));
        if (HasFatalFailure()) return;
    }
}

TEST(Candidates, NearlyLinear) {  // what distances look like: cubic and quadratic parts are tiny
    Generator random(2);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 2000; ++i) {
        SCOPED_TRACE(i);
        const double noise = std::pow(10, -double(random() % 12)), slope = std::pow(10, -double(random() % 12));
        const Vec3 n = random_point(random);
        const Corners c = corners([&](double x, double y, double z) {
            return slope * (n.x * x + n.y * y + n.z * z - 0.5) + noise * uniform(random);
        });
        expect_extremes(c, random_polygon(i, random));
        if (HasFatalFailure()) return;
    }
}

TEST(Candidates, Distances) {  // to a point or a line: kinks and symmetry
    Generator random(3);
    for (int i = 0; i < 2000; ++i) {
        SCOPED_TRACE(i);
        const Vec3 q = i % 2 ? random_point(random) : Vec3{0.5, 0.5, 0.25 * double(random() % 5)};
        const Corners c = corners([&](double x, double y, double z) {
            return i % 3 ? norm(Vec3{x, y, z} - q) : std::hypot(x - q.x, y - q.y);
        });
        expect_extremes(c, random_polygon(i, random));
        if (HasFatalFailure()) return;
    }
}

TEST(Candidates, SmallIntegers) {  // bilinear, linear, constant, symmetric; leading coefficients vanish
    Generator random(4);
    for (int i = 0; i < 3000; ++i) {
        SCOPED_TRACE(i);
        Corners c;
        for (double& v : c) v = double(random() % 3) - 1;
        expect_extremes(c, random_polygon(i % 2 ? 4 : i, random));
        if (HasFatalFailure()) return;
    }
}

TEST(Candidates, Ridges) {  // lines of critical points, then broken by less and less
    Generator random(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 120; ++i) {
        SCOPED_TRACE(i);
        const double broken = i % 12 == 0 ? 0 : std::pow(10, -double(i % 12));
        // x·y on planes that hold the z direction: a ridge along z; on other planes nearly.
        const Corners c = corners([&](double x, double y, double z) {
            return x * y * (i % 3 == 0 ? 1 : 1 + 1e-3 * z) + broken * uniform(random);
        });
        const double tilt = i % 4 == 0 ? 0 : std::pow(10, -double(random() % 12));
        const Vec3 n{1, 0.5 + uniform(random) / 4, tilt * uniform(random)};
        expect_extremes(c, section({0.5, 0.5, 0.5}, n), 1e-8);  // the oracle needs 1/√1e-8 steps a ridge
        expect_extremes(c, {{0.2, 0.8, 0.1}, {0.8, 0.2, 0.1}, {0.5, 0.5, 0.9}}, 1e-8);
        if (HasFatalFailure()) return;
    }
}

TEST(Candidates, PeaksOnRidges) {
    // f = −l² ∓ δ·m² + κ·xyz about a point o, with l and m any orthogonal coordinates in the plane: for the
    // upper sign a peak of height 0 at o, on a ridge that becomes flat with δ; planes nearly parallel to z.
    Generator random(9);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 20'000; ++i) {
        const double delta = std::pow(10, -i % 10), kappa = std::pow(10, -2 * (i / 10 % 7));
        const double tilt = std::pow(10, -(i / 70 % 8)), stretch = std::pow(10, -1 + uniform(random));
        Vec3 n{uniform(random), uniform(random), tilt * uniform(random)};
        n = (1 / norm(n)) * n;
        const Vec3 level = (1 / std::hypot(n.x, n.y)) * Vec3{n.y, -n.x, 0}, up = cross(n, level);
        const double angle = 3.2 * uniform(random);
        const Vec3 l = std::cos(angle) * level + std::sin(angle) * up, m = cross(n, l);
        const Vec3 o = Vec3{0.5, 0.5, 0.5} + 0.2 * (random_point(random) - Vec3{0.5, 0.5, 0.5});

        // Coefficients of xy, yz, zx by the values −1, ∓δ, 0 of the form at (l, l), (m, m), (l, m).
        Eigen::Matrix3d forms;
        const Vec3 pairs[3][2] = {{l, l}, {m, m}, {l, m}};
        for (int k = 0; k < 3; ++k) {
            const Vec3 &p = pairs[k][0], &q = pairs[k][1];
            forms.row(k) << p.x * q.y + p.y * q.x, p.y * q.z + p.z * q.y, p.z * q.x + p.x * q.z;
        }
        const bool peak = random() % 2;
        Eigen::Vector3d form = forms.fullPivLu().solve(Eigen::Vector3d(-2, peak ? -2 * delta : 2 * delta, 0));
        const double scale = std::max({1.0, form.cwiseAbs().maxCoeff(), kappa});
        form /= scale;
        const Corners c = corners([&](double x, double y, double z) {
            const Vec3 d = Vec3{x, y, z} - o;
            return form[0] * d.x * d.y + form[1] * d.y * d.z + form[2] * d.z * d.x +
                   kappa / scale * d.x * d.y * d.z;
        });
        const Vec3 shift = 0.08 * uniform(random) * stretch * level + 0.08 * uniform(random) * up;
        Polygon polygon;
        for (int k = 0; k < 5; ++k) {
            const double turn = 1.2566 * k + 0.3 * uniform(random);
            polygon.push_back(o + shift + 0.3 * stretch * std::cos(turn) * level + 0.3 * std::sin(turn) * up);
        }
        const shell::Range range = shell::candidate_extremes(c, polygon);
        ASSERT_GE(range.max, -1e-15) << i;
        if (peak && scale < 100) {  // the height of rounding
            const double bound = disprove(c, polygon, range.max + 1e-6);
            ASSERT_EQ(bound, range.max + 1e-6) << i;
        }
    }
}

TEST(Candidates, ClosedForms) {
    const Corners product = corners([](double x, double y, double z) { return x * y * z; });
    const Polygon simplex{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    shell::Range range = shell::candidate_extremes(product, simplex);
    EXPECT_NEAR(range.max, 1.0 / 27, 1e-15);
    EXPECT_NEAR(norm(range.argmax - Vec3{1.0 / 3, 1.0 / 3, 1.0 / 3}), 0, 1e-8);
    EXPECT_EQ(range.min, 0);
    range = shell::candidate_extremes(product, section({0.5, 0.5, 0.5}, {1, 1, 1}));
    EXPECT_NEAR(range.max, 0.125, 1e-15);
    EXPECT_EQ(range.min, 0);

    // xy + yz + zx on x + y + z = 1: (1 − |p|²)/2, at most 1/3; its quadratic part alone, no cubic.
    range = shell::candidate_extremes(
        corners([](double x, double y, double z) { return x * y + y * z + z * x; }), simplex);
    EXPECT_NEAR(range.max, 1.0 / 3, 1e-15);
    EXPECT_NEAR(range.min, 0, 1e-15);

    // A saddle: bilinear on a plane of the lattice, no extremes but corners and nothing in the middle.
    const Polygon square{{0, 0, 0.5}, {1, 0, 0.5}, {1, 1, 0.5}, {0, 1, 0.5}};
    range = shell::candidate_extremes(
        corners([](double x, double y, double) { return (2 * x - 1) * (2 * y - 1); }), square);
    EXPECT_EQ(range.max, 1);
    EXPECT_EQ(range.min, -1);

    // x·y on x + y = 1: a ridge of height 1/4, for all z.
    range = shell::candidate_extremes(corners([](double x, double y, double) { return x * y; }),
                                      Polygon{{1, 0, 0}, {0, 1, 0}, {0, 1, 1}, {1, 0, 1}});
    EXPECT_NEAR(range.max, 0.25, 1e-15);

    // On a segment: x·y·z on (t, t, 1 − t), greatest at t = 2/3.
    range = shell::candidate_extremes(product, Polygon{{0, 0, 1}, {1, 1, 0}});
    EXPECT_NEAR(range.max, 4.0 / 27, 1e-15);
    EXPECT_NEAR(range.argmax.x, 2.0 / 3, 1e-8);
}

TEST(Candidates, DegeneratePolygons) {
    Generator random(6);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 200; ++i) {
        Corners c;
        for (double& v : c) v = uniform(random);
        const Vec3 p = random_point(random), q = random_point(random), m = 0.5 * (p + q);
        const shell::Range point = shell::candidate_extremes(c, Polygon{p});
        EXPECT_EQ(point.min, point.max);
        EXPECT_EQ(point.argmin, p);
        EXPECT_EQ(shell::candidate_extremes(c, Polygon{p, p, p}).max, point.max);
        const shell::Range segment = shell::candidate_extremes(c, Polygon{p, q});
        const shell::Range flat = shell::candidate_extremes(c, Polygon{p, q, m});
        EXPECT_NEAR(segment.max, flat.max, 1e-15);
        EXPECT_NEAR(segment.min, flat.min, 1e-15);
        for (double t = 0; t <= 1; t += 0.001) {
            const Vec3 r = p + t * (q - p);
            EXPECT_LE(value(c, r.x, r.y, r.z), segment.max + 1e-15);
            EXPECT_GE(value(c, r.x, r.y, r.z), segment.min - 1e-15);
        }
        Corners constant;
        constant.fill(c[0]);
        const shell::Range same = shell::candidate_extremes(constant, random_polygon(i, random));
        EXPECT_EQ(same.min, c[0]);
        EXPECT_EQ(same.max, c[0]);
    }
}

TEST(Candidates, DoesNotDependOnScaleOrStart) {
    Generator random(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 300; ++i) {
        Corners c, large, small;
        for (double& v : c) v = uniform(random);
        for (int k = 0; k < 8; ++k) large[k] = std::ldexp(c[k], 300), small[k] = std::ldexp(c[k], -300);
        Polygon polygon = random_polygon(i, random);
        const shell::Range range = shell::candidate_extremes(c, polygon);
        EXPECT_NEAR(std::ldexp(shell::candidate_extremes(large, polygon).max, -300), range.max, 1e-14);
        EXPECT_NEAR(std::ldexp(shell::candidate_extremes(small, polygon).max, 300), range.max, 1e-14);
        std::rotate(polygon.begin(), polygon.begin() + 1, polygon.end());
        EXPECT_NEAR(shell::candidate_extremes(c, polygon).max, range.max, 1e-13);
        std::ranges::reverse(polygon);
        EXPECT_NEAR(shell::candidate_extremes(c, polygon).min, range.min, 1e-13);
    }
}

TEST(Candidates, Timing) {  // not a test of speed
    Generator random(8);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (const double noise : {1.0, 0.01}) {
        std::vector<std::pair<Corners, Polygon>> cases(1000);
        for (auto& [c, polygon] : cases) {
            const Vec3 n = random_point(random);
            c = corners([&](double x, double y, double z) {
                return dot(n, {x, y, z}) + noise * uniform(random);
            });
            polygon = section(random_point(random), random_point(random) - Vec3{0.5, 0.5, 0.5});
        }
        double sum = 0, best = 1e300;
        for (int round = 0; round < 10; ++round) {
            const Stopwatch watch;
            for (const auto& [c, polygon] : cases) sum += shell::candidate_extremes(c, polygon).max;
            best = std::min(best, 1e6 * watch.seconds() / double(cases.size()));
        }
        std::printf("linear + %g noise: %.2f us a polygon (%g)\n", noise, best, sum);
        EXPECT_GT(sum, 0);
    }
}

}  // namespace
}  // namespace its
