// Sides and winding numbers of meshes with boundary, against sums of solid angles in extended precision.

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <algorithm>
#include <boost/math/constants/constants.hpp>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "geometry/box.h"
#include "geometry/vec3.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/query.h"
#include "its/shell_file.h"
#include "query/oracle.h"
#include "support/tries.h"
#include "support/zoo.h"

namespace its {
namespace {

using Precise = boost::multiprecision::cpp_bin_float_50;
using Random = std::mt19937_64;

double uniform(Random& random, double from, double to) {
    return from + (to - from) * (double(random() >> 11) * 0x1p-53);
}

/// Half the solid angle of a triangle, as the argument of re + i·im (Van Oosterom and Strackee 1983).
template <class Number>
struct HalfAngle {
    Number re, im, size;

    HalfAngle(const Mesh& mesh, const Triangle& t, const Vec3& p) {
        using std::sqrt;
        Number v[3][3], length[3];
        for (std::size_t i = 0; i < 3; ++i) {
            Number square = 0;
            for (int k = 0; k < 3; ++k) {
                v[i][k] = Number(mesh.vertices[t[i]][k]) - Number(p[k]);
                square += v[i][k] * v[i][k];
            }
            length[i] = sqrt(square);
        }
        const auto dot = [&](int i, int j) {
            return Number(v[i][0] * v[j][0] + v[i][1] * v[j][1] + v[i][2] * v[j][2]);
        };
        im = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
             v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
             v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
        size = length[0] * length[1] * length[2];
        re = size + dot(0, 1) * length[2] + dot(1, 2) * length[0] + dot(2, 0) * length[1];
    }
    Number angle() const {
        using std::atan2;
        return im == 0 ? Number(0) : Number(atan2(im, re));
    }
};

/// The sum of all triangles' solid angles over 4π, of points off M.
template <class Number = Precise>
Number precise_winding(const Mesh& mesh, const Vec3& p) {
    Number sum = 0;
    for (const Triangle& t : mesh.triangles) sum += HalfAngle<Number>(mesh, t, p).angle();
    return sum / (2 * boost::math::constants::pi<Number>());
}

/// To some 1e-6 a triangle: by doubles where these do.
double plain_winding(const Mesh& mesh, const Vec3& p) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const HalfAngle<double> half(mesh, t, p);
        const double doubtful = 1e-9 * half.size;
        if (std::abs(half.im) <= doubtful && half.re <= doubtful)
            sum += double(HalfAngle<Precise>(mesh, t, p).angle());
        else
            sum += half.angle();
    }
    return sum / (2 * std::numbers::pi);
}

bool in_box(const Box& box, const Vec3& p) {
    bool in = true;
    for (int axis = 0; axis < 3; ++axis) in = in && p[axis] >= box.min[axis] && p[axis] <= box.max[axis];
    return in;
}

/// Without the triangles of which `remove` is true.
template <class F>
Mesh without(Mesh mesh, F&& remove) {
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return remove((1.0 / 3) * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]));
    });
    return mesh;
}

Mesh holed_torus() {
    return without(zoo::torus(1.0, 0.35, 40, 16), [](const Vec3& c) {
        const double angle = std::atan2(c.y, c.x);
        return std::sin(5 * angle) > 0.8 && c.z > 0.1;
    });
}

Mesh open_box() {
    Mesh mesh = zoo::box({0, 0, 0}, {1, 1, 0.5});
    return without(mesh, [](const Vec3& c) { return c.z == 0.5; });
}

struct NamedMesh {
    std::string name;
    Mesh mesh;
};

