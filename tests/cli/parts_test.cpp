#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "support/zoo.h"

/// Closed parts that face the wrong way, as the commands report and turn them.
namespace its::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;

std::string data(const std::string& name) {
    return (std::filesystem::path(ITS_SOURCE_DIR) / "tests" / "data" / name).string();
}

/// The code of one point: −1 inside, 1 outside.
std::string side_of(const Workshop& shop, const std::string& shell, const std::string& point) {
    const std::string points = shop.add("points.xyz", point + "\n"), out = shop.path("codes.xyz");
    EXPECT_EQ(run({"query", shell, points, "-o", out, "-q"}).status, 0);
    const std::string line = content(out);
    return line.substr(line.find_last_of(' ') + 1, line.find('\n') - line.find_last_of(' ') - 1);
}

TEST(CliParts, AreNamedAndTurned) {
    const Workshop shop;
    const std::string shell = shop.path("shell.its");
    struct Case {
        std::string file, point, before, after, fault, text;
    };
    for (const Case& one :
         {Case{"cavity_wound_outward.obj", "2 2 2", "-1", "1", "like-its-container",
               "faces as the part around it"},
          Case{"mirrored_part_inside_out.obj", "5 0 0", "1", "-1", "inside-out", "inside out"},
          Case{"two_balls_one_inside_out.obj", "5 0 0", "1", "-1", "inside-out", "inside out"}}) {
        SCOPED_TRACE(one.file);
        const Result checked = run({"check", data(one.file), "--json"});
        EXPECT_THAT(checked.error, IsEmpty());
        const json parts = json::parse(checked.out)["parts"];
        EXPECT_EQ(parts["closed"], 2);
        EXPECT_EQ(parts["to_turn"], 1);
        ASSERT_EQ(parts["wrong"].size(), 1u);
        EXPECT_EQ(parts["wrong"][0]["fault"], one.fault);
        EXPECT_EQ(parts["wrong"][0]["overlaps"], false);
        EXPECT_THAT(run({"check", data(one.file)}).out, HasSubstr(one.text));
        const json mended = json::parse(run({"check", data(one.file), "--json", "--turn-parts"}).out)["parts"];
        EXPECT_EQ(mended["turned"], 1);
        EXPECT_TRUE(mended["wrong"].empty());

        const Result built = run({"build", data(one.file), "-o", shell, "--depth", "6", "--json"});
        EXPECT_THAT(built.error, HasSubstr("warning"));
        EXPECT_THAT(built.error, HasSubstr(one.text));
        EXPECT_EQ(json::parse(built.out)["mesh"]["parts"]["wrong"], parts["wrong"]);
        EXPECT_EQ(side_of(shop, shell, one.point), one.before);
        EXPECT_THAT(run({"build", data(one.file), "-o", shell, "--depth", "6"}).error, HasSubstr(one.text))
            << "the shell is unchanged, the warning is not";

        const Result turned =
            run({"build", data(one.file), "-o", shell, "--depth", "6", "--json", "--turn-parts"});
        EXPECT_THAT(turned.error, IsEmpty());
        EXPECT_EQ(json::parse(turned.out)["mesh"]["parts"]["turned"], 1);
        EXPECT_THAT(json::parse(turned.out)["sign_reason"].get<std::string>(), HasSubstr("by nesting"));
        EXPECT_EQ(side_of(shop, shell, one.point), one.after);
        EXPECT_EQ(run({"verify", shell, data(one.file), "--samples", "1000", "-q"}).status, 0);
    }
}

TEST(CliParts, RulesWithoutDirectionsTurnNothing) {
    const Workshop shop;
    const std::string mesh = data("cavity_wound_outward.obj"), shell = shop.path("shell.its");
    for (const char* rule : {"unsigned", "even-odd"}) {
        const Result built =
            run({"build", mesh, "-o", shell, "--depth", "5", "--sign", rule, "--turn-parts", "--json"});
        EXPECT_THAT(built.error, IsEmpty());
        EXPECT_EQ(json::parse(built.out)["mesh"]["parts"]["turned"], 0);
        EXPECT_EQ(run({"verify", shell, mesh, "--samples", "1000", "-q"}).status, 0);
    }
}

TEST(CliParts, SimplifyTurnsThemInItsResult) {
    const Workshop shop;
    const std::string mesh = data("two_balls_one_inside_out.obj"), out = shop.path("out.obj");
    const Result left = run({"simplify", mesh, "-o", out, "--depth", "5", "--samples", "0", "--json"});
    EXPECT_EQ(left.status, 0);
    EXPECT_THAT(left.error, HasSubstr("faces the wrong way"));
    EXPECT_EQ(json::parse(run({"check", out, "--json"}).out)["parts"]["wrong"].size(), 1u);
    for (const char* limit : {"--depth=5", "--tolerance=0.1"}) {
        const Result turned =
            run({"simplify", mesh, "-o", out, limit, "--turn-parts", "--samples", "0", "--json"});
        EXPECT_EQ(turned.status, 0);
        EXPECT_THAT(turned.error, IsEmpty());
        EXPECT_EQ(json::parse(turned.out)["parts"]["turned"], 1);
        EXPECT_TRUE(json::parse(run({"check", out, "--json"}).out)["parts"]["wrong"].empty());
    }
}

}  // namespace
}  // namespace its::cli_test
