// Closed parts: which lie in which, and which face the wrong way.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "geometry/vec3.h"
#include "inspect/parts.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "mesh/merged.h"
#include "support/zoo.h"

namespace its {
namespace {

constexpr double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

Mesh at(const Mesh& mesh, const Vec3& shift, double scale = 1) {
    return zoo::transformed(mesh, identity, shift, scale);
}

/// Sum of signed solid angles over 4π (Van Oosterom and Strackee 1983).
double winding(const Mesh& mesh, const Vec3& p) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - p, b = mesh.vertices[t[1]] - p, c = mesh.vertices[t[2]] - p;
        const double la = norm(a), lb = norm(b), lc = norm(c);
        sum += 2 *
               std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (4 * 3.14159265358979323846);
}

Mesh data(const std::string& name) {
    return read_mesh(std::filesystem::path(ITS_SOURCE_DIR) / "tests" / "data" / name).mesh;
}

TEST(Parts, OfExportedFiles) {
    const Mesh cavity = data("cavity_wound_outward.obj");
    MeshReport report = inspect(cavity);
    ASSERT_EQ(report.parts.wrong.size(), 1u);
    const WrongPart& part = report.parts.wrong[0];
    EXPECT_EQ(part.fault, PartFault::like_its_container);
    EXPECT_EQ(part.bounds.min, (Vec3{1, 1, 1}));
    EXPECT_EQ(part.bounds.max, (Vec3{3, 3, 3}));
    EXPECT_DOUBLE_EQ(part.volume, 8);
    EXPECT_EQ(part.triangles, 12u);
    EXPECT_EQ(part.first_triangle, 12u);
    EXPECT_EQ(part.depth, 1u);
    EXPECT_EQ(report.parts.to_turn, 1u);
    EXPECT_NEAR(winding(turn_parts(cavity), {2, 2, 2}), 0, 1e-12);
    EXPECT_DOUBLE_EQ(inspect(turn_parts(cavity)).signed_volume, 56);

    const Mesh mirrored = data("mirrored_part_inside_out.obj");
    report = inspect(mirrored);
    ASSERT_EQ(report.parts.wrong.size(), 1u);
    EXPECT_EQ(report.parts.wrong[0].fault, PartFault::inside_out);
    EXPECT_LT(report.parts.wrong[0].volume, 0);
    EXPECT_TRUE(inspect(turn_parts(mirrored)).parts.wrong.empty());

    const Mesh balls = data("two_balls_one_inside_out.obj");
    report = inspect(balls);
    EXPECT_EQ(report.parts.closed, 2u);
    ASSERT_EQ(report.parts.wrong.size(), 1u);
    EXPECT_EQ(report.parts.wrong[0].fault, PartFault::inside_out);
    EXPECT_TRUE(inspect(turn_parts(balls)).parts.wrong.empty());

    for (const char* name : {"cavity.obj", "two_components.obj"}) {
        const Mesh right = data(name);
        report = inspect(right);
        EXPECT_EQ(report.parts.closed, 2u) << name;
        EXPECT_TRUE(report.parts.wrong.empty()) << name;
        EXPECT_EQ(turn_parts(right).triangles, right.triangles) << name;
    }
}

struct Pair {
    const char* name;
    Mesh first, second;
    bool overlap, nested;
};

/// Pairs whose surfaces have points in common.
std::vector<Pair> touching_and_overlapping() {
    const auto box = zoo::box;
    Mesh other_diagonals = box({0, 0, 0}, {1, 1, 1});
    for (Vec3& v : other_diagonals.vertices) v.y = 1 - v.y;
    other_diagonals = zoo::reversed(other_diagonals);
    return {
        {"a face", box({0, 0, 0}, {1, 1, 1}), box({1, 0, 0}, {2, 1, 1}), false, false},
        {"a face, other diagonals", other_diagonals, box({1, 0, 0}, {2, 1, 1}), false, false},
        {"part of a face", box({0, 0, 0}, {4, 4, 4}), box({4, 1, 1}, {5, 2, 2}), false, false},
        {"part of a face, to its edge", box({0, 0, 0}, {4, 4, 4}), box({4, 0, 1}, {5, 2, 2}), false, false},
        {"an edge", box({0, 0, 0}, {1, 1, 1}), box({1, 1, 0}, {2, 2, 1}), false, false},
        {"a vertex", box({0, 0, 0}, {1, 1, 1}), box({1, 1, 1}, {2, 2, 2}), false, false},
        {"a vertex in a face", box({-2, -2, -1}, {2, 2, 0}), zoo::tetrahedron(), false, false},
        {"the wall from within", box({0, 0, 0}, {4, 4, 4}), box({0, 1, 1}, {1, 2, 2}), false, true},
        {"a corner from within", box({0, 0, 0}, {4, 4, 4}), box({0, 0, 0}, {1, 1, 1}), false, true},
        {"an edge from within", box({0, 0, 0}, {4, 4, 4}), box({0, 0, 0}, {4, 1, 1}), false, true},
        {"walls from end to end", box({0, 0, 0}, {4, 4, 4}), box({0, 1, 1}, {4, 2, 2}), false, true},
        {"balls", zoo::sphere({0, 0, 0}, 1, 2), zoo::sphere({1, 0.1, 0.2}, 1, 2), true, false},
        {"crossed bars", box({-4, -1, -1}, {4, 1, 1}), box({-0.5, -3, -0.5}, {0.5, 3, 0.5}), true, false},
        {"boxes with faces in one plane", box({0, 0, 0}, {1, 1, 1}), box({0.5, 0, 0}, {1.5, 1, 1}), true,
         false},
        {"crossed bars in one plane", box({-4, -1, 0}, {4, 1, 1}), box({-1, -4, 0}, {1, 4, 1}), true, false},
    };
}

TEST(Parts, TouchingIsNotOverlapping) {
    for (const Pair& pair : touching_and_overlapping()) {
        for (const bool turned_second : {false, true}) {
            SCOPED_TRACE(std::string(pair.name) + (turned_second ? ", turned" : ""));
            const Mesh second = turned_second ? zoo::reversed(pair.second) : pair.second;
            for (const bool swapped : {false, true}) {
                const Mesh mesh = swapped ? zoo::joined(second, pair.first) : zoo::joined(pair.first, second);
                const PartsReport parts = inspect(mesh).parts;
                EXPECT_EQ(parts.closed, 2u);
                EXPECT_EQ(parts.overlapping, pair.overlap ? 2u : 0u);
                EXPECT_EQ(parts.nested, pair.nested ? 1u : 0u);
                const bool wrong = pair.nested != turned_second;
                ASSERT_EQ(parts.wrong.size(), wrong ? 1u : 0u);
                if (!wrong) continue;
                EXPECT_EQ(parts.wrong[0].overlaps, pair.overlap);
                EXPECT_EQ(parts.to_turn, pair.overlap ? 0u : 1u);
                EXPECT_EQ(parts.wrong[0].fault,
                          pair.nested ? PartFault::like_its_container : PartFault::inside_out);
                if (pair.overlap) continue;
                EXPECT_TRUE(inspect(turn_parts(mesh)).parts.wrong.empty());
            }
        }
    }
}

TEST(Parts, OfEdgesWithManyTriangles) {
    const auto count = [](const Mesh& mesh) { return inspector::find_parts(mesh::merge(mesh)).count(); };
    // Eight boxes around a point: each inner edge has many triangles.
    Mesh boxes;
    for (int i = 0; i < 8; ++i) {
        const Vec3 low{double(i & 1), double(i >> 1 & 1), double(i >> 2)};
        boxes = zoo::joined(boxes, zoo::box(low, low + Vec3{1, 1, 1}));
    }
    EXPECT_EQ(count(boxes), 8u);
    EXPECT_TRUE(inspect(boxes).parts.wrong.empty());
    // The same ball three times: copies stay apart.
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 2);
    EXPECT_EQ(count(zoo::joined(ball, zoo::joined(ball, ball))), 3u);
    // A fin does not open the solid that it is on.
    Mesh finned = zoo::box({0, 0, 0}, {1, 1, 1});
    const auto tip = std::uint32_t(finned.vertices.size());
    finned.vertices.push_back({0.5, -1, -1});
    const Triangle& t = finned.triangles[0];
    finned.triangles.push_back({t[0], t[1], tip});
    EXPECT_EQ(inspect(finned).parts.closed, 1u);
    // Nor does a copy of one of its triangles.
    Mesh copied = zoo::sphere({0, 0, 0}, 1, 2);
    copied.triangles.push_back(copied.triangles[7]);
    EXPECT_EQ(inspect(copied).parts.closed, 1u);
}

