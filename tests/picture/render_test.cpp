#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "its/picture.h"
#include "mesh/normals.h"
#include "picture/rays.h"
#include "picture/tracer.h"
#include "support/zoo.h"

namespace its {
namespace {

ThinShell build_at(const Mesh& mesh, int depth) {
    return build(mesh, {.depth = depth});
}

struct Counts {
    int red = 0, blue = 0, yellow = 0, grey = 0, white = 0;
};

Counts count_colours(const Image& image, const picture::PixelRect& part) {
    Counts counts;
    for (int y = part.y; y < part.y + part.height; ++y)
        for (int x = part.x; x < part.x + part.width; ++x) {
            const picture::Rgb c = picture::pixel(image, x, y);
            const int r = c[0], g = c[1], b = c[2];
            counts.red += r > g + 50 && r > b + 50 && g < b + 40;
            counts.blue += b > r + 40 && b > g + 15;
            counts.yellow += r > b + 60 && g > b + 40;
            counts.grey += std::abs(r - g) < 12 && std::abs(g - b) < 16 && r < 236;
            counts.white += r == 255 && g == 255 && b == 255;
        }
    return counts;
}

TEST(Rays, MeetABallWhereTheyShould) {
    picture::RayScene scene;
    scene.add(zoo::sphere({0, 0, 0}, 1, 5));
    scene.commit();
    for (int i = 0; i < 200; ++i) {
        const double a = 2.4 * i, z = -0.95 + 0.0095 * i, r = std::sqrt(1 - z * z);
        const Vec3 out{r * std::cos(a), r * std::sin(a), z};
        const auto hit = scene.nearest({3 * out, -1 * out});
        ASSERT_TRUE(hit);
        EXPECT_NEAR(hit->distance, 2, 2e-3);  // the mesh is within 2e-3 of the ball
        EXPECT_TRUE(scene.blocked({Vec3{}, out}));
        EXPECT_FALSE(scene.blocked({1.01 * out, out}));
        EXPECT_FALSE(scene.blocked({3 * out, -1 * out, 0, 1.9}));
    }
}

TEST(Rays, LeaveTheThreadsOfTheProcessAlone) {
#ifdef ITS_SANITIZE_THREAD
    GTEST_SKIP() << "under the thread sanitizer Embree runs on one thread";
#endif
    using oneapi::tbb::global_control;
    const auto before = global_control::active_value(global_control::max_allowed_parallelism);
    const picture::RayScene scene;
    EXPECT_EQ(global_control::active_value(global_control::max_allowed_parallelism), before);
}

TEST(Rays, HalfSpacesCut) {
    picture::RayScene scene;
    scene.add(zoo::box({-1, -1, -1}, {1, 1, 1}), {{1, 0, 0}, 0.5});
    scene.add(zoo::box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}));
    scene.commit();
    // Along −x the near side is cut away, and what is seen first is the inner box.
    const auto hit = scene.nearest({{3, 0.02, 0.03}, {-1, 0, 0}});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->body, 1u);
    EXPECT_NEAR(hit->distance, 2.9, 1e-6);
    // Down on the part that is cut away, and on the one that is kept.
    EXPECT_FALSE(scene.nearest({{0.7, 0.02, 3}, {0, 0, -1}}));
    EXPECT_TRUE(scene.nearest({{0.3, 0.02, 3}, {0, 0, -1}}));
    EXPECT_FALSE(scene.blocked({{0.7, 0.02, 3}, {0, 0, -1}}));
}

TEST(Render, ShowsAllFourInTheirColours) {
    const Image image = render(build_at(zoo::torus(1, 0.4, 48, 24), 5), {.width = 400, .samples = 2});
    EXPECT_EQ(image.width, 400);
    EXPECT_EQ(image.height, 240);
    // A wide body: a large panel, and inner surface, mesh, outer surface in a column.
    const Counts main = count_colours(image, {0, 0, 268, 210});
    EXPECT_GT(main.red, 300);
    EXPECT_GT(main.blue, 300);
    EXPECT_GT(main.yellow, 20);
    EXPECT_GT(main.grey, 300);
    const Counts inner = count_colours(image, {270, 0, 130, 55}),
                 mesh = count_colours(image, {270, 80, 130, 55}),
                 outer = count_colours(image, {270, 160, 130, 55});
    EXPECT_GT(inner.blue, 200);
    EXPECT_EQ(inner.red + mesh.red + mesh.blue + outer.blue, 0);
    EXPECT_GT(mesh.grey, 200);
    EXPECT_GT(outer.red, 200);
    EXPECT_GT(inner.white, 1000);
}

TEST(Render, SameBytesForAnyNumberOfThreads) {
    const ThinShell shell = build_at(zoo::torus(1, 0.4, 24, 12), 4);
    const Image one = render(shell, {.width = 256, .samples = 2, .run = {.threads = 1}});
    const Image two = render(shell, {.width = 256, .samples = 2, .run = {.threads = 2}});
    EXPECT_EQ(one.rgb, two.rgb);
}

TEST(Render, TurnsWithTheModel) {
    // The same body with its axes shifted cyclically, and another axis upwards, is the same picture.
    const Mesh body = zoo::torus(1, 0.4, 32, 16);
    Mesh shifted = body;
    for (Vec3& v : shifted.vertices) v = {v.y, v.z, v.x};  // z went to y
    const Image a = render(build_at(body, 4), {.width = 256, .samples = 2});
    const Image b = render(build_at(shifted, 4), {.width = 256, .up = 1, .samples = 2});
    ASSERT_EQ(a.rgb.size(), b.rgb.size());
    int differing = 0;  // the octree's numbers may round differently
    for (std::size_t i = 0; i < a.rgb.size(); ++i) differing += std::abs(int(a.rgb[i]) - int(b.rgb[i])) > 24;
    EXPECT_LT(differing, int(a.rgb.size()) / 50);
}

TEST(Render, DrawsEveryKindOfMesh) {
    for (const zoo::Entry& entry : zoo::all()) {
        const Image image = render(build_at(entry.mesh, 3), {.width = 256, .samples = 1});
        EXPECT_EQ(image.rgb.size(), 3 * std::size_t(image.width) * std::size_t(image.height)) << entry.name;
        EXPECT_LT(count_colours(image, {0, 0, image.width, image.height}).white, image.width * image.height)
            << entry.name;
    }
}

TEST(Render, RefusesOptionsOutOfRange) {
    const ThinShell shell = build_at(zoo::box({0, 0, 0}, {1, 1, 1}), 2);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const RenderOptions& wrong : std::vector<RenderOptions>{{.width = 255},
                                                                 {.width = 8193},
                                                                 {.up = 3},
                                                                 {.azimuth = nan},
                                                                 {.elevation = -1},
                                                                 {.elevation = 81},
                                                                 {.cut = nan},
                                                                 {.at = 1.1},
                                                                 {.samples = 0},
                                                                 {.samples = 4097},
                                                                 {.resolution = -1},
                                                                 {.run = {.threads = -1}}})
        EXPECT_THROW(render(shell, wrong), OptionError);
}

TEST(Render, CanBeStopped) {
    const ThinShell shell = build_at(zoo::torus(1, 0.4, 24, 12), 4);
    int calls = 0;
    RenderOptions options{.width = 256, .samples = 1};
    options.run.progress = [&](std::string_view stage, double fraction) {
        EXPECT_GE(fraction, 0);
        EXPECT_LE(fraction, 1);
        return !(stage == "render" && ++calls > 3);
    };
    EXPECT_THROW(render(shell, options), Cancelled);
}

}  // namespace
}  // namespace its
