#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "its/inspect.h"
#include "its/mesh.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

/// its surface.
namespace its::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;

class SurfaceCommand : public testing::Test {
protected:
    SurfaceCommand() { run({"build", mesh, "-o", shell, "--depth", "5", "-q"}); }

    const Workshop shop;
    const std::string mesh = shop.add("ball.obj", zoo::sphere({1, 2, 3}, 2, 3));
    const std::string shell = shop.path("ball.its");
};

TEST_F(SurfaceCommand, WritesBothSidesInEveryFormat) {
    for (const std::string extension : {"obj", "ply", "stl", "off"}) {
        const Result result =
            run({"surface", shell, "-o", shop.path("out." + extension), "--side", "both", "--json"});
        ASSERT_EQ(result.status, 0) << result.error;
        const json report = json::parse(result.out);
        ASSERT_EQ(report["surfaces"].size(), 2);
        for (const json& surface : report["surfaces"]) {
            EXPECT_EQ(surface["file"],
                      shop.path("out-" + surface["side"].get<std::string>() + "." + extension));
            EXPECT_EQ(surface["certified"], true);
            EXPECT_GT(surface["margin"], 0);
            EXPECT_GT(surface["seconds"]["surface"], 0);
            EXPECT_LT(surface["distance_to_mesh"], 0.2);
            const MeshReport read = inspect(read_mesh(surface["file"].get<std::string>()).mesh);
            EXPECT_EQ(read.triangles, surface["faces"]);
            EXPECT_TRUE(read.closed && read.oriented);
            EXPECT_GT(read.signed_volume, 0);
        }
        EXPECT_GT(report["surfaces"][0]["f_min"], report["epsilon_outer"]);
        EXPECT_LT(report["surfaces"][1]["f_max"], report["epsilon_inner"]);
    }
}

Box bounds_of(const std::string& file) {
    return inspect(read_mesh(file).mesh).bounds;
}

TEST_F(SurfaceCommand, UpTurnsTheNodesOfGlb) {
    const std::string plain = shop.path("plain.glb"), up = shop.path("up.glb");
    const std::string slab = shop.add("slab.obj", zoo::box({0, 0, 0}, {3, 2, 1}));
    for (const std::string command : {"surface", "simplify"}) {
        const std::string input = command == "surface" ? shell : slab;
        ASSERT_EQ(run({command, input, "-o", plain, "-q"}).status, 0);
        const Box box = bounds_of(plain);
        for (const std::string axis : {"x", "y", "z"}) {
            const Result result = run({command, input, "-o", up, "--up", axis, "-q"});
            ASSERT_EQ(result.status, 0) << result.error;
            const Box turned = bounds_of(up);
            const double height = axis == "x" ? box.max.x : axis == "y" ? box.max.y : box.max.z;
            EXPECT_EQ(turned.max.y, height);
        }
        // Other formats have no place for it, which is said before any work.
        for (const std::string name : {"out.obj", "out.stl", "out.ply", "out.off"}) {
            const Result refused = run({command, input, "-o", shop.path(name), "--up", "z"});
            EXPECT_EQ(refused.status, 2);
            EXPECT_THAT(refused.error, HasSubstr("--up is for .glb"));
            EXPECT_FALSE(std::filesystem::exists(shop.path(name)));
        }
    }
}

TEST_F(SurfaceCommand, SaysWhatOthersMakeOfAFarGlb) {
    const std::string far = shop.add("far.obj", zoo::sphere({1000, 0, 0}, 1, 2)),
                      far_shell = shop.path("far.its");
    ASSERT_EQ(run({"build", far, "-o", far_shell, "-q"}).status, 0);
    const auto warnings = [&](const std::string& command, const std::string& input, const char* output) {
        const Result result = run({command, input, "-o", shop.path(output), "-q"});
        EXPECT_EQ(result.status, 0) << result.error;
        return result.error;
    };
    for (const std::string command : {"surface", "simplify"}) {
        const bool surface = command == "surface";
        EXPECT_THAT(warnings(command, surface ? far_shell : far, "far.glb"),
                    testing::AllOf(HasSubstr("far.glb: far from the origin"), HasSubstr(".ply and .obj"),
                                   testing::EndsWith("digit\n")));
        EXPECT_THAT(warnings(command, surface ? far_shell : far, "far.ply"), IsEmpty());
        EXPECT_THAT(warnings(command, surface ? shell : mesh, "near.glb"), IsEmpty());
    }
}

