#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "cli/program.h"
#include "support/zoo.h"

/// No line on standard error has 300 bytes, however long the names are; names are known by their ends, and what
/// is to be done stands in the line.
namespace its::cli_test {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

void expect_short_lines(const Result& result, const std::string& what) {
    EXPECT_NE(result.error, "") << what;
    std::istringstream lines(result.error);
    for (std::string line; std::getline(lines, line);) EXPECT_LT(line.size(), 300) << what << ": " << line;
}

/// A path of some 4000 bytes, of words of this length between slashes.
std::string long_path(const fs::path& folder, const std::string& word, const std::string& name) {
    std::string path = folder.string();
    while (path.size() + word.size() + name.size() < 4000) path += "/" + word;
    return path + "/" + name;
}

TEST(LongNames, OfFilesThatAreNotThere) {
    const Workshop shop;
    const std::string mesh = shop.add("m.obj", zoo::tetrahedron()), shell = shop.path("m.its");
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "3", "-q"}).status, 0);
    const std::pair<std::string, std::string> kinds[] = {{std::string(40, 'a'), "x.obj"},
                                                         {"b b", "x.its"},
                                                         {"\xc3\xa9\xc3\xa9 ", "x.stl"},
                                                         {"c\nc", "x.ply"},
                                                         {std::string(200, 'd'), "x.png"}};
    for (const auto& [word, end] : kinds) {
        const std::string missing = long_path(shop.path("none"), word, end);
        ASSERT_GT(missing.size(), 3700);
        for (const std::vector<std::string>& arguments :
             std::vector<std::vector<std::string>>{{"check", missing},
                                                   {"build", missing, "-o", shop.path("o.its")},
                                                   {"build", mesh, "-o", missing},
                                                   {"info", missing},
                                                   {"query", shell, missing, "-o", shop.path("o.csv")},
                                                   {"query", shell, mesh, "-o", missing},
                                                   {"surface", missing, "-o", shop.path("o.obj")},
                                                   {"surface", shell, "-o", missing},
                                                   {"simplify", missing, "-o", shop.path("o.obj")},
                                                   {"simplify", mesh, "-o", missing},
                                                   {"slice", shell, "-o", missing},
                                                   {"render", missing, "-o", shop.path("o.png")},
                                                   {"view", shell, "-o", missing},
                                                   {"verify", missing, mesh},
                                                   {"verify", shell, missing}}) {
            const Result result = run(arguments);
            EXPECT_EQ(result.status, 2) << arguments[0];
            expect_short_lines(result, arguments[0] + " " + end);
        }
    }
}

TEST(LongNames, OfFilesThatCannotBeUsed) {
    const Workshop shop;
    const std::string folder =
        fs::path(long_path(fs::path(shop.path("d")), std::string(200, 'd'), "x")).parent_path().string();
    // Some file systems have less room than PATH_MAX.
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) GTEST_SKIP() << error.message();
    const auto add = [&](const std::string& name, const std::string& text) {
        std::string path = folder + "/" + name;
        const std::string near = shop.add(name, text);
        fs::copy_file(near, path);
        return path;
    };
    const std::string damaged = add("a.obj", "v 0 0 0\nf 1 2 3\n"), shell = add("a.its", "ITS?"),
                      points = add("a.csv", "x,y\n1,2\n"),
                      warned = add("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n");
    const Result check = run({"check", damaged});
    EXPECT_EQ(check.status, 2);
    EXPECT_THAT(check.error, HasSubstr("ddd/a.obj"));
    expect_short_lines(check, "check");
    const Result warning = run({"check", warned});
    EXPECT_EQ(warning.status, 0);
    EXPECT_THAT(warning.error, HasSubstr("ddd/b.obj"));
    expect_short_lines(warning, "warning");
    expect_short_lines(run({"info", shell}), "info");
    const std::string good = shop.add("m.obj", zoo::tetrahedron()), good_shell = shop.path("m.its");
    ASSERT_EQ(run({"build", good, "-o", good_shell, "--depth", "3", "-q"}).status, 0);
    expect_short_lines(run({"query", good_shell, points, "-o", shop.path("o.csv")}), "query");
    expect_short_lines(run({"build", warned, "-o", folder + "/a.its", "--sign", "winding"}), "sign rule");
    expect_short_lines(run({"build", warned, "-o", warned}), "same file");
    expect_short_lines(run({"build", good, "-o", folder}), "a folder");
    expect_short_lines(run({"surface", good_shell, "-o", folder + "/o.xyz"}), "extension");
}

TEST(LongNames, OfOptions) {
    const std::string word(4000, 'w');
    for (const std::vector<std::string>& arguments :
         std::vector<std::vector<std::string>>{{word},
                                               {"--" + word},
                                               {"check", "a", word},
                                               {"check", "a", "--" + word},
                                               {"build", "a", "-o", "b", "--depth", word},
                                               {"build", "a", "-o", "b", "--sign", word},
                                               {"build", "a", "-o", "b", "--weld", word}}) {
        const Result result = run(arguments);
        EXPECT_EQ(result.status, 2);
        expect_short_lines(result, arguments[0].substr(0, 10));
    }
}

}  // namespace
}  // namespace its::cli_test
