#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

/// its wrap, its offset.
namespace its::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class WrapCommand : public testing::Test {
protected:
    /// Refused in one line that says `part`, and nothing is written.
    void expect_refused(const std::vector<std::string>& arguments, const std::string& part) {
        const auto before = shop.names();
        const Result result = run(arguments);
        EXPECT_EQ(result.status, 2) << result.out;
        EXPECT_THAT(result.error, HasSubstr(part));
        EXPECT_EQ(std::ranges::count(result.error, '\n'), 1) << result.error;
        EXPECT_EQ(shop.names(), before);
    }

    const Workshop shop;
    const std::string ball = shop.add("ball.obj", zoo::sphere({1, 2, 3}, 2, 3));
    const std::string sheet = shop.add("sheet.obj", zoo::sheet(3));
};

TEST_F(WrapCommand, WritesBothSidesInEveryFormat) {
    for (const std::string extension : {"obj", "ply", "stl", "off"}) {
        const Result result = run({"wrap", ball, "-o", shop.path("out." + extension), "--clearance", "0.2",
                                   "--slack", "1%", "--side", "both", "--json"});
        ASSERT_EQ(result.status, 0) << result.error;
        const json report = json::parse(result.out);
        EXPECT_EQ(report["sign"], "winding");
        ASSERT_EQ(report["wraps"].size(), 2);
        for (const json& wrap : report["wraps"]) {
            EXPECT_EQ(wrap["file"], shop.path("out-" + wrap["side"].get<std::string>() + "." + extension));
            EXPECT_GE(wrap["distance_lower"], 0.2);
            EXPECT_LE(wrap["distance_upper"], 0.2 + 0.01 * 4.001);
            EXPECT_LE(wrap["distance_to_mesh"], wrap["distance_upper"]);
            const MeshReport read = inspect(read_mesh(wrap["file"].get<std::string>()).mesh);
            EXPECT_EQ(read.triangles, wrap["faces"]);
            EXPECT_TRUE(read.closed && read.oriented);
            EXPECT_GT(read.signed_volume, 0);
        }
        EXPECT_GT(report["wraps"][0]["volume"], report["mesh"]["volume"]);
        EXPECT_LT(report["wraps"][1]["volume"], report["mesh"]["volume"]);
    }
    const Result glb =
        run({"wrap", ball, "-o", shop.path("out.glb"), "--clearance", "0.2", "--side", "both", "-q"});
    EXPECT_EQ(glb.status, 0) << glb.error;
    EXPECT_EQ(glb.out, "");
    EXPECT_TRUE(std::filesystem::exists(shop.path("out.glb")));
}

TEST_F(WrapCommand, OffsetIsAWrapOnTheSideOfItsSign) {
    const std::string a = shop.path("a.ply"), b = shop.path("b.ply");
    for (const auto& [distance, clearance, side] :
         {std::array<std::string, 3>{"0.3", "0.3", "outer"}, {"-0.3", "0.3", "inner"}, {"0", "0", "outer"}}) {
        const Result offset = run({"offset", ball, "-o", a, "--distance", distance, "--slack", "2%", "-q"});
        ASSERT_EQ(offset.status, 0) << offset.error;
        const Result wrap =
            run({"wrap", ball, "-o", b, "--clearance", clearance, "--side", side, "--slack", "2%", "-q"});
        ASSERT_EQ(wrap.status, 0) << wrap.error;
        EXPECT_EQ(content(a), content(b));
    }
}

TEST_F(WrapCommand, RefusesInOneLine) {
    const std::string out = shop.path("out.ply");
    expect_refused({"wrap", sheet, "-o", out, "--side", "inner"}, "not closed");
    expect_refused({"wrap", sheet, "-o", out, "--side", "both"}, "not closed");
    expect_refused({"wrap", ball, "-o", out, "--side", "inner", "--clearance", "2.5"}, "no point inside");
    expect_refused({"wrap", ball, "-o", out, "--clearance", "-1"}, "at least 0");
    expect_refused({"wrap", ball, "-o", out, "--slack", "0"}, "larger than 0");
    expect_refused({"wrap", ball, "-o", out, "--slack", "1e-14"}, "slack");
    expect_refused({"wrap", ball, "-o", shop.path("out.xyz")}, "extension");
    expect_refused({"offset", ball, "-o", out}, "--distance");
    expect_refused({"offset", ball, "-o", out, "--distance", "far"}, "is no length");
    expect_refused({"wrap", ball, "-o", out, "--slack", "0.01%", "--max-memory", "60M"}, "memory");
}

TEST_F(WrapCommand, VerifyCageTellsWhetherItHolds) {
    const std::string wrap = shop.path("wrap.stl"), within = shop.path("within.stl");
    ASSERT_EQ(run({"wrap", ball, "-o", wrap, "--clearance", "0.2", "--slack", "0.1", "-q"}).status, 0);
    ASSERT_EQ(run({"offset", ball, "-o", within, "--distance", "-0.2", "--slack", "0.1", "-q"}).status, 0);
    const std::vector<std::string> lengths = {"--clearance", "0.2", "--distance", "0.3", "--json"};
    const auto verify = [&](std::vector<std::string> arguments, const std::vector<std::string>& more) {
        arguments.insert(arguments.begin(), "verify-cage");
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    const Result outer = verify({wrap, ball}, lengths);
    EXPECT_EQ(outer.status, 0) << outer.error;
    const json report = json::parse(outer.out);
    EXPECT_EQ(report["passed"], true);
    EXPECT_GE(report["distance_lower"], 0.2);
    EXPECT_LE(report["distance_upper"], 0.3);
    EXPECT_EQ(report["components"]["cage"], 1);
    EXPECT_EQ(verify({within, ball, "--side", "inner"}, lengths).status, 0);

    const Result far = verify({wrap, ball, "--clearance", "0.3", "-q"}, {});
    EXPECT_EQ(far.status, 1);
    EXPECT_EQ(far.out, "");
    EXPECT_THAT(far.error, HasSubstr("its: failed: clearance"));
    const Result inside = verify({wrap, ball, "--side", "inner"}, {});
    EXPECT_EQ(inside.status, 1);
    EXPECT_THAT(inside.out, HasSubstr("FAIL enclosed"));
    EXPECT_EQ(verify({ball, ball}, {}).status, 1);
    expect_refused({"verify-cage", wrap, ball, "--clearance", "2", "--distance", "1"},
                   "larger than the distance");
    expect_refused({"verify-cage", wrap, shop.path("none.obj")}, "none.obj");
}

}  // namespace
}  // namespace its::cli_test
