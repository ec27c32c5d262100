#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "cli/program.h"
#include "support/zoo.h"

/// `its batch`: whatever single meshes do, the others are done, and a run that was ended goes on where it was.
namespace its::cli_test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

/// Another run of the program, which is not waited for.
class Background {
public:
    explicit Background(const std::vector<std::string>& arguments) {
        std::vector<std::string> words = {ITS_PROGRAM};
        words.insert(words.end(), arguments.begin(), arguments.end());
        std::vector<char*> pointers;
        for (std::string& word : words) pointers.push_back(word.data());
        pointers.push_back(nullptr);
        child_ = fork();
        if (child_ == 0) {
            execv(pointers[0], pointers.data());
            _exit(127);
        }
    }
    ~Background() { end(SIGKILL); }
    Background(const Background&) = delete;
    Background& operator=(const Background&) = delete;

    /// The exit status, or 128 + the signal's number.
    int end(int signal) {
        if (child_ == 0) return status_;
        kill(child_, signal);
        int status = 0;
        waitpid(child_, &status, 0);
        child_ = 0;
        return status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }

private:
    pid_t child_ = 0;
    int status_ = 0;
};

/// A folder of meshes: some good ones, one in a folder of its own, one that is none, and what is no mesh.
struct Models {
    Models() {
        std::filesystem::create_directory(shop / "in");
        std::filesystem::create_directory(shop / "in/deep");
        shop.add("in/cube.obj", zoo::box({0, 0, 0}, {1, 1, 1}));
        shop.add("in/torus.ply", zoo::torus(1, 0.3, 24, 12));
        shop.add("in/deep/tetrahedron.STL", zoo::tetrahedron());
        shop.add("in/bad.off", std::string("OFF\nnothing"));
        shop.add("in/notes.txt", std::string("no mesh"));
    }

    Result go(std::vector<std::string> words, const std::vector<std::string>& options = {}) const {
        std::vector<std::string> all = {"batch",  shop.path("in"), "-o", shop.path("out"),
                                        "--json", "--threads",     "2"};
        all.insert(all.end(), options.begin(), options.end());
        all.emplace_back("--");
        all.insert(all.end(), words.begin(), words.end());
        return run(all);
    }

    std::vector<json> lines() const {
        std::vector<json> found;
        std::ifstream file(shop / "out/manifest.jsonl");
        for (std::string line; std::getline(file, line);) found.push_back(json::parse(line));
        return found;
    }

    Workshop shop;
};

TEST(Batch, DoesAllThatCanBeDone) {
    const Models models;
    const Result result = models.go({"build", "--depth", "4"});
    EXPECT_EQ(result.status, 1) << result.error;
    const json report = json::parse(result.out);
    EXPECT_EQ(report["meshes"], 4);
    EXPECT_EQ(report["counts"], json({{"done", 3}, {"failed", 1}}));
    EXPECT_THAT(report["failures"][0].get<std::string>(), HasSubstr("bad.off: failed: "));
    for (const char* name : {"cube.obj.its", "torus.ply.its", "deep/tetrahedron.STL.its"}) {
        const Result info = run({"info", models.shop.path(std::string("out/") + name), "--json"});
        EXPECT_EQ(json::parse(info.out)["depth"], 4) << name;
    }
    std::vector<std::string> meshes;
    for (const json& line : models.lines()) {
        meshes.push_back(line["mesh"]);
        EXPECT_EQ(line["job"], "its build --depth 4");
        EXPECT_GT(line["size"], 0);
        EXPECT_EQ(line["status"] == "done", line["mesh"] != "bad.off");
        if (line["status"] == "done") {
            EXPECT_EQ(line["result"]["depth"], 4);
        }
    }
    std::sort(meshes.begin(), meshes.end());
    EXPECT_THAT(meshes, ElementsAre("bad.off", "cube.obj", "deep/tetrahedron.STL", "torus.ply"));
    EXPECT_THAT(content(models.shop / "out/summary.svg"), HasSubstr("thickness"));
}

