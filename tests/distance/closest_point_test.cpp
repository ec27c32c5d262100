#include "its/distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "cgal/cgal.h"
#include "distance/closest_point.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"
#include "octree/lattice.h"
#include "support/zoo.h"

namespace its {
namespace {

using testing::HasSubstr;

/// Points in the bounds scaled by `factor`, and on vertices, edges and triangles.
std::vector<Vec3> queries(const Mesh& mesh, double factor, int count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-0.5 * factor, 0.5 * factor);
    const Box box = octree::bounds(mesh);
    std::vector<Vec3> points;
    for (int i = 0; i < count; ++i) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = 0.5 * (box.min[axis] + box.max[axis]) +
                      uniform(random) * (box.max[axis] - box.min[axis] + 1e-3);
        points.push_back(p);
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 1 + mesh.triangles.size() / 50) {
        const Vec3 a = mesh.vertices[mesh.triangles[i][0]], b = mesh.vertices[mesh.triangles[i][1]],
                   c = mesh.vertices[mesh.triangles[i][2]];
        points.insert(points.end(), {a, 0.5 * (a + b), 0.25 * (a + b) + 0.5 * c});
    }
    return points;
}

/// The smallest computed distance over all triangles, and the first triangle that has it.
class BruteForce {
public:
    explicit BruteForce(const Mesh& mesh) : blocks_(mesh.triangles.size()) {
        for (std::size_t i = 0; i < blocks_.size(); ++i) {
            const Triangle& t = mesh.triangles[i];
            std::array<std::array<Vec3, 3>, distance::TriangleBlock::lanes> same;
            same.fill({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
            blocks_[i] = distance::make_block(same);
        }
    }

    distance::Nearest find(const Vec3& p) const {
        distance::Nearest best{.squared = std::numeric_limits<double>::infinity()};
        for (std::size_t i = 0; i < blocks_.size(); ++i) {
            const double d = distance::squared_distance(blocks_[i], 0, p.x, p.y, p.z);
            if (d < best.squared) best = {std::uint32_t(i), 0, d};
        }
        return best;
    }

private:
    std::vector<distance::TriangleBlock> blocks_;
};

double size_of(const Mesh& mesh, const Vec3& p) {
    double size = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    for (const Vec3& v : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) size = std::max(size, std::abs(v[axis]));
    return size;
}

TEST(ClosestPoint, IsTheBruteForceAnswerBitForBit) {
    for (const auto& [name, mesh, closed] : zoo::all()) {
        SCOPED_TRACE(name);
        const distance::ClosestPointTree tree(mesh.vertices, mesh.triangles);
        const BruteForce brute_force(mesh);
        for (const double factor : {1.0, 10.0, 1e6})
            for (const Vec3& p : queries(mesh, factor, 40, 7)) {
                const distance::Nearest expected = brute_force.find(p), found = tree.find(p);
                ASSERT_EQ(found.squared, expected.squared);
                ASSERT_EQ(found.triangle, expected.triangle);
            }
    }
}

TEST(ClosestPoint, PointIsOnTheTriangleAtThatDistance) {
    constexpr double u = 0x1p-53;
    for (const auto& [name, mesh, closed] : zoo::all()) {
        SCOPED_TRACE(name);
        const ClosestPoints closest(mesh);
        for (const Vec3& p : queries(mesh, 2.0, 100, 3)) {
            const ClosestPoint found = closest.find(p);
            const auto& w = found.barycentric;
            for (const double weight : w) {
                ASSERT_GE(weight, 0.0);
                ASSERT_LE(weight, 1.0);
            }
            ASSERT_NEAR(w[0] + w[1] + w[2], 1.0, 8 * u);
            ASSERT_NEAR(norm(p - found.point), found.distance, 64 * u * size_of(mesh, p));
        }
    }
}

TEST(ClosestPoint, BoundLeavesOutWhatIsFarther) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1.0, 3);
    const distance::ClosestPointTree tree(mesh.vertices, mesh.triangles);
    const Vec3 p{3, 0.1, 0.2};
    const distance::Nearest found = tree.find(p);
    EXPECT_EQ(tree.find(p, 1.001 * std::sqrt(found.squared)).triangle, found.triangle);
    EXPECT_EQ(tree.find(p, 0.999 * std::sqrt(found.squared)).squared, std::numeric_limits<double>::infinity());
}