std::vector<NamedMesh> open_meshes() {
    const auto above = [](double z) { return [z](const Vec3& c) { return c.z > z; }; };
    const Mesh ball = without(zoo::sphere({0, 0, 0}, 1, 3), above(0.8)),
               bowl = without(zoo::sphere({0.03, 0.01, 0}, 1, 3), above(0));
    Mesh fin = ball;  // a triangle at an edge that has two others
    fin.vertices.push_back({1.2, 1.1, -1.3});
    fin.triangles.push_back({fin.triangles[7][0], fin.triangles[7][1], std::uint32_t(fin.vertices.size() - 1)});
    Mesh twice = zoo::joined(bowl, bowl);
    const double rotation[9] = {0.6, -0.8, 0, 0.48, 0.36, 0.8, -0.64, -0.48, 0.6};
    return {{"ball without a cap", ball},
            {"half a ball", bowl},
            {"half a ball twice", twice},
            {"bowls in a bowl", zoo::joined(twice, zoo::transformed(bowl, rotation, {0, 0, -0.1}, 0.6))},
            {"turned ball", zoo::transformed(ball, rotation, {3, -2, 5}, 0.01)},
            {"ball without a triangle",
             [] {
                 Mesh mesh = zoo::sphere({0, 0, 0}, 1, 2);
                 mesh.triangles.pop_back();
                 return mesh;
             }()},
            {"box without a lid", open_box()},
            {"boxes", zoo::joined(open_box(), zoo::box({0.25, 0.25, 0.125}, {0.5, 0.75, 1}))},
            {"holed torus", holed_torus()},
            {"T-junctions", zoo::split_on_one_side(zoo::snapped(holed_torus()), 60, 5)},
            {"fin", fin},
            {"cavity", zoo::joined(ball, zoo::reversed(zoo::sphere({0, 0, 0}, 0.5, 2)))},
            {"sheet", zoo::sheet(4)},
            {"soup", zoo::soup(40, 3)}};
}

/// Points about the boundary's loops: on the filled part, on edges and their extensions, beside them.
std::vector<Vec3> boundary_points(const Mesh& mesh, int count, std::uint64_t seed) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> excess;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t a = t[i], b = t[(i + 1) % 3];
            excess[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    std::vector<std::pair<Vec3, Vec3>> edges;
    for (const auto& [edge, number] : excess)
        if (number != 0) edges.emplace_back(mesh.vertices[edge.first], mesh.vertices[edge.second]);
    std::vector<Vec3> points;
    if (edges.empty()) return points;
    Random random(seed);
    for (int i = 0; i < count; ++i) {
        const auto& [a, b] = edges[random() % edges.size()];
        const auto& [c, d] = edges[random() % edges.size()];
        const double s = uniform(random, 0, 1), length = norm(b - a);
        points.push_back(a + s * (b - a));
        points.push_back(a + uniform(random, -2, 3) * (b - a));
        points.push_back(a + s * (c - a));  // on chords
        points.push_back((1.0 / 3) * (a + b + c + s * (d - c)));
        for (const double off : {1e-1, 1e-3, 1e-6, 1e-9, 1e-12}) {
            const Vec3 away{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
            points.push_back(a + s * (b - a) + (off * length) * away);
            points.push_back(a + (off * length) * away);
        }
    }
    return points;
}

std::vector<Vec3> uniform_points(const Mesh& mesh, int count, std::uint64_t seed, double factor = 1) {
    const Box box = geometry::bounds(mesh.vertices, mesh.triangles);
    Random random(seed);
    std::vector<Vec3> points(static_cast<std::size_t>(count));
    for (Vec3& p : points)
        for (int axis = 0; axis < 3; ++axis) {
            const double grow = 0.5 * (factor - 1) * (box.max[axis] - box.min[axis]);
            p[axis] = uniform(random, box.min[axis] - grow, box.max[axis] + grow);
        }
    return points;
}

struct Tally {
    int uncertain = 0, on_surface = 0, inside = 0, outside = 0;
};

/// The side of a point off M: by plain sums where these tell it by far, else by precise ones.
Side expected_side(const Mesh& mesh, const Box& box, const Vec3& p, Side found) {
    if (!in_box(box, p)) return Side::outside;
    const double w = plain_winding(mesh, p);
    if (std::abs(w - 0.5) > 1e-3) return w > 0.5 ? Side::inside : Side::outside;
    const Precise precise = precise_winding(mesh, p);
    if (found == Side::uncertain && abs(precise - Precise(0.5)) < Precise(1e-10)) return Side::uncertain;
    return precise > Precise(0.5) ? Side::inside : Side::outside;
}

Tally expect_sides(const Query& query, const std::vector<Vec3>& points) {
    const Mesh& mesh = query.shell().mesh();
    const Box box = geometry::bounds(mesh.vertices, mesh.triangles);
    const ClosestPoints closest(mesh);
    std::vector<std::int8_t> codes(points.size());
    query.classify(points, codes);
    Tally tally;
    int wrong = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3& p = points[i];
        const Side side = query.classify(p);
        EXPECT_EQ(std::int8_t(side), codes[i]);
        tally.uncertain += side == Side::uncertain ? 1 : 0;
        tally.inside += side == Side::inside ? 1 : 0;
        tally.outside += side == Side::outside ? 1 : 0;
        tally.on_surface += side == Side::on_surface ? 1 : 0;
        const bool on = test::brute_force_side(mesh, p, SignRule::unsigned_rule) == Side::on_surface;
        // Closer to an edge than any double but near 0 can tell, the proven error may be large.
        if (side == Side::uncertain && query.winding_number(p).error > 1e-10) {
            EXPECT_LT(closest.find(p).distance, 0x1p-60);
            continue;
        }
        const Side expected = on ? Side::on_surface : expected_side(mesh, box, p, side);
        if (side != expected && ++wrong <= 3)
            ADD_FAILURE() << fmt::format("({:a}, {:a}, {:a}) is {} and not {}, w = {}", p.x, p.y, p.z,
                                         int(expected), int(side), plain_winding(mesh, p));
    }
    EXPECT_EQ(wrong, 0) << "of " << points.size();
    return tally;
}

