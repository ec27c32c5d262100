#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <thread>

#include "base/parallel.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#ifdef ITS_PAGE
#include "its/page.h"
#endif
#ifdef ITS_PICTURE
#include "its/picture.h"
#endif
#include "its/points.h"
#include "its/query.h"
#include "its/shell.h"
#include "its/shell_file.h"
#include "its/simplify.h"
#include "its/surface.h"
#ifdef ITS_VDB
#include "its/vdb.h"
#endif
#include "its/verify.h"
#include "support/zoo.h"
#include "threads/watch.h"

// The workers of a pool stay once they are there: the tests for one thread come first, and nothing before them
// may use more.

namespace its {
namespace {

namespace fs = std::filesystem;

/// A folder that is gone after the test.
struct Folder {
    fs::path path = fs::temp_directory_path() / fmt::format("its-threads-{}", ::getpid());
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    std::string operator/(const char* name) const { return (path / name).string(); }
};

/// Large enough for every loop to have several chunks.
Mesh closed_mesh() {
    return zoo::torus(1.0, 0.35, 200, 100);
}

Mesh open_mesh() {
    Mesh mesh = closed_mesh();
    mesh.triangles.erase(mesh.triangles.begin() + 300, mesh.triangles.begin() + 900);
    return mesh;
}

Mesh small_mesh() {
    return zoo::torus(1.0, 0.35, 48, 24);
}

std::vector<Vec3> many_points() {
    std::vector<Vec3> points(100'000);
    for (std::size_t i = 0; i < points.size(); ++i)
        points[i] = {std::fmod(0.754877666 * double(i), 3.0) - 1.5,
                     std::fmod(0.569840299 * double(i), 3.0) - 1.5,
                     std::fmod(0.618033989 * double(i), 1.0) - 0.5};
    return points;
}

/// Every public function that may use several threads, as many as `run` says.
class PublicCalls {
public:
    PublicCalls(const Run& run, const Folder& folder) : run_(run), folder_(folder) {}

    /// check(name) after each.
    void all(const std::function<void(const char*)>& check) {
        check_ = check;
        meshes();
        const ThinShell shell = shells();
        files(shell);
        queries(shell);
        results(shell);
        pictures(shell);
    }

private:
    void meshes() {
        (void)inspect(closed_, run_), check_("inspect, closed");
        (void)inspect(open_, run_), check_("inspect, open");
        (void)inspect(zoo::reversed(closed_), run_), check_("inspect, inside out");
        (void)oriented(open_, run_), check_("oriented");
        (void)mesh_distance(closed_, open_, 50'000, run_), check_("mesh_distance");
        const ClosestPoints closest(closed_, run_);
        check_("ClosestPoints");
        std::vector<ClosestPoint> found(points_.size());
        closest.find(points_, found, run_), check_("ClosestPoints::find");
        (void)estimate_memory(closed_, 8, run_), check_("estimate_memory");
        (void)input_hash(closed_), check_("input_hash");
    }

    ThinShell shells() {
        (void)build(open_, {.depth = 5, .run = run_}), check_("build, open");
        (void)build(open_, {.depth = 5, .sign = SignRule::unsigned_rule, .run = run_}),
            check_("build, unsigned");
        (void)build(small_, {.depth = 4, .solver = Solver::lscg, .run = run_}), check_("build, lscg");
        ThinShell shell = build(closed_, {.depth = 6, .run = run_});
        check_("build");
        (void)shell.grid_points(run_), check_("grid_points");
        (void)shell.mesh(), check_("mesh");
        return shell;
    }

    void files(const ThinShell& shell) {
        save(shell, folder_ / "a.its", run_), check_("save");
        (void)load(folder_ / "a.its", {.run = run_}), check_("load");
        (void)load(folder_ / "a.its", {.map = false, .run = run_}), check_("load, copied");
        (void)decode(encode(shell, run_), {.run = run_}), check_("encode, decode");
        write_mesh(closed_, folder_ / "a.ply"), check_("write_mesh");
        (void)read_mesh(folder_ / "a.ply"), check_("read_mesh");
    }

    void queries(const ThinShell& shell) {
        const Query query(shell);
        check_("Query");
        const ClosestSides closest(shell.mesh_view(), run_);
        check_("ClosestSides");
        std::vector<std::int8_t> codes(points_.size());
        std::vector<double> values(points_.size());
        std::vector<Vec3> gradients(points_.size());
        std::vector<Interval> bounds(points_.size());
        query.classify(points_, codes, run_), check_("classify");
        query.classify_shell(points_, codes, run_), check_("classify_shell");
        query.classify_shell(points_, codes, closest, run_), check_("classify_shell, closest");
        query.value(points_, values, run_), check_("value");
        query.gradient(points_, gradients, run_), check_("gradient");
        query.signed_distance_bound(points_, bounds, run_), check_("signed_distance_bound");
    }

    void results(const ThinShell& shell) {
        (void)extract_surface(shell, {.measure = true, .run = run_}), check_("extract_surface");
        (void)extract_surface(shell, {.side = SurfaceSide::inner, .resolution = 100, .run = run_});
        check_("extract_surface, resampled");
        (void)verify(shell, closed_, {.samples = 20'000, .grid_samples = 1000, .run = run_}), check_("verify");
        (void)simplify(small_, {.tolerance = 0.02, .run = run_}), check_("simplify, tolerance");
        (void)simplify(small_, {.faces = 400, .run = run_}), check_("simplify, faces");
        (void)simplify(small_, {.depth = 5, .run = run_}), check_("simplify, depth");
        (void)simplify(small_, {.method = SimplifyMethod::priority, .faces = 400, .run = run_});
        check_("simplify, priority");
    }

    void pictures([[maybe_unused]] const ThinShell& shell) {
#ifdef ITS_PICTURE
        (void)slice(shell, {.size = 200, .cells = true, .run = run_}), check_("slice");
        (void)render(shell, {.width = 256, .samples = 1, .run = run_}), check_("render");
#endif
#ifdef ITS_PAGE
        (void)view_page(shell, {.run = run_}), check_("view_page");
#endif
#ifdef ITS_VDB
        write_vdb(shell, folder_ / "a.vdb", {.run = run_}), check_("write_vdb");
#endif
    }

    Run run_;
    const Folder& folder_;
    std::function<void(const char*)> check_;
    Mesh closed_ = closed_mesh(), open_ = open_mesh(), small_ = small_mesh();
    std::vector<Vec3> points_ = many_points();
};

void expect_at_most(int threads) {
    const Folder folder;
    threads_test::Watch watch;
    if (watch.most() == 0) GTEST_SKIP() << "the system does not count threads";
    const int before = watch.most();
    PublicCalls({.threads = threads}, folder).all([&](const char* call) {
        EXPECT_LE(watch.most(), before + threads - 1) << call << " with " << threads << " threads";
    });
}

TEST(Threads, OneIsOneInEveryPublicCall) {
    expect_at_most(1);
}

TEST(Threads, TwoAreAtMostTwoInEveryPublicCall) {
    expect_at_most(2);
}

TEST(Threads, WithinACallAreNeverMore) {
    with_threads(1, [] {
        const std::thread::id caller = std::this_thread::get_id();
        with_threads(0, [&] {
            parallel_for(1000, 1, [&](std::uint64_t) { ASSERT_EQ(std::this_thread::get_id(), caller); });
        });
    });
}

TEST(Threads, TheWatchSeesThem) {
    threads_test::Watch watch;
    if (watch.most() == 0 || std::thread::hardware_concurrency() < 2) GTEST_SKIP();
    with_threads(2, [] {
        parallel_for(64, 1, [](std::uint64_t) { std::this_thread::sleep_for(std::chrono::milliseconds(1)); });
    });
    EXPECT_GE(watch.most(), 2);
}

/// Commands that say what they were built without.
const std::set<std::string> left_out = {
#ifndef ITS_PICTURE
    "render",
    "slice",
#endif
#ifndef ITS_PAGE
    "view",
#endif
};

/// A quick job for every command; the shell and the mesh are there.
std::map<std::string, std::vector<std::string>> jobs(const Folder& folder) {
    const std::string mesh = folder / "a.ply", shell = folder / "a.its";
    return {{"batch", {folder / "in", "-o", folder / "out", "--retry"}},
            {"build", {mesh, "-o", shell, "--depth", "6", "--force"}},
            {"check", {mesh}},
            {"info", {shell}},
            {"offset", {mesh, "-o", folder / "o.ply", "--distance", "1%"}},
            {"query", {shell, folder / "p.ply", "-o", folder / "q.npy", "--value", "--gradient", "--closest"}},
            {"render", {shell, "-o", folder / "r.png", "--size", "256", "--samples", "1"}},
            {"simplify", {mesh, "-o", folder / "s.ply", "--faces", "2000"}},
            {"slice", {shell, "-o", folder / "s.png", "--size", "200", "--mesh", mesh}},
            {"surface", {shell, "-o", folder / "s.glb", "--side", "both"}},
            {"verify", {shell, mesh, "--samples", "10000"}},
            {"verify-cage", {folder / "cage.ply", mesh}},
            {"view", {shell, "-o", folder / "v.html"}},
            {"wrap", {mesh, "-o", folder / "w.ply", "--clearance", "1%"}}};
}

TEST(Threads, EveryCommandObeys) {
    if (threads_test::threads_of("self") == 0) GTEST_SKIP() << "the system does not count threads";
    const Folder folder;
    write_mesh(open_mesh(), folder / "a.ply");
    write_mesh(zoo::box({-3, -3, -3}, {3, 3, 3}), folder / "cage.ply");
    fs::create_directory(folder / "in");
    for (const char* name : {"in/1.ply", "in/2.ply", "in/3.ply"}) write_mesh(open_mesh(), folder / name);
    save(build(open_mesh(), {.depth = 6, .run = {.threads = 1}}), folder / "a.its");
    const std::vector<Vec3> points = many_points();
    const std::vector<std::int8_t> codes(points.size());
    write_points(folder / "p.ply", points, codes);
    auto all = jobs(folder);
    const int alone = threads_test::run_command({"--version"}).most;
    for (const std::string& command : threads_test::commands()) {
        ASSERT_TRUE(all.contains(command)) << command << " needs a job in this test";
        if (left_out.contains(command)) continue;
        for (const int threads : {1, 2}) {
            std::vector<std::string> words = {command};
            words.insert(words.end(), all[command].begin(), all[command].end());
            words.insert(words.end(), {"--quiet", "--threads", std::to_string(threads)});
            if (command == "batch")
                words.insert(words.end(), {"--", "check", "--weld", std::to_string(threads)});
            const threads_test::CommandRun run = threads_test::run_command(words);
            EXPECT_EQ(run.status, 0) << command;
            EXPECT_LE(run.most, std::max(alone, 1) + threads - 1)
                << command << " with " << threads << " threads";
        }
    }
}

}  // namespace
}  // namespace its