TEST(ClosestPoint, ScalesOfAnySize) {
    const Mesh unit = zoo::torus(1.0, 0.3, 24, 12);
    for (const int exponent : {-200, -60, 60, 200}) {
        SCOPED_TRACE(exponent);
        Mesh mesh = unit;
        for (Vec3& v : mesh.vertices) v = std::ldexp(1.0, exponent) * v;
        const distance::ClosestPointTree tree(mesh.vertices, mesh.triangles),
            unit_tree(unit.vertices, unit.triangles);
        for (const Vec3& p : queries(unit, 2.0, 50, 5)) {
            const distance::Nearest a = unit_tree.find(p), b = tree.find(std::ldexp(1.0, exponent) * p);
            ASSERT_EQ(std::ldexp(a.squared, 2 * exponent), b.squared);
            ASSERT_EQ(a.triangle, b.triangle);
        }
    }
}

TEST(ClosestPoint, ManyTrianglesAtOnePlaceStillMakeATree) {
    Mesh mesh;  // the same triangle again and again: no plane separates anything
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(5000, Triangle{0, 1, 2});
    const ClosestPoint found = ClosestPoints(mesh).find({0.25, 0.25, 2});
    EXPECT_EQ(found.triangle, 0u);
    EXPECT_EQ(found.distance, 2.0);
}

TEST(ClosestPoint, BatchIsTheSingleAnswerForAnyThreads) {
    const Mesh mesh = zoo::twisted_knot(80, 20);
    const ClosestPoints closest(mesh);
    std::vector<Vec3> points = queries(mesh, 1.5, 3000, 11);
    points.push_back({std::numeric_limits<double>::quiet_NaN(), 0, 0});
    points.push_back({0, std::numeric_limits<double>::infinity(), 0});
    std::vector<ClosestPoint> one(points.size()), two(points.size());
    closest.find(points, one, {.threads = 1});
    closest.find(points, two, {.threads = 2});
    EXPECT_EQ(std::memcmp(one.data(), two.data(), one.size() * sizeof(ClosestPoint)), 0);
    for (std::size_t i = 0; i + 2 < points.size(); i += 37) {
        const ClosestPoint single = closest.find(points[i]);
        EXPECT_EQ(std::memcmp(&single, &one[i], sizeof single), 0);
    }
    for (std::size_t i = points.size() - 2; i < points.size(); ++i) {
        EXPECT_EQ(one[i].triangle, ClosestPoint::no_triangle);
        EXPECT_TRUE(std::isnan(one[i].distance));
        EXPECT_THROW(closest.find(points[i]), InputError);
    }
}

TEST(ClosestPoint, RefusesWhatItCannotSearch) {
    const auto message_of = [](const Mesh& mesh) -> std::string {
        try {
            const ClosestPoints closest(mesh);
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_THAT(message_of({}), HasSubstr("no triangles"));
    EXPECT_THAT(message_of({{{0, 0, 0}}, {{0, 0, 1}}}), HasSubstr("vertex 1 of 1"));
    EXPECT_THAT(message_of({{{0, 0, std::nan("")}}, {{0, 0, 0}}}), HasSubstr("vertex 0"));
    EXPECT_THAT(message_of({{{1e300, 0, 1e-80}}, {{0, 0, 0}}}), HasSubstr("too small beside"));
}

TEST(ClosestPoint, CanBeStopped) {
    const Mesh mesh = zoo::tetrahedron();
    const ClosestPoints closest(mesh);
    const std::vector<Vec3> points(100'000);
    std::vector<ClosestPoint> results(points.size());
    EXPECT_THROW(closest.find(points, results,
                              {.threads = 2, .progress = [](std::string_view, double f) { return f < 0.5; }}),
                 Cancelled);
    EXPECT_THROW(closest.find(points, std::span(results).first(5)), OptionError);
    EXPECT_THROW(closest.find(points, results, {.threads = -1}), OptionError);
    EXPECT_THROW(ClosestPoints(mesh, {.threads = -1}), OptionError);
}

TEST(ClosestPoint, AgreesWithCgalOnRealMeshes) {
    const auto files = zoo::real_mesh_files();
    if (files.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    for (const std::string& file : files) {
        SCOPED_TRACE(file);
        const Mesh mesh = read_mesh(file).mesh;
        const cgal::Distances peer(mesh);
        if (!peer.usable()) continue;
        const ClosestPoints closest(mesh);
        for (const Vec3& p : queries(mesh, 2.0, 100, 13)) {
            const double expected = peer.distance(p);
            // CGAL's own construction in doubles errs by more than our distance: hence the wide tolerance.
            ASSERT_NEAR(closest.find(p).distance, expected, 1e-9 * size_of(mesh, p));
        }
    }
}

}  // namespace
}  // namespace its
