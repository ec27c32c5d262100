#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>

#include "cli/program.h"
#include "support/zoo.h"

/// Files that strangers hand over: each is refused in one line, soon, and nothing is left behind.
namespace its::cli_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

void expect_refused(const Result& result, const std::string& reason = "") {
    EXPECT_EQ(result.status, 2) << result.error;
    EXPECT_THAT(result.out, IsEmpty());
    EXPECT_THAT(result.error, StartsWith("its: error: "));
    EXPECT_THAT(result.error, HasSubstr(reason));
    EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1) << result.error;
}

const std::vector<std::string> formats = {"obj", "stl", "ply", "off", "glb", "gltf", "3mf", "its"};

TEST(Strangers, NothingAndNonsenseInEveryFormat) {
    const Workshop shop;
    std::uint64_t state = 20240612;
    for (const std::string& format : formats) {
        std::string noise;
        for (int i = 0; i < 4000; ++i) {
            state = state * 6364136223846793005ull + 1442695040888963407ull;
            noise.push_back(char(state >> 56));
        }
        std::vector<std::string> names;
        for (const std::string& bytes : {std::string(), std::string("\n"), std::string(200, '\0'), noise}) {
            const std::string path = shop.add("x." + format, bytes);
            expect_refused(run({"check", path}), path);
            expect_refused(run({"build", path, "-o", shop.path("out.its")}), path);
            expect_refused(run({"info", path}), path);
        }
        std::filesystem::remove(shop / ("x." + format));
    }
    EXPECT_THAT(shop.names(), IsEmpty());
}

TEST(Strangers, WhatIsNoRegularFileIsNeverOpened) {
    const Workshop shop;
    ASSERT_EQ(mkfifo(shop.path("pipe.obj").c_str(), 0600), 0);
    std::filesystem::create_symlink("/dev/zero", shop / "zero.obj");
    std::filesystem::create_symlink("loop.obj", shop / "loop.obj");
    std::filesystem::create_symlink("nowhere.obj", shop / "dangling.obj");
    for (const char* name : {"pipe.obj", "zero.obj", "loop.obj", "dangling.obj"}) {
        expect_refused(run({"check", shop.path(name)}), name);
        expect_refused(run({"info", shop.path(name)}), name);
    }
    for (const char* path : {"/dev/zero", "/dev/null", "/proc/self/maps"})
        expect_refused(run({"check", path}), path);
}

TEST(Strangers, OddNamesStayInOneLine) {
    expect_refused(run({"check", ""}));
    expect_refused(run({"check", "two\nlines.obj"}), "two lines.obj");
    expect_refused(run({"check", std::string(5000, 'a')}), "too long");
}

TEST(Strangers, HugeClaimsInSmallFiles) {
    const Workshop shop;
    std::string stl(100, '\0');
    stl[82] = stl[83] = '\x3b';  // some 10⁹ triangles
    expect_refused(run({"check", shop.add("a.stl", stl)}));
    expect_refused(run({"check", shop.add("a.off", std::string("OFF\n1000000000 1000000000 0\n0 0 0\n"))}));
    expect_refused(run(
        {"check",
         shop.add(
             "a.ply",
             std::string(
                 "ply\nformat ascii 1.0\nelement vertex 1000000000\nproperty float x\nproperty float "
                 "y\nproperty float z\n"
                 "element face 1000000000\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n"))}));
}

TEST(Strangers, BadNumbersAndIndices) {
    const Workshop shop;
    for (const char* text :
         {"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "v inf 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
          "v 1.#QNAN 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
          "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 0 0\n", "f 1 2 3\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
          "v 0 0 0\nf 1 99999999999999999999 2\n"})
        expect_refused(run({"check", shop.add("a.obj", std::string(text))}), "a.obj");
    // Finite, and still beyond what exact predicates can take.
    const std::string huge =
        shop.add("huge.obj", std::string("v 1e308 0 0\nv -1e308 0 0\nv 0 1e308 0\nf 1 2 3\n"));
    expect_refused(run({"build", huge, "-o", shop.path("a.its"), "--depth", "3"}), "scale the mesh");
}

TEST(Strangers, DeepAndWideJson) {
    const Workshop shop;
    expect_refused(run({"check", shop.add("deep.gltf", "{\"a\":" + std::string(1000000, '['))}), "nested");
    std::string nodes = R"({"asset":{"version":"2.0"},"nodes":[{})";
    for (int i = 0; i < 2000000; ++i) nodes += ",{}";
    expect_refused(run({"check", shop.add("wide.gltf", nodes + "]}")}), "out of all proportion");
}

TEST(Strangers, AFullDiskLeavesNothingHalfWritten) {
    const Workshop shop;
    const std::string mesh = shop.add("ball.obj", zoo::sphere({0, 0, 0}, 1, 3));
    const std::string shell = shop.path("ball.its");
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "4"}).status, 0);
    const std::string before = content(shell), outer = shop.add("both-outer.ply", std::string("outer")),
                      inner = shop.add("both-inner.ply", std::string("inner"));
    // As good as a full disk: the child may write no file beyond 4 KiB, and ignores the signal that says so.
    rlimit old{};
    getrlimit(RLIMIT_FSIZE, &old);
    const auto old_action = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{4096, old.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    const Result rebuilt = run({"build", mesh, "-o", shell, "--depth", "5"});
    const Result first = run({"build", mesh, "-o", shop.path("new.its"), "--depth", "5"});
    const Result drawn = run({"slice", shell, "-o", shop.path("a.png"), "--size", "1024"});
    const Result both = run({"surface", shell, "-o", shop.path("both.ply"), "--side", "both"});
    setrlimit(RLIMIT_FSIZE, &old);
    std::signal(SIGXFSZ, old_action);
    expect_refused(rebuilt, "ball.its");
    expect_refused(first, "new.its");
    expect_refused(drawn, has_command("slice") ? "a.png" : "slice");
    expect_refused(both, "both-outer.ply");
    EXPECT_EQ(content(shell), before);
    EXPECT_EQ(content(outer), "outer");
    EXPECT_EQ(content(inner), "inner");
    EXPECT_THAT(shop.names(), ElementsAre("ball.its", "ball.obj", "both-inner.ply", "both-outer.ply"));
}

TEST(Strangers, DevicesAreNoPlaceToWrite) {
    const Workshop shop;
    const std::string mesh = shop.add("a.obj", zoo::tetrahedron());
    for (const char* device : {"/dev/full", "/dev/null"})
        expect_refused(run({"build", mesh, "-o", device, "--depth", "2"}), device);
}

}  // namespace
}  // namespace its::cli_test