void expect_all_sides(const NamedMesh& entry, const BuildOptions& options, int count) {
    const Query query(build(entry.mesh, options));
    ASSERT_EQ(query.shell().info().sign, SignRule::generalized);
    const Tally uniform = expect_sides(query, uniform_points(entry.mesh, test::tries(10 * count), 1));
    EXPECT_EQ(uniform.uncertain, 0);
    expect_sides(query, uniform_points(entry.mesh, count, 2, 3));
    expect_sides(query, boundary_points(entry.mesh, count / 4, 3));
    const Tally hard = expect_sides(query, test::hard_points(query.shell(), entry.mesh, count / 8, 4));
    EXPECT_GT(hard.on_surface, 0);
}

TEST(OpenSides, AreThoseOfTheSumOfSolidAngles) {
    for (const NamedMesh& entry : open_meshes())
        for (const int depth : {0, 2, 4, 6}) {
            SCOPED_TRACE(fmt::format("{}, depth {}", entry.name, depth));
            expect_all_sides(entry, {.depth = depth, .sign = SignRule::generalized}, 80);
        }
}

TEST(OpenSides, OfAdaptiveShellsAreTheSame) {
    for (const NamedMesh& entry : open_meshes()) {
        SCOPED_TRACE(entry.name);
        const Box box = geometry::bounds(entry.mesh.vertices, entry.mesh.triangles);
        BuildOptions options;
        options.sign = SignRule::generalized;
        options.thickness = 0.02 * norm(box.max - box.min);
        expect_all_sides(entry, options, 80);
    }
}

TEST(OpenSides, OfTheIterativeSolverAreTheSame) {
    const NamedMesh entry{"holed torus", holed_torus()};
    expect_all_sides(entry, {.depth = 3, .sign = SignRule::generalized, .solver = Solver::lscg}, 100);
}

