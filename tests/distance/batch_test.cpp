#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include "distance/closest_point.h"
#include "distance/curve_order.h"
#include "distance/group_search.h"
#include "geometry/vec3.h"
#include "its/distance.h"
#include "its/mesh_file.h"
#include "octree/lattice.h"
#include "support/zoo.h"

/// Batches of closest points: whatever they do to be fast, each answer is that of a single call, which in turn
/// is that of all triangles.
namespace its {
namespace {

std::vector<Vec3> uniform_points(const Box& box, double factor, int count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-0.5 * factor, 0.5 * factor);
    const double side = std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z, 1e-300});
    std::vector<Vec3> points(std::size_t(count), Vec3{});
    for (Vec3& p : points)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = 0.5 * (box.min[axis] + box.max[axis]) + uniform(random) * side;
    return points;
}

/// On vertices, edges and triangles, on planes of symmetry, one unit in the last place beside them, and around.
std::vector<Vec3> hard_points(const Mesh& mesh, std::uint64_t seed) {
    const Box box = octree::bounds(mesh);
    std::vector<Vec3> points;
    for (const double factor : {0.1, 1.0, 2.0, 10.0, 100.0, 1e3, 1e10})
        for (const Vec3& p : uniform_points(box, factor, 100, seed)) points.push_back(p);
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 1 + mesh.triangles.size() / 40) {
        const Vec3 a = mesh.vertices[mesh.triangles[i][0]], b = mesh.vertices[mesh.triangles[i][1]],
                   c = mesh.vertices[mesh.triangles[i][2]];
        points.insert(points.end(), {a, 0.5 * (a + b), 0.25 * (a + b) + 0.5 * c});
        points.push_back({std::nextafter(a.x, b.x), a.y, std::nextafter(a.z, c.z)});
    }
    const Vec3 centre = 0.5 * (box.min + box.max);
    const std::size_t all = points.size();
    for (std::size_t i = 0; i < all; i += 3) {
        Vec3 p = points[i];
        for (std::size_t axis = i % 3; axis < 3; ++axis) p[int(axis)] = centre[int(axis)];
        points.push_back(p);
    }
    return points;
}

bool same(const ClosestPoint& a, const ClosestPoint& b) {
    using Bits = std::array<std::uint64_t, sizeof(ClosestPoint) / sizeof(std::uint64_t)>;
    return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

void expect_single_answers(const Mesh& mesh, const std::vector<Vec3>& points) {
    const ClosestPoints closest(mesh);
    std::vector<ClosestPoint> batch(points.size());
    closest.find(points, batch);
    for (std::size_t i = 0; i < points.size(); ++i)
        ASSERT_TRUE(same(batch[i], closest.find(points[i])))
            << i << ": " << points[i].x << " " << points[i].y << " " << points[i].z;
}

Mesh twice(const Mesh& mesh) {
    return zoo::shuffled(zoo::joined(mesh, mesh), 5);
}

/// Needles, segments and points beside ordinary triangles.
Mesh needles() {
    Mesh mesh = zoo::soup(200, 3);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]];
        if (i % 4 == 0) mesh.vertices[t[2]] = a + 0.3 * (b - a);
        if (i % 4 == 1) mesh.vertices[t[2]] = a + 1e-9 * (b - a) + Vec3{1e-12, 0, 0};
        if (i % 16 == 2) mesh.vertices[t[1]] = mesh.vertices[t[2]] = a;
    }
    return mesh;
}

struct Named {
    const char* name;
    Mesh mesh;
};

std::vector<Named> hard_meshes() {
    const double turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    return {
        {"cube", zoo::box({-1, -1, -1}, {1, 1, 1})},
        {"cubes that touch", zoo::joined(zoo::box({0, 0, 0}, {1, 1, 1}), zoo::box({1, 0, 0}, {2, 1, 1}))},
        {"two sheets in one plane", twice(zoo::sheet(12))},
        {"every triangle twice", twice(zoo::sphere({0, 0, 0}, 1, 3))},
        {"needles", needles()},
        {"a thin plate", zoo::plate(1e-7)},
        {"far from the origin", zoo::transformed(zoo::torus(1, 0.3, 40, 20), turn, {1e6, -1e6, 3e5}, 1)},
        {"too far for single precision", zoo::transformed(zoo::torus(1, 0.3, 24, 12), turn, {1e13, 0, 0}, 1)},
        {"small beside a large triangle",
         zoo::joined(zoo::sphere({0, 0, 0}, 1e-4, 3), zoo::box({2, 2, 2}, {3, 3, 3}))}};
}