TEST(Batch, DoesOnlyWhatIsNotDone) {
    const Models models;
    const auto before = [&](const Result& result) { return json::parse(result.out)["done_before"].get<int>(); };
    EXPECT_EQ(before(models.go({"check"})), 0);
    EXPECT_EQ(before(models.go({"check"})), 4);
    EXPECT_EQ(before(models.go({"check"}, {"--retry"})), 3);
    models.shop.add("in/bad.off", zoo::tetrahedron());
    const Result mended = models.go({"check"});
    EXPECT_EQ(before(mended), 3);
    EXPECT_EQ(mended.status, 0) << mended.out;
    EXPECT_EQ(before(models.go({"check", "--turn-parts"})), 0) << "another job";
}

TEST(Batch, OthersOutliveWhatTakesTooLong) {
    const Models models;
    const Result result = models.go({"build"}, {"--seconds", "1e-9"});
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(json::parse(result.out)["counts"], json({{"timeout", 4}}));
    EXPECT_EQ(models.lines().size(), 4u);
}

TEST(Batch, OptionsReachTheCommand) {
    const Models models;
    EXPECT_EQ(models.go({"simplify", "--faces", "100"}, {"--extension", "stl"}).status, 1);
    EXPECT_TRUE(std::filesystem::exists(models.shop / "out/torus.ply.stl"));
    for (const json& line : models.lines()) {
        if (line["mesh"] == "torus.ply") {
            EXPECT_EQ(line["result"]["faces_after"], 100);
        }
    }
    const Result refused = models.go({"build", "--depth", "9"}, {"--max-memory", "100M"});
    EXPECT_THAT(refused.out, HasSubstr("memory"));
}

TEST(Batch, WorksOnShells) {
    const Models models;
    models.go({"build", "--depth", "4"});
    const Result result = run({"batch", models.shop.path("out"), "-o", models.shop.path("wraps"), "--json",
                               "--extension", ".off", "--", "surface", "--side", "outer"});
    EXPECT_EQ(result.status, 0) << result.error << result.out;
    EXPECT_EQ(json::parse(result.out)["meshes"], 3);
    EXPECT_TRUE(std::filesystem::exists(models.shop / "wraps/deep/tetrahedron.STL.its.off"));
}

TEST(Batch, HalfALineIsCutOff) {
    const Models models;
    models.go({"check"});
    const std::string text = content(models.shop / "out/manifest.jsonl");
    const auto count = [](const std::string& t) { return int(std::count(t.begin(), t.end(), '\n')); };
    for (std::size_t keep = 0; keep < text.size(); keep += 97) {
        models.shop.add("out/manifest.jsonl", text.substr(0, keep));
        const Result again = models.go({"check"});
        EXPECT_EQ(json::parse(again.out)["done_before"], count(text.substr(0, keep)));
        EXPECT_EQ(count(content(models.shop / "out/manifest.jsonl")), 4);
    }
    for (const char* line : {"{}", "[1]", "{\"mesh\":3}", "{\"mesh\":\"a\",\"job\":3}",
                             "{\"mesh\":\"a\",\"seconds\":\"1\"}", "nonsense"}) {
        models.shop.add("out/manifest.jsonl", line + std::string("\n"));
        EXPECT_THAT(models.go({"check"}).error, HasSubstr("line 1 is none of a manifest")) << line;
    }
}

TEST(Batch, LinksHaveTheirOwnNames) {
    const Models models;
    std::filesystem::create_directory(models.shop / "elsewhere");
    models.shop.add("elsewhere/far.obj", zoo::tetrahedron());
    for (const char* name : {"in/one.obj", "in/two.obj"})
        std::filesystem::create_symlink(models.shop / "elsewhere/far.obj", models.shop / name);
    std::filesystem::create_symlink(models.shop / "in/self.obj", models.shop / "in/self.obj");
    std::filesystem::create_symlink(models.shop / "nowhere", models.shop / "in/broken.obj");
    const json report = json::parse(models.go({"build", "--depth", "3"}).out);
    EXPECT_EQ(report["counts"], json({{"done", 5}, {"failed", 3}})) << report;
    EXPECT_TRUE(std::filesystem::exists(models.shop / "out/one.obj.its"));
    EXPECT_TRUE(std::filesystem::exists(models.shop / "out/two.obj.its"));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(models.shop / "elsewhere"), {}), 1);
}

TEST(Batch, ResultsAreNoInput) {
    const Models models;
    const std::string in = models.shop.path("in");
    const std::vector<std::string> again = {"batch", in, "-o", in + "/results", "--json", "--", "wrap"};
    EXPECT_EQ(json::parse(run(again).out)["meshes"], 4);
    EXPECT_EQ(json::parse(run(again).out)["meshes"], 4);
    EXPECT_THAT(run({"batch", in, "-o", in + "/../in", "--", "check"}).error,
                HasSubstr("a folder of their own"));
}