TEST(OpenSides, OfClosedMeshesAreThoseOfTheWindingRule) {
    for (const Mesh& mesh : {zoo::torus(1.0, 0.35, 24, 12), zoo::overlapping_spheres(2), zoo::hollow_sphere(2),
                             zoo::reversed(zoo::tetrahedron())}) {
        const Query query(build(mesh, {.depth = 4, .sign = SignRule::generalized}));
        for (const Vec3& p : test::hard_points(query.shell(), mesh, 50, 6))
            ASSERT_EQ(query.classify(p), test::brute_force_side(mesh, p, SignRule::winding));
    }
}

/// Beside a closed mesh and one without a triangle: away from the hole sides are the same.
TEST(OpenSides, AwayFromAHoleAreThoseOfTheClosedMesh) {
    const Mesh mesh = zoo::twisted_knot(120, 16);
    Mesh open = mesh;
    open.triangles.erase(open.triangles.begin() + 777);
    const Triangle& t = mesh.triangles[777];
    const Query closed(build(mesh, {.depth = 6, .sign = SignRule::winding})),
        holed(build(open, {.depth = 6, .sign = SignRule::generalized}));
    const Vec3 centre = (1.0 / 3) * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]);
    const double area =
        0.5 * norm(cross(mesh.vertices[t[1]] - mesh.vertices[t[0]], mesh.vertices[t[2]] - mesh.vertices[t[0]]));
    double radius = 0;
    for (const std::uint32_t v : t) radius = std::max(radius, norm(mesh.vertices[v] - centre));
    // Its solid angle is at most area/(distance − radius)²; below 2π the side is the same.
    const double margin = radius + std::sqrt(area / (2 * std::numbers::pi)) * 1.001;
    const std::vector<Vec3> points = uniform_points(mesh, 200'000, 9);
    std::vector<std::int8_t> expected(points.size()), found(points.size());
    closed.classify(points, expected);
    holed.classify(points, found);
    int compared = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (norm(points[i] - centre) < margin) continue;
        ++compared;
        ASSERT_EQ(found[i], expected[i]);
    }
    EXPECT_GT(compared, 150'000);
}

TEST(OpenSides, AreUncertainOnAFlatLid) {
    const Query query(build(open_box(), {.depth = 5, .sign = SignRule::generalized}));
    // From a point of the lid's plane the rest of the box is half of all directions.
    EXPECT_EQ(query.classify({0.3, 0.6, 0.5}), Side::uncertain);
    EXPECT_EQ(query.classify({0.3, 0.6, std::nextafter(0.5, 1)}), Side::outside);  // beyond the bounds
    EXPECT_EQ(query.classify({0.3, 0.6, 0.5 - 1e-6}), Side::inside);
    EXPECT_EQ(query.classify({0.3, 1, 0.5}), Side::on_surface);

    EXPECT_TRUE(query.contains({0.3, 0.6, 0.5}, true));
    EXPECT_FALSE(query.contains({0.3, 0.6, 0.5}, false));
    EXPECT_TRUE(query.contains({0.3, 0.6, 0.4}, false));
    EXPECT_TRUE(query.contains({0.3, 1, 0.5}, false));
    EXPECT_FALSE(query.contains({0.3, 0.6, 0.6}, true));
    EXPECT_THROW(static_cast<void>(query.contains({0.3, 0.6, 0.5})), OptionError);
    EXPECT_TRUE(query.contains({0.3, 0.6, 0.4}));
    const std::vector<Vec3> points = {{0.3, 0.6, 0.5}, {0.3, 0.6, 0.4}, {NAN, 0, 0}, {2, 2, 2}};
    std::vector<std::uint8_t> in(4, 7);
    query.contains(points, in, true);
    EXPECT_EQ(in, (std::vector<std::uint8_t>{1, 1, 0, 0}));
    EXPECT_THROW(query.contains(points, in), OptionError);
    const Query closed(build(zoo::tetrahedron(), {.depth = 2}));
    EXPECT_FALSE(closed.contains({100, 0, 0}));
}