TEST_F(SurfaceCommand, WritesBothSidesInOneGlb) {
    const std::string out = shop.path("both.glb");
    const Result result = run({"surface", shell, "-o", out, "--side", "both", "--json", "--no-measure"});
    ASSERT_EQ(result.status, 0) << result.error;
    const json report = json::parse(result.out);
    EXPECT_EQ(report["surfaces"][0]["file"], out);
    EXPECT_EQ(report["surfaces"][1]["file"], out);
    EXPECT_TRUE(report["surfaces"][0]["distance_to_mesh"].is_null());
    EXPECT_EQ(inspect(read_mesh(out).mesh).components, 2);
}

TEST_F(SurfaceCommand, TakesLevelAndResolution) {
    const std::string out = shop.path("out.ply");
    const Result result =
        run({"surface", shell, "-o", out, "--side", "zero", "--level", "-0.5", "--resolution", "20", "--json"});
    ASSERT_EQ(result.status, 0) << result.error;
    const json surface = json::parse(result.out)["surfaces"][0];
    EXPECT_EQ(surface["level"], -0.5);
    EXPECT_NEAR(surface["cell_width"], 4.0 / 20, 0.01);
    EXPECT_EQ(surface["certified"], false);
    EXPECT_EQ(run({"surface", shell, "-o", out, "--side", "both", "--level", "0"}).status, 2);
    EXPECT_EQ(run({"surface", shell, "-o", out, "--level", "1e9"}).status, 2);
    EXPECT_EQ(run({"surface", shell, "-o", out, "--resolution", "0"}).status, 2);
}

TEST_F(SurfaceCommand, AnEmptyInnerSurfaceIsAWarning) {
    const std::string sheet = shop.add("sheet.obj", zoo::sheet(3)), its = shop.path("sheet.its");
    run({"build", sheet, "-o", its, "--depth", "4", "-q"});
    const Result result = run({"surface", its, "-o", shop.path("out.ply"), "--side", "both", "--json"});
    ASSERT_EQ(result.status, 0);
    EXPECT_THAT(result.error, HasSubstr("its: warning: "));
    EXPECT_THAT(result.error, HasSubstr("unsigned"));
    const json inner = json::parse(result.out)["surfaces"][1];
    EXPECT_EQ(inner["empty"], true);
    EXPECT_TRUE(inner["file"].is_null());
    EXPECT_TRUE(std::filesystem::exists(shop.path("out-outer.ply")));
    EXPECT_FALSE(std::filesystem::exists(shop.path("out-inner.ply")));
}

TEST_F(SurfaceCommand, WritesTheFunctionForOpenVdbOrSaysWhyNot) {
    const std::string out = shop.path("f.vdb");
    const Result result = run({"surface", shell, "-o", out, "--json"});
    if (result.status == 0) {
        EXPECT_EQ(json::parse(result.out)["file_bytes"], std::filesystem::file_size(out));
        EXPECT_EQ(run({"surface", shell, "-o", out, "--side", "inner"}).status, 2);
    } else {
        EXPECT_THAT(result.error, HasSubstr("built without OpenVDB"));
    }
}

TEST_F(SurfaceCommand, RefusesUnknownExtensionsBeforeAnyWork) {
    const Result result = run({"surface", shell, "-o", shop.path("out.xyz")});
    EXPECT_EQ(result.status, 2);
    EXPECT_THAT(result.error, HasSubstr(".glb or .vdb"));
}

TEST_F(SurfaceCommand, BothFilesAreReplacedOrNone) {
    const std::vector<std::string> command = {"surface", shell,  "-o",          shop.path("out.ply"),
                                              "--side",  "both", "--no-measure"};
    std::filesystem::create_directory(shop / "out-inner.ply");
    shop.add("out-outer.ply", std::string("old"));
    const Result result = run(command);
    EXPECT_EQ(result.status, 2);
    EXPECT_THAT(result.error, HasSubstr("out-inner.ply"));
    EXPECT_EQ(content(shop / "out-outer.ply"), "old");
    EXPECT_EQ(shop.names().size(), 4);
    std::filesystem::remove(shop / "out-inner.ply");
    EXPECT_EQ(run(command).status, 0);
    EXPECT_EQ(shop.names().size(), 4);
}

}  // namespace
}  // namespace its::cli_test