TEST(Parts, OpenSheetsAreNoParts) {
    const Mesh mesh =
        zoo::joined(zoo::reversed(zoo::sphere({0, 0, 0}, 1, 3)), at(zoo::sheet(3), {3, 0, 0}, 0.1));
    const Mesh both = zoo::joined(mesh, zoo::sphere({5, 0, 0}, 2, 3));
    const PartsReport parts = inspect(both).parts;
    EXPECT_EQ(parts.closed, 2u);
    ASSERT_EQ(parts.wrong.size(), 1u);
    EXPECT_EQ(parts.wrong[0].first_triangle, 0u);
    EXPECT_TRUE(inspect(zoo::sheet(3)).parts.wrong.empty());
    EXPECT_EQ(inspect(zoo::moebius_strip(20)).parts.closed, 0u);
}

TEST(Parts, WithoutVolumeFaceNowhere) {
    Mesh pillow;
    pillow.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    pillow.triangles = {{0, 1, 2}, {0, 2, 1}};
    const PartsReport parts = inspect(zoo::joined(zoo::sphere({5, 0, 0}, 1, 2), pillow)).parts;
    EXPECT_EQ(parts.closed, 2u);
    EXPECT_TRUE(parts.wrong.empty());
    // Volume within rounding error, but not 0.
    for (const bool turned : {false, true}) {
        const Mesh plate = at(zoo::plate(0x1p-40), {1024, 1024, 0});
        const Mesh mesh = zoo::joined(zoo::sphere({0, 0, 0}, 1, 2), turned ? zoo::reversed(plate) : plate);
        EXPECT_EQ(inspect(mesh).parts.wrong.size(), turned ? 1u : 0u);
    }
}