TEST(ClosestPointBatch, IsTheSingleAnswerBitForBit) {
    for (const auto& [name, mesh, closed] : zoo::all()) {
        SCOPED_TRACE(name);
        expect_single_answers(mesh, hard_points(mesh, 1));
    }
}

TEST(ClosestPointBatch, TiesNeedlesAndPlaces) {
    for (const auto& [name, mesh] : hard_meshes()) {
        SCOPED_TRACE(name);
        expect_single_answers(mesh, hard_points(mesh, 2));
        expect_single_answers(zoo::shuffled(mesh, 7), uniform_points(octree::bounds(mesh), 2.0, 700, 3));
    }
}

TEST(ClosestPointBatch, SizesOfAnyOrder) {
    const Mesh torus = zoo::torus(1, 0.3, 24, 12);
    for (const double scale : {1e-300, 1e-200, 1e-30, 1e30, 1e200, 1e300}) {
        SCOPED_TRACE(scale);
        Mesh mesh = torus;
        for (Vec3& v : mesh.vertices) v = scale * v;
        std::vector<Vec3> points = uniform_points(octree::bounds(mesh), 3.0, 500, 4);
        for (std::size_t i = 0; i < points.size(); i += 50)
            points[i] = {1, 2, 3};  // of another size altogether
        points.push_back({1e300, -1e300, 1e290});
        points.push_back({0, 0, 0});
        expect_single_answers(mesh, points);
    }
}

TEST(ClosestPointBatch, AllOfAMeshAtOnePoint) {
    for (const Vec3& at : {Vec3{0, 0, 0}, Vec3{1, 2, 3}, Vec3{1e-20, 0, 0}}) {
        Mesh mesh;
        mesh.vertices = {at, at, at};
        mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
        expect_single_answers(mesh, hard_points(zoo::box({-1, -1, -1}, {1, 1, 1}), 3));
    }
}

TEST(ClosestPointBatch, WhereAllTrianglesAreEquallyFar) {
    // About the centre every leaf is needed: too many to try, or to keep; enough points that groups are made.
    const Box around{{-1, -1, -1}, {1, 1, 1}};
    for (const int level : {4, 5}) {
        const Mesh mesh = zoo::sphere({0, 0, 0}, 1.0, level);
        std::vector<Vec3> points = uniform_points(around, 1e-6, 100, 5);
        points.resize(200, Vec3{0, 0, 0});
        for (const Vec3& p : uniform_points(around, 1.5, 2200, 6)) points.push_back(p);
        expect_single_answers(mesh, points);
    }
}

TEST(ClosestPointBatch, DoesNotDependOnOrderOrNumber) {
    const Mesh mesh = zoo::twisted_knot(80, 20);
    const ClosestPoints closest(mesh);
    std::vector<Vec3> points = uniform_points(octree::bounds(mesh), 1.5, 3000, 11);
    std::vector<ClosestPoint> all(points.size());
    closest.find(points, all, {.threads = 1});
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::shuffle(order.begin(), order.end(), std::mt19937_64(3));
    for (const std::size_t count :
         {std::size_t{0}, std::size_t{1}, std::size_t{17}, std::size_t{65}, points.size()}) {
        std::vector<Vec3> some;
        for (std::size_t i = 0; i < count; ++i) some.push_back(points[order[i]]);
        std::vector<ClosestPoint> found(count);
        closest.find(some, found, {.threads = 2});
        for (std::size_t i = 0; i < count; ++i) ASSERT_TRUE(same(found[i], all[order[i]]));
    }
}

