#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

/// `its simplify`: what it writes, says and refuses.
namespace its::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class SimplifyCommand : public testing::Test {
protected:
    const Workshop shop;
    const std::string mesh = shop.add("ball.obj", zoo::sphere({1, 2, 3}, 2, 4));

    json simplified(std::vector<std::string> options, const std::string& output = "out.ply") const {
        options.insert(options.begin(), {"simplify", mesh, "-o", shop.path(output), "--json"});
        const Result result = run(options);
        EXPECT_EQ(result.status, 0) << result.error;
        return json::parse(result.out);
    }
    void refuses(std::vector<std::string> options, const std::string& text) const {
        options.insert(options.begin(), {"simplify", mesh, "-o", shop.path("refused.obj")});
        const Result result = run(options);
        EXPECT_EQ(result.status, 2);
        EXPECT_THAT(result.error, StartsWith("its: error: "));
        EXPECT_THAT(result.error, HasSubstr(text));
        EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1) << result.error;
        EXPECT_THAT(result.out, IsEmpty());
        EXPECT_FALSE(std::filesystem::exists(shop / "refused.obj"));
    }
};

TEST_F(SimplifyCommand, WithinATolerance) {
    for (const char* output : {"out.ply", "out.obj", "out.off", "out.stl"}) {
        const json j = simplified({"--tolerance", "0.01"}, output);
        EXPECT_EQ(j["faces_before"], 5120);
        EXPECT_LT(j["faces_after"], 1500);
        EXPECT_EQ(j["proven_bound"], 0.01);
        EXPECT_LE(j["measured"]["hausdorff"], 0.01);
        EXPECT_GT(j["measured"]["hausdorff"], 0.001);
        EXPECT_EQ(read_mesh(shop / output).mesh.triangles.size(), j["faces_after"]);
        for (const char* name : {"read", "simplify", "total", "measure", "write"})
            EXPECT_TRUE(j["seconds"].contains(name));
    }
}

TEST_F(SimplifyCommand, ToAFaceCountByEveryMethod) {
    for (const char* method : {"certified", "vertex", "priority", "qem"}) {
        std::vector<std::string> arguments = {"--faces", "1600", "--method", method};
        // The shell of the depth that build chooses leaves no room for so few faces.
        if (std::string(method) == "vertex") arguments.insert(arguments.end(), {"--depth", "3"});
        const json j = simplified(arguments);
        EXPECT_EQ(j["faces_after"], 1600) << method;
        EXPECT_EQ(j["method"], method);
        EXPECT_EQ(j["proven_bound"].is_null(), std::string(method) != "certified");
        EXPECT_EQ(j["stop"], "the number of faces is reached");
    }
}

TEST_F(SimplifyCommand, InAShell) {
    const json j = simplified({"--depth", "5", "--samples", "0"});
    EXPECT_EQ(j["shell"]["depth"], 5);
    EXPECT_EQ(j["in_shell"], true);
    EXPECT_FALSE(j.contains("measured"));
    EXPECT_EQ(j["stop"], "no collapse is left that stays in the shell");
}

TEST_F(SimplifyCommand, ReportsForPeople) {
    const Result result = run({"simplify", mesh, "-o", shop.path("out.off"), "--faces", "100"});
    EXPECT_EQ(result.status, 0);
    EXPECT_THAT(result.out, HasSubstr("5,120 to 100"));
    EXPECT_THAT(result.out, HasSubstr("every point within"));
    EXPECT_THAT(run({"simplify", mesh, "-o", shop.path("out.off"), "--faces", "100", "-q"}).out, IsEmpty());
}

TEST_F(SimplifyCommand, KeepsAttributesWhereTheFormatHasThem) {
    // A sheet whose two halves are apart in the picture, coloured by position.
    const Mesh sheet = zoo::sheet(16);
    MeshAttributes a;
    for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
        const auto& [i, j, k] = sheet.triangles[t];
        const Vec3 sum = sheet.vertices[i] + sheet.vertices[j] + sheet.vertices[k];
        Triangle& corners = a.texture.corners.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
            const Vec3& p = sheet.vertices[sheet.triangles[t][c]];
            corners[c] = std::uint32_t(a.texture.values.size());
            a.texture.values.push_back({p.x + (sum.x > 1.5 ? 5 : 0), p.y});
        }
    }
    for (const Vec3& p : sheet.vertices) a.colours.values.push_back({float(p.x), float(p.y), 0.5F, 1});
    a.colours.corners = sheet.triangles;
    write_mesh(sheet, a, shop / "sheet.obj");
    for (const char* output : {"s.ply", "s.obj", "s.off", "s.glb", "s.stl"}) {
        const Result result =
            run({"simplify", shop.path("sheet.obj"), "-o", shop.path(output), "--tolerance", "1e-3", "--json"});
        ASSERT_EQ(result.status, 0) << result.error;
        const json j = json::parse(result.out);
        EXPECT_EQ(j["attributes"]["names"], (json{"colours", "texture coordinates"}));
        EXPECT_EQ(j["attributes"]["seam_edges_before"], 16);
        EXPECT_EQ(j["attributes"]["lost"].size(), std::string(output) == "s.stl" ? 2u : 0u);
        if (std::string(output) == "s.stl") continue;
        const MeshFile back = read_mesh(shop / output, {.attributes = true});
        for (std::size_t t = 0; t < back.mesh.triangles.size(); ++t)
            for (std::size_t c = 0; c < 3; ++c) {
                const Vec3& p = back.mesh.vertices[back.mesh.triangles[t][c]];
                EXPECT_NEAR(std::fmod(back.attributes.texture.at(t, c)[0] + 1e-6, 5), p.x, 1e-5);
                EXPECT_NEAR(back.attributes.colours.at(t, c)[1], p.y, 1e-5);
            }
    }
    const Result bare = run({"simplify", shop.path("sheet.obj"), "-o", shop.path("bare.obj"), "--tolerance",
                             "1e-3", "--no-attributes", "--json"});
    EXPECT_TRUE(json::parse(bare.out)["attributes"]["names"].empty());
}

TEST_F(SimplifyCommand, WarnsIfTheCountIsOutOfReach) {
    const Result result =
        run({"simplify", mesh, "-o", shop.path("out.off"), "--faces", "100", "--tolerance", "0.001"});
    EXPECT_EQ(result.status, 0);
    EXPECT_THAT(result.error, HasSubstr("faces are left, not 100: no collapse is left"));
}

TEST_F(SimplifyCommand, RefusesInOneLine) {
    refuses({"--tolerance", "0"}, "tolerance 0");
    refuses({"--tolerance", "-0.5"}, "tolerance -0.5");
    refuses({"--tolerance", "abc"}, "--tolerance");
    refuses({"--tolerance", "1e-5", "--depth", "3"}, "depth 3 cannot reach it");
    refuses({"--faces", "2"}, "needs at least 4");
    refuses({"--method", "qem"}, "needs a number of faces");
    refuses({"--method", "best"}, "none of certified");
    refuses({"--depth", "77", "--faces", "100"}, "depth 77");
    refuses({"--max-memory", "1K", "--depth", "8"}, "memory");
}

}  // namespace
}  // namespace its::cli_test