/// Solids at random: those of a place lie in each other, places are apart.
struct Scene {
    std::vector<Mesh> solids;    ///< outward
    std::vector<bool> inward;    ///< turned around
    std::vector<int> depth;      ///< solids that it lies in
    std::vector<int> container;  ///< the innermost of these; −1: none

    Mesh mesh() const {
        Mesh all;
        for (std::size_t i = 0; i < solids.size(); ++i)
            all = zoo::joined(all, inward[i] ? zoo::reversed(solids[i]) : solids[i]);
        return all;
    }
};

/// A solid that has a ball of a third of the size around its `heart`, and lies in a ball of that size around 0.
struct Shape {
    Mesh mesh;
    Vec3 heart;
};

Shape random_shape(std::mt19937& random) {
    switch (random() % 3) {
        case 0:
            return {zoo::sphere({0, 0, 0}, 1, 2), {0, 0, 0}};
        case 1:
            return {zoo::box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}), {0, 0, 0}};
        default:
            return {zoo::torus(0.6, 0.39, 16, 12), {0.6, 0, 0}};
    }
}

Scene random_scene(std::uint32_t seed) {
    std::mt19937 random(seed);
    Scene scene;
    const auto jitter = [&] { return double(random() % 1000) / 1000 - 0.5; };
    const auto grow = [&](auto&& self, Vec3 centre, double size, int depth, int container) -> void {
        const Shape shape = random_shape(random);
        const int number = int(scene.solids.size());
        scene.solids.push_back(at(shape.mesh, centre, size));
        scene.inward.push_back(random() % 2 == 0);
        scene.depth.push_back(depth);
        scene.container.push_back(container);
        if (depth == 4 || random() % 4 == 0) return;
        const double room = 0.3 * size;
        if (random() % 2 == 0) {
            self(self, centre + size * shape.heart, room, depth + 1, number);
        } else {  // two side by side
            for (const double side : {-0.5, 0.5})
                self(self, centre + size * shape.heart + Vec3{0, side * room, 0}, 0.45 * room, depth + 1,
                     number);
        }
    };
    for (int i = 0; i < 6; ++i)
        grow(grow, {2.5 * i + 0.3 * jitter(), 0.3 * jitter(), 0.3 * jitter()}, 1, 0, -1);
    return scene;
}

