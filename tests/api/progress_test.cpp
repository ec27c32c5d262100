#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "its/distance.h"
#ifdef ITS_PAGE
#include "its/page.h"
#endif
#ifdef ITS_PICTURE
#include "its/picture.h"
#endif
#include "its/query.h"
#include "its/shell.h"
#include "its/simplify.h"
#include "its/surface.h"
#include "its/verify.h"
#include "support/zoo.h"

namespace its {
namespace {

/// Runs a call whose progress must begin at 0, never fall and end at 1; and which must stop where it is told
/// to.
void expect_once(const std::string& name, const std::function<void(const Run&)>& call) {
    SCOPED_TRACE(name);
    for (const int threads : {1, 2}) {
        std::vector<double> seen;
        call({.threads = threads, .progress = [&](std::string_view stage, double fraction) {
                  EXPECT_FALSE(stage.empty());
                  seen.push_back(fraction);
                  return true;
              }});
        ASSERT_GE(seen.size(), 2u);
        EXPECT_EQ(seen.front(), 0.0);
        EXPECT_EQ(seen.back(), 1.0);
        EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
    }
    EXPECT_THROW(call({.progress = [](std::string_view, double fraction) { return fraction < 0.5; }}),
                 Cancelled);
}

TEST(Progress, RunsOnceThroughEveryCall) {
    const Mesh mesh = zoo::torus(1.0, 0.35, 48, 24);
    Mesh open = mesh;
    open.triangles.resize(open.triangles.size() - 40);
    for (const int depth : {0, 1, 5}) {
        expect_once("build", [&](const its::Run& run) { (void)build(mesh, {.depth = depth, .run = run}); });
        expect_once("build, open", [&](const its::Run& run) {
            (void)build(open, {.depth = depth, .sign = SignRule::generalized, .run = run});
        });
    }
    expect_once("build, candidates", [&](const its::Run& run) {
        (void)build(mesh, {.depth = 3, .extrema = Extrema::candidates, .run = run});
    });
    expect_once("build, lscg", [&](const its::Run& run) {
        (void)build(mesh, {.depth = 3, .solver = Solver::lscg, .run = run});
    });
    const ThinShell shell = build(mesh, {.depth = 5});
    for (const SurfaceSide side : {SurfaceSide::outer, SurfaceSide::inner, SurfaceSide::zero})
        for (const int resolution : {0, 50})
            expect_once("surface", [&](const its::Run& run) {
                (void)extract_surface(
                    shell, {.side = side, .resolution = resolution, .measure = resolution > 0, .run = run});
            });
    expect_once("verify", [&](const its::Run& run) {
        (void)verify(shell, mesh, {.samples = 5000, .grid_samples = 1000, .run = run});
    });
    for (const SimplifyOptions& options :
         {SimplifyOptions{.tolerance = 0.02}, SimplifyOptions{.faces = 300}, SimplifyOptions{.depth = 5},
          SimplifyOptions{.method = SimplifyMethod::qem, .faces = 300}})
        expect_once("simplify", [&](const its::Run& run) {
            SimplifyOptions with_run = options;
            with_run.run = run;
            (void)simplify(mesh, with_run);
        });
    const std::vector<Vec3> points(60'000, Vec3{0.1, 0.2, 0.3});
    std::vector<std::int8_t> codes(points.size());
    expect_once("query", [&](const its::Run& run) { Query(shell).classify(points, codes, run); });
    expect_once("distance", [&](const its::Run& run) { (void)mesh_distance(mesh, open, 50'000, run); });
#ifdef ITS_PICTURE
    expect_once("render",
                [&](const its::Run& run) { (void)render(shell, {.width = 256, .samples = 1, .run = run}); });
    expect_once("slice", [&](const its::Run& run) { (void)slice(shell, {.size = 64, .run = run}); });
#endif
#ifdef ITS_PAGE
    expect_once("page", [&](const its::Run& run) { (void)view_page(shell, {.run = run}); });
#endif
}

TEST(Progress, BuildCanBeStoppedAtEachStepOfExaminingTheMesh) {
    const Mesh mesh = zoo::torus(1.0, 0.35, 12, 8);
    int steps = 0;
    (void)build(mesh, {.depth = 3, .run = {.progress = [&](std::string_view stage, double) {
                                       steps += stage == "mesh";
                                       return true;
                                   }}});
    ASSERT_GE(steps, 8);
    for (int last = 1; last <= steps; ++last) {
        int left = last;
        EXPECT_THROW(
            (void)build(mesh, {.depth = 3, .run = {.progress = [&](auto, double) { return --left > 0; }}}),
            Cancelled);
        EXPECT_EQ(left, 0);
    }
}

TEST(Progress, PartsFollowEachOther) {
    std::vector<double> seen;
    Parts parts([&](std::string_view, double fraction) {
        seen.push_back(fraction);
        return true;
    });
    parts.until(0.5)("a", 0.5);
    const Progress half = parts.next(0.5);
    half("b", 0);
    half("b", 1);
    parts.until(0.2)("a part that ends before it begins", 1);
    parts.until(1)("c", 1);
    EXPECT_EQ(seen, (std::vector{0.25, 0.5, 0.75, 0.75, 1.0}));
    EXPECT_FALSE(Parts(Progress{}).until(1));
}

}  // namespace
}  // namespace its
