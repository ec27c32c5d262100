#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.h"

/// Every file of tests/data and of ITS_TEST_MESHES through all commands, without any option: the answers of
/// tests/data/corpus.tsv where it knows the file; for any other, success or a refusal that says why.
namespace its::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path data = fs::path(ITS_SOURCE_DIR) / "tests" / "data";

/// What is known of a file: the table's words by the names of their columns; none where it says "-".
using Known = std::map<std::string, std::string>;

std::vector<std::string> split(const std::string& line, char at) {
    std::vector<std::string> words;
    std::istringstream stream(line);
    for (std::string word; std::getline(stream, word, at);) words.push_back(word);
    return words;
}

std::map<std::string, Known> table() {
    std::map<std::string, Known> all;
    std::vector<std::string> names;
    for (const std::string& line : split(content(data / "corpus.tsv"), '\n')) {
        if (line.starts_with('#')) continue;
        const std::vector<std::string> words = split(line, '\t');
        if (names.empty()) {
            names = words;
            continue;
        }
        EXPECT_EQ(words.size(), names.size()) << line;
        Known& known = all[words[0]];
        for (std::size_t i = 1; i < std::min(words.size(), names.size()); ++i)
            if (words[i] != "-") known[names[i]] = words[i];
    }
    return all;
}

std::vector<fs::path> files_in(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        if (entry.is_regular_file() && entry.path().extension() != ".tsv") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

/// One file's way through the commands.
class Journey {
public:
    Journey(const fs::path& file, const Known& known) : mesh_(file.string()), known_(known) {}

    void go() {
        const Result check = run({"check", mesh_, "--json"}), build = run({"build", mesh_, "-o", shell_});
        expect_status(check, "check");
        expect_status(build, "build");
        if (known_.contains("says") && (build.status != 0 || known_.at("status") == "0")) {
            EXPECT_THAT(build.error, HasSubstr(known_.at("says")));
        }
        if (check.status == 0) compare(json::parse(check.out));
        if (build.status != 0) return;
        query();
        surface();
        simplify();
        const Result verify = run({"verify", shell_, mesh_});
        EXPECT_EQ(verify.status, 0) << verify.error << verify.out;
    }

private:
    /// 0, or 2 with one line that names the file and says more than that.
    void expect_status(const Result& result, const std::string& command) const {
        const std::string allowed = known_.contains("status") ? known_.at("status") : "0/2";
        EXPECT_THAT(allowed, HasSubstr(std::to_string(result.status))) << command << ": " << result.error;
        std::istringstream lines(result.error);
        int errors = 0;
        for (std::string line; std::getline(lines, line);) {
            EXPECT_LT(line.size(), 300) << line;
            EXPECT_THAT(line, testing::AnyOf(testing::StartsWith("its: warning: "),
                                             testing::StartsWith("its: error: ")));
            EXPECT_THAT(line, testing::Not(HasSubstr("internal error")));
            errors += line.starts_with("its: error: ");
        }
        EXPECT_EQ(errors, result.status == 0 ? 0 : 1) << command << ": " << result.error;
        if (result.status != 0) {
            EXPECT_THAT(result.error, HasSubstr(fs::path(mesh_).filename().string()));
        }
    }

    void compare(const json& report) const {
        const auto known = [&](const char* column) { return known_.contains(column) ? known_.at(column) : ""; };
        if (known("triangles") != "") {
            EXPECT_EQ(std::to_string(report["triangles"].get<std::uint64_t>()), known("triangles"));
        }
        if (known("closed") != "") {
            EXPECT_EQ(report["closed"], known("closed") == "yes");
        }
        if (known("sign") != "") {
            EXPECT_EQ(report["sign"], known("sign"));
        }
        if (known("volume") != "") {
            const double volume = std::stod(known("volume"));
            EXPECT_NEAR(report["signed_volume"], volume, 2e-5 * std::abs(volume) + 1e-12);
        }
    }

    std::vector<std::string> points(const char* column) const {
        return known_.contains(column) ? split(known_.at(column), ' ') : std::vector<std::string>{};
    }

    void query() const {
        std::vector<std::string> inside = points("inside"), all = inside;
        for (const std::string& point : points("outside")) all.push_back(point);
        if (all.empty()) all.emplace_back("0,0,0");
        std::string text = "x,y,z\n";
        for (const std::string& point : all) text += point + "\n";
        const Result result =
            run({"query", shell_, shop_.add("points.csv", text), "-o", shop_.path("sides.csv")});
        ASSERT_EQ(result.status, 0) << result.error;
        if (!known_.contains("outside")) return;
        const std::vector<std::string> lines = split(content(shop_.path("sides.csv")), '\n');
        ASSERT_EQ(lines.size(), all.size() + 1);
        for (std::size_t i = 0; i < all.size(); ++i)
            EXPECT_EQ(split(lines[i + 1], ',').at(3), i < inside.size() ? "-1" : "1") << all[i];
    }

    void surface() const {
        const Result result = run({"surface", shell_, "-o", shop_.path("surface.ply"), "--json"});
        ASSERT_EQ(result.status, 0) << result.error;
        const json surface = json::parse(result.out)["surfaces"][0];
        EXPECT_TRUE(surface["certified"] == true || surface["reason"] != "") << result.out;
        EXPECT_EQ(fs::exists(shop_.path("surface.ply")), surface["empty"] == false);
    }

    void simplify() const {
        const Result result = run({"simplify", mesh_, "-o", shop_.path("simplified.ply"), "--json"});
        ASSERT_EQ(result.status, 0) << result.error;
        const json report = json::parse(result.out);
        EXPECT_LE(report["faces_after"], report["faces_before"]);
        EXPECT_EQ(report["in_shell"], true) << "what it proves without any option";
    }

    const Workshop shop_;
    std::string mesh_;
    Known known_;
    std::string shell_ = shop_.path("shell.its");
};

void go_through(const fs::path& folder, const std::map<std::string, Known>& known) {
    for (const fs::path& file : files_in(folder)) {
        SCOPED_TRACE(file.filename().string());
        const auto row = known.find(file.filename().string());
        Journey(file, row == known.end() ? Known{} : row->second).go();
    }
}

TEST(Corpus, TheTableKnowsEveryFile) {
    const std::map<std::string, Known> known = table();
    for (const fs::path& file : files_in(data))
        EXPECT_TRUE(known.contains(file.filename().string())) << file.filename() << " is not in corpus.tsv";
    EXPECT_GT(known.size(), 20);
}

TEST(Corpus, AFileOfPointsIsAsked) {
    const Workshop shop;
    const std::string shell = shop.path("shell.its"), sides = shop.path("sides.csv");
    ASSERT_EQ(run({"build", (data / "cube.obj").string(), "-o", shell}).status, 0);
    const Result result = run({"query", shell, (data / "decimal_commas.csv").string(), "-o", sides});
    ASSERT_EQ(result.status, 0) << result.error;
    EXPECT_EQ(content(sides), "x,y,z,code\n0.5,0.25,1.5,1\n0.5,0.5,0.5,-1\n1.5,1.5,2.5,1\n");
}

TEST(SlowCorpus, FilesOfTheRepository) {
    go_through(data, table());
}

TEST(SlowCorpus, FilesOfTheTestMeshes) {
    const char* folder = std::getenv("ITS_TEST_MESHES");
    if (folder == nullptr) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    go_through(folder, table());
}

}  // namespace
}  // namespace its::cli_test