TEST(Parts, RandomScenesAgreeWithSolidAngles) {
    for (std::uint32_t seed = 0; seed < 40; ++seed) {
        const Scene scene = random_scene(seed);
        const Mesh mesh = zoo::shuffled(scene.mesh(), seed);
        // What the scene says, by brute force.
        std::size_t wrong = 0, nested = 0;
        for (std::size_t i = 0; i < scene.solids.size(); ++i) {
            int in = 0;
            for (std::size_t j = 0; j < scene.solids.size(); ++j)
                in += j != i && winding(scene.solids[j], scene.solids[i].vertices[0]) > 0.5 ? 1 : 0;
            ASSERT_EQ(in, scene.depth[i]);
            nested += in > 0 ? 1 : 0;
            const int container = scene.container[i];
            wrong += container < 0 ? scene.inward[i] : scene.inward[i] == scene.inward[std::size_t(container)];
        }
        const MeshReport report = inspect(mesh);
        EXPECT_EQ(report.parts.closed, scene.solids.size());
        EXPECT_EQ(report.parts.nested, nested);
        EXPECT_EQ(report.parts.overlapping, 0u);
        if (report.turned == 0) {
            EXPECT_EQ(report.parts.wrong.size(), wrong);
        }
        // Turned by nesting, every second one inside the other is empty.
        const Mesh turned = turn_parts(mesh);
        EXPECT_TRUE(inspect(turned).parts.wrong.empty());
        EXPECT_EQ(inspect(turned).parts.to_turn, 0u);
        std::mt19937 random(seed + 1000);
        for (int k = 0; k < 40; ++k) {
            const auto coordinate = [&](double low, double high) {
                return low + (high - low) * double(random() % 100003) / 100003;
            };
            const Mesh& solid = scene.solids[random() % scene.solids.size()];
            const Vec3 v = solid.vertices[random() % solid.vertices.size()];
            const Vec3 p = v + Vec3{coordinate(-0.3, 0.3), coordinate(-0.3, 0.3), coordinate(-0.3, 0.3)};
            int in = 0;
            for (const Mesh& one : scene.solids) in += winding(one, p) > 0.5 ? 1 : 0;
            EXPECT_NEAR(winding(turned, p), in % 2, 1e-9);
        }
    }
}

TEST(Parts, OverlappingPartsStay) {
    // A hollow ball whose cavity crosses a bar within it: nobody knows what is meant.
    const Mesh hollow = zoo::joined(zoo::sphere({0, 0, 0}, 4, 3), zoo::sphere({0, 0, 0}, 2, 3));
    const Mesh mesh = zoo::joined(hollow, zoo::box({-3, -0.5, -0.5}, {3, 0.5, 0.5}));
    const PartsReport parts = inspect(mesh).parts;
    EXPECT_EQ(parts.overlapping, 2u);
    ASSERT_EQ(parts.wrong.size(), 2u);
    EXPECT_TRUE(parts.wrong[0].overlaps && parts.wrong[1].overlaps);
    EXPECT_EQ(parts.to_turn, 0u);
    EXPECT_EQ(turn_parts(mesh).triangles, mesh.triangles);
    // A ball where two balls overlap: they do not lie in each other.
    const Mesh lens = zoo::joined(zoo::joined(zoo::sphere({-1, 0, 0}, 2, 3), zoo::sphere({1, 0, 0}, 2, 3)),
                                  zoo::sphere({0, 0, 0}, 0.3, 2));
    const PartsReport in_lens = inspect(lens).parts;
    EXPECT_EQ(in_lens.nested, 1u);
    EXPECT_EQ(in_lens.to_turn, 0u);
    // The same surface twice, once inside out: they cancel, and stay.
    const Mesh ball = zoo::sphere({0, 0, 0}, 1, 2);
    const Mesh cancelled = zoo::joined(zoo::joined(ball, at(ball, {0, 0, 0})), zoo::reversed(ball));
    EXPECT_EQ(inspect(cancelled).parts.to_turn, 0u);
}

TEST(Parts, DoNotDependOnTheOrderOfTriangles) {
    const Mesh mesh = random_scene(7).mesh();
    const PartsReport a = inspect(mesh).parts, b = inspect(zoo::shuffled(mesh, 5)).parts;
    EXPECT_EQ(a.closed, b.closed);
    EXPECT_EQ(a.nested, b.nested);
    EXPECT_EQ(a.wrong.size(), b.wrong.size());
    EXPECT_EQ(a.to_turn, b.to_turn);
}

}  // namespace
}  // namespace its