TEST(OpenSides, RefuseWhatIsNotFinite) {
    const Query query(build(open_box(), {.depth = 3, .sign = SignRule::generalized}));
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();
    std::vector<Vec3> points;
    for (const double bad : {nan, infinity, -infinity})
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 p{0.2, 0.3, 0.25};
            p[axis] = bad;
            points.push_back(p);
            EXPECT_THROW(static_cast<void>(query.classify(p)), InputError);
            EXPECT_THROW(static_cast<void>(query.winding_number(p)), InputError);
        }
    std::vector<std::int8_t> codes(points.size());
    std::vector<WindingNumber> numbers(points.size());
    query.classify(points, codes);
    query.winding_number(points, numbers);
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_EQ(codes[i], not_finite);
        EXPECT_TRUE(std::isnan(numbers[i].value));
    }
    for (const double far : {1e3, 1e20, 1e200, 1e308}) {
        const WindingNumber w = query.winding_number({-far, far, far});
        EXPECT_LE(std::abs(w.value), w.error + 1e-6);
        EXPECT_LE(w.error, 1e-10);
        EXPECT_EQ(query.classify({-far, far, far}), Side::outside);
    }
}

TEST(OpenSides, AreTheSameForAnyThreadsAndFromAFile) {
    const Mesh mesh = holed_torus();
    const auto path = std::filesystem::path(testing::TempDir()) / "its_open_sides.its";
    BuildOptions adaptive{.sign = SignRule::generalized};
    adaptive.thickness = 0.03;
    for (const BuildOptions& options : {BuildOptions{.depth = 6, .sign = SignRule::generalized}, adaptive}) {
        const ThinShell shell = build(mesh, options);
        save(shell, path);
        std::vector<Vec3> points = uniform_points(mesh, 60'000, 11);
        const std::vector<Vec3> near = boundary_points(mesh, 500, 12);
        points.insert(points.end(), near.begin(), near.end());
        std::vector<std::int8_t> first(points.size()), other(points.size());
        std::vector<WindingNumber> one(points.size()), more(points.size());
        const Query query(shell), loaded(load(path));
        query.classify(points, first, {.threads = 1});
        loaded.classify(points, other, {.threads = 4});
        EXPECT_EQ(first, other);
        query.winding_number(points, one, {.threads = 1});
        loaded.winding_number(points, more, {.threads = 4});
        EXPECT_EQ(std::memcmp(one.data(), more.data(), one.size() * sizeof(one[0])), 0);
        const Query cold(shell);  // cells' numbers found by several threads at once
        cold.classify(points, other, {.threads = 4});
        EXPECT_EQ(first, other);
    }
    std::filesystem::remove(path);
}

TEST(WindingNumber, IsWithinItsErrorOnOpenMeshes) {
    for (const NamedMesh& entry : open_meshes()) {
        SCOPED_TRACE(entry.name);
        const Query query(build(entry.mesh, {.depth = 3, .sign = SignRule::generalized}));
        const Mesh& mesh = query.shell().mesh();
        std::vector<Vec3> points = uniform_points(mesh, test::tries(8), 21, 2);
        const int few = std::clamp(int(1500 / mesh.triangles.size()), 1, test::tries(3));
        for (const Vec3& p : boundary_points(mesh, few, 22)) points.push_back(p);
        for (const Vec3& p : points) {
            const WindingNumber w = query.winding_number(p);
            if (std::isnan(w.value)) {
                EXPECT_EQ(query.classify(p), Side::on_surface);
                continue;
            }
            EXPECT_LE(w.error, 1e-10);
            EXPECT_LE(abs(precise_winding(mesh, p) - Precise(w.value)), Precise(w.error))
                << fmt::format("({:a}, {:a}, {:a})", p.x, p.y, p.z);
        }
    }
}

/// Squares of offsets underflow: in the plane across the ray to a boundary vertex, and all about one.
TEST(WindingNumber, IsWithinItsErrorWhereSquaresUnderflow) {
    using MorePrecise = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<900>>;
    const Mesh mesh{{{0, 0, 0}, {-1, 1, 0.1}, {-1, -1, 0.2}, {-1, -0.1, -1}},
                    {{0, 1, 2}, {0, 2, 3}, {1, 3, 2}}};
    const Query query(build(mesh, {.depth = 3, .sign = SignRule::generalized}));
    Random random(31);
    std::vector<Vec3> points;
    for (const double d : {1e-155, 1e-160, 1e-200, 5e-324}) {
        for (const double t : {1.0, 0.0078125, d})
            for (const double y : {-d, 0.0, d})
                for (const double z : {-d, 0.0, d}) points.push_back({t, y, z});
        for (int i = 0; i < 4; ++i) {
            const auto any = [&] { return d * uniform(random, -1, 1); };
            points.push_back({any(), any(), any()});
        }
    }
    std::ranges::shuffle(points, random);
    points.resize(std::size_t(test::tries(int(points.size()))));
    for (const Vec3& p : points) {
        SCOPED_TRACE(fmt::format("({:a}, {:a}, {:a})", p.x, p.y, p.z));
        const WindingNumber w = query.winding_number(p);
        if (std::isnan(w.value)) continue;  // on the surface
        const MorePrecise exact = precise_winding<MorePrecise>(query.shell().mesh(), p);
        EXPECT_LE(abs(exact - MorePrecise(w.value)), MorePrecise(w.error));
        if (p.x > 1e-3) {
            EXPECT_LE(w.error, 1e-10);
        }
    }
}

TEST(WindingNumber, IsWholeAndExactOnClosedMeshes) {
    for (const test::NamedMesh& entry : test::closed_meshes()) {
        SCOPED_TRACE(entry.name);
        if (entry.mesh.triangles.size() > 2000) continue;
        const Query query(build(entry.mesh, {.depth = 3, .sign = SignRule::winding}));
        for (const Vec3& p : test::hard_points(query.shell(), entry.mesh, 5, 23)) {
            const WindingNumber w = query.winding_number(p);
            const Side side = query.classify(p);
            ASSERT_EQ(std::isnan(w.value), side == Side::on_surface);
            if (side == Side::on_surface) continue;
            ASSERT_EQ(w.error, 0);
            ASSERT_EQ(w.value, std::int64_t(w.value));
            ASSERT_EQ(w.value, double(test::brute_force_winding(entry.mesh, p)));
            ASSERT_EQ(w.value >= 1, side == Side::inside);
        }
    }
}

/// The index that other rules lack is made by whichever call comes first.
TEST(WindingNumber, DoesNotDependOnTheRule) {
    for (const NamedMesh& entry : open_meshes()) {
        SCOPED_TRACE(entry.name);
        const Query query(build(entry.mesh, {.depth = 3, .sign = SignRule::generalized}));
        const Query other(build(entry.mesh, {.depth = 3, .sign = SignRule::unsigned_rule}));
        const std::uint64_t bytes = other.memory_bytes();
        const std::vector<Vec3> points = uniform_points(query.shell().mesh(), test::tries(2000), 41, 2);
        std::vector<WindingNumber> one(points.size()), two(points.size());
        query.winding_number(points, one);
        other.winding_number(points, two, {.threads = 4});
        for (std::size_t i = 0; i < points.size(); ++i) {
            ASSERT_EQ(std::isnan(one[i].value), std::isnan(two[i].value));
            if (!std::isnan(one[i].value)) {
                ASSERT_LE(std::abs(one[i].value - two[i].value), one[i].error + two[i].error);
            }
        }
        EXPECT_GT(other.memory_bytes(), bytes);
    }
    const Mesh mesh = zoo::torus(1.0, 0.35, 24, 12);
    const Query query(build(mesh, {.depth = 3, .sign = SignRule::even_odd}));
    EXPECT_EQ(query.winding_number({1, 0.01, 0.02}).value, 1);
    EXPECT_EQ(query.winding_number({1, 0.01, 0.02}).error, 0);
    EXPECT_EQ(query.winding_number({0, 0.01, 0.02}).value, 0);
}

}  // namespace
}  // namespace its