TEST(Batch, WhatStandsInTheWayOfOneIsItsOwn) {
    const Models models;
    std::filesystem::create_directory(models.shop / "out");
    models.shop.add("out/deep", std::string("a file where a folder is needed"));
    EXPECT_EQ(json::parse(models.go({"build", "--depth", "3"}).out)["counts"],
              json({{"done", 2}, {"failed", 2}}));
}

/// A parent may have asked not to be told how children end, which programs inherit.
TEST(Batch, FailuresAreSeenWhoeverStartsIt) {
    const Models models;
    const auto before = std::signal(SIGCHLD, SIG_IGN);
    Background job({"batch", models.shop.path("in"), "-o", models.shop.path("out"), "--quiet", "--", "simplify",
                    "--tolerance", "-5"});
    std::signal(SIGCHLD, before);
    EXPECT_EQ(job.end(0), 1);
    for (const json& line : models.lines()) EXPECT_EQ(line["status"], "failed") << line;
}

TEST(Batch, SaysWhatCannotBeDone) {
    const Models models;
    const auto expect = [&](const Result& result, const std::string& text) {
        EXPECT_EQ(result.status, 2);
        EXPECT_THAT(result.error, HasSubstr(text));
    };
    expect(models.go({"verify"}), "choose among build");
    expect(models.go({"wrap", "--help"}), "its help wrap");
    EXPECT_FALSE(std::filesystem::exists(models.shop / "out"));
    expect(run({"batch", models.shop.path("nowhere"), "-o", models.shop.path("out"), "--", "check"}),
           "no such folder");
    expect(run({"batch", models.shop.path("in"), "-o", models.shop.path("in/cube.obj"), "--", "check"}),
           "folder");
    std::filesystem::create_directory(models.shop / "empty");
    expect(run({"batch", models.shop.path("empty"), "-o", models.shop.path("out"), "--", "check"}),
           "no meshes");
    expect(models.go({"check"}, {"--seconds", "0"}), "--seconds");
}

/// Many meshes that take a while each, so that a run can be met on its way.
struct LongRun {
    LongRun() {
        std::filesystem::create_directory(shop / "in");
        const Mesh mesh = zoo::torus(1, 0.3, 60, 30);
        for (int i = 10; i < 40; ++i) shop.add(fmt::format("in/torus{}.ply", i), mesh);
    }

    void wait_for_lines(int count) const {
        const auto lines = [&] {
            const std::string text = std::filesystem::exists(manifest()) ? content(manifest()) : "";
            return int(std::count(text.begin(), text.end(), '\n'));
        };
        while (lines() < count) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    std::filesystem::path manifest() const { return shop / "out/manifest.jsonl"; }

    Workshop shop;
    std::vector<std::string> arguments = {"batch", shop.path("in"), "-o", shop.path("out"), "--threads",
                                          "2",     "--json",        "--", "build",          "--depth",
                                          "7"};
};

TEST(Batch, AKilledRunIsTakenUp) {
    const LongRun job;
    Background first(job.arguments);
    job.wait_for_lines(2);
    const Result second = run(job.arguments);
    EXPECT_EQ(second.status, 2);
    EXPECT_THAT(second.error, HasSubstr("another run is at work"));
    EXPECT_EQ(first.end(SIGKILL), 128 + SIGKILL);
    const Result result = run(job.arguments);
    EXPECT_EQ(result.status, 0) << result.error;
    EXPECT_THAT(result.error, testing::IsEmpty());
    const json report = json::parse(result.out);
    EXPECT_GE(report["done_before"], 2);
    EXPECT_LT(report["done_before"], 30);
    EXPECT_EQ(report["counts"], json({{"done", 30}}));
}

TEST(Batch, CtrlCKeepsWhatIsDone) {
    const LongRun job;
    Background first(job.arguments);
    job.wait_for_lines(2);
    EXPECT_EQ(first.end(SIGINT), 128 + SIGINT);
    const json report = json::parse(run(job.arguments).out);
    EXPECT_GE(report["done_before"], 2);
    EXPECT_EQ(report["counts"], json({{"done", 30}}));
}

}  // namespace
}  // namespace its::cli_test