TEST(ClosestPointBatch, ManyPointsAreSortedInParts) {
    const Mesh mesh = zoo::tetrahedron();
    const ClosestPoints closest(mesh);
    std::vector<Vec3> points = uniform_points(octree::bounds(mesh), 3.0, 300'000, 12);
    points[17].x = std::numeric_limits<double>::quiet_NaN();
    points[290'000].y = -std::numeric_limits<double>::infinity();
    std::vector<ClosestPoint> found(points.size());
    closest.find(points, found);
    for (std::size_t i = 0; i < points.size(); i += i % 1000 == 0 ? 1 : 7) {
        if (!finite(points[i])) continue;
        ASSERT_TRUE(same(found[i], closest.find(points[i])));
    }
    EXPECT_EQ(found[17].triangle, ClosestPoint::no_triangle);
    EXPECT_TRUE(std::isnan(found[290'000].distance));
}

TEST(ClosestPointBatch, RealMeshes) {
    const auto files = zoo::real_mesh_files();
    if (files.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    for (const std::string& file : files) {
        SCOPED_TRACE(file);
        const Mesh mesh = read_mesh(file).mesh;
        const Box box = octree::bounds(mesh);
        std::vector<Vec3> points;
        for (const double factor : {1.0, 4.0, 30.0})
            for (const Vec3& p : uniform_points(box, factor, 1500, 13)) points.push_back(p);
        expect_single_answers(mesh, points);
    }
}

TEST(GroupSearch, BoundsHoldAgainstExactDistances) {
    for (const auto& [name, mesh] : hard_meshes()) {
        SCOPED_TRACE(name);
        const distance::ClosestPointTree tree(mesh.vertices, mesh.triangles);
        const distance::ClosestPointTree::View view = tree.view();
        std::vector<Vec3> points = uniform_points(octree::bounds(mesh), 4.0, 64, 3);
        float longest = 0;
        for (std::size_t slot = 0; slot < view.source.size(); ++slot)
            longest = std::max(longest,
                               distance::single_triangle(view.blocks[slot / 8], int(slot % 8), view.frame).ab);
        for (std::size_t from = 0; from < 64; from += 16) {
            float at[3][16], reach = 0;
            for (std::size_t i = 0; i < 16; ++i)
                for (int axis = 0; axis < 3; ++axis) {
                    const Vec3 q = view.frame.inverse_scale * (points[from + i] - view.frame.centre);
                    at[axis][i] = float(q[axis]);
                    reach = std::max(reach, std::abs(at[axis][i]));
                }
            const distance::SinglePoints p{platform::load<platform::Singles>(at[0]),
                                           platform::load<platform::Singles>(at[1]),
                                           platform::load<platform::Singles>(at[2])};
            const double error = 0x1p-22 * (reach + 4) +
                                 256 * 0x1p-53 * (view.frame.size * view.frame.inverse_scale + double(reach));
            for (std::size_t slot = 0; slot < view.source.size(); ++slot) {
                const auto triangle =
                    distance::single_triangle(view.blocks[slot / 8], int(slot % 8), view.frame);
                const auto box = distance::leaf_box(view.blocks[slot / 8], 8, view.frame);
                const platform::Singles squared = squared_distances(triangle, p), below = squared_gaps(box, p);
                for (int i = 0; i < 16; ++i) {
                    const Vec3& q = points[from + std::size_t(i)];
                    const double exact =
                        view.frame.inverse_scale *
                        std::sqrt(distance::squared_distance(view.blocks[slot / 8], slot % 8, q.x, q.y, q.z));
                    const double allowed = 32 * 0x1p-24 * (exact + double(longest)) + error;
                    ASSERT_NEAR(std::sqrt(double(squared[i])), exact, allowed);
                    ASSERT_LE(std::sqrt(double(below[i])), exact + allowed);
                }
            }
        }
    }
}

std::vector<std::uint32_t> in_order(const std::vector<Vec3>& points) {
    std::vector<std::uint32_t> numbers(points.size());
    std::iota(numbers.begin(), numbers.end(), 0U);
    return distance::curve_order(points, numbers);
}

TEST(CurveOrder, StepsToANeighbourOnAGrid) {
    std::vector<Vec3> points;
    for (double x = 0; x < 16; ++x)
        for (double y = 0; y < 16; ++y)
            for (double z = 0; z < 16; ++z) points.insert(points.end(), Vec3{x, y, z});
    std::shuffle(points.begin(), points.end(), std::mt19937_64(1));
    const std::vector<std::uint32_t> order = in_order(points);
    EXPECT_EQ(std::set<std::uint32_t>(order.begin(), order.end()).size(), points.size());
    for (std::size_t i = 1; i < order.size(); ++i) {
        const Vec3 step = points[order[i]] - points[order[i - 1]];
        ASSERT_EQ(std::abs(step.x) + std::abs(step.y) + std::abs(step.z), 1.0);
    }
}

TEST(CurveOrder, FewPointsAndPointsAtOnePlace) {
    EXPECT_TRUE(in_order({}).empty());
    const std::vector<Vec3> same_place(100, Vec3{1e-310, 2, 3});
    const std::vector<std::uint32_t> order = in_order(same_place);
    for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
    const std::vector<Vec3> tiny = {{0, 0, 0}, {5e-324, 0, 0}, {0, 5e-324, 0}};
    EXPECT_EQ(in_order(tiny).size(), 3u);
}

}  // namespace
}  // namespace its
