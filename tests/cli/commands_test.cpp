#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.h"
#include "support/zoo.h"

/// What the commands do when all is well, and what they say.
namespace its::cli_test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

/// The one JSON object that a successful command prints, and nothing on standard error.
json run_json(std::vector<std::string> arguments, int status = 0) {
    arguments.push_back("--json");
    const Result result = run(arguments);
    EXPECT_EQ(result.status, status) << result.error;
    if (status == 0) {
        EXPECT_THAT(result.error, IsEmpty());
    }
    return json::parse(result.out);  // throws on anything but one object
}

void expect_fields(const json& object, const std::vector<std::string>& pointers) {
    for (const std::string& pointer : pointers)
        EXPECT_TRUE(object.contains(json::json_pointer(pointer))) << pointer << " in " << object.dump(2);
}

const std::vector<std::string> shell_fields = {
    "/mesh/vertices", "/mesh/triangles", "/mesh/closed",   "/sign",        "/depth",
    "/cell_width",    "/epsilon_inner",  "/epsilon_outer", "/thickness",   "/thickness_relative",
    "/surface_cells", "/cells",          "/grid_points",   "/memory_bytes"};

class Commands : public testing::Test {
protected:
    const Workshop shop;
    const std::string mesh = shop.add("ball.obj", zoo::sphere({1, 2, 3}, 2, 3));
    const std::string shell = shop.path("ball.its");
};

TEST_F(Commands, BuildJson) {
    const json built = run_json({"build", mesh, "-o", shell, "--depth", "5"});
    expect_fields(built, shell_fields);
    expect_fields(built, {"/seconds/read", "/seconds/octree", "/seconds/distance", "/seconds/field",
                          "/seconds/extrema", "/seconds/total"});
    EXPECT_EQ(built["mesh"]["vertices"], 642);
    EXPECT_EQ(built["mesh"]["triangles"], 1280);
    EXPECT_EQ(built["mesh"]["closed"], true);
    EXPECT_EQ(built["sign"], "winding");
    EXPECT_EQ(built["depth"], 5);
    // The ball is 4 wide; the scale is rounded up by less than 2^-7.
    EXPECT_NEAR(built["cell_width"].get<double>(), 4.0 / 32, 4.0 / 32 / 128);
    EXPECT_LE(built["epsilon_inner"].get<double>(), 0);
    EXPECT_GT(built["epsilon_outer"].get<double>(), 0);
    EXPECT_DOUBLE_EQ(built["thickness"].get<double>(),
                     built["epsilon_outer"].get<double>() - built["epsilon_inner"].get<double>());
    EXPECT_NEAR(built["thickness_relative"].get<double>(),
                built["thickness"].get<double>() / (32 * built["cell_width"].get<double>()), 1e-15);
    EXPECT_GE(built["seconds"]["total"].get<double>(), built["seconds"]["distance"].get<double>());
    EXPECT_EQ(built["file_bytes"], std::filesystem::file_size(shell));
}

TEST_F(Commands, AnUnchangedBuildDoesNothing) {
    const json built = run_json({"build", mesh, "-o", shell, "--depth", "5"});
    EXPECT_EQ(built["unchanged"], false);
    const auto written = std::filesystem::last_write_time(shell);
    json again = run_json({"build", mesh, "-o", shell, "--depth", "5", "--threads", "1"});
    EXPECT_EQ(again["unchanged"], true);
    EXPECT_EQ(again["seconds"]["total"], 0);
    EXPECT_EQ(std::filesystem::last_write_time(shell), written);
    for (json object : {built, again}) object.erase("seconds"), object.erase("unchanged");
    again["unchanged"] = built["unchanged"];
    again["seconds"] = built["seconds"];
    EXPECT_EQ(again, built);
    const Result text = run({"build", mesh, "-o", shell, "--depth", "5"});
    EXPECT_EQ(text.status, 0);
    EXPECT_THAT(text.out, HasSubstr("Unchanged"));

    EXPECT_EQ(run_json({"build", mesh, "-o", shell, "--depth", "5", "--force"})["unchanged"], false);
    EXPECT_NE(std::filesystem::last_write_time(shell), written);
}

TEST_F(Commands, AnyChangeIsBuilt) {
    const std::string other = shop.add("other.obj", zoo::sphere({1, 2, 3}, 2.0000001, 3));
    const std::vector<std::vector<std::string>> builds = {
        {mesh, "--depth", "4"},
        {mesh, "--depth", "3"},
        {mesh, "--depth", "3", "--sign", "unsigned"},
        {mesh, "--depth", "3", "--sign", "unsigned", "--extrema", "candidates"},
        {mesh, "--depth", "3", "--sign", "unsigned", "--solver", "lscg"},
        {other, "--depth", "3", "--sign", "unsigned", "--solver", "lscg"},
        {mesh, "--depth", "auto"},
    };
    for (std::vector<std::string> arguments : builds) {
        arguments.insert(arguments.begin(), "build");
        arguments.insert(arguments.end(), {"-o", shell});
        EXPECT_EQ(run_json(arguments)["unchanged"], false) << testing::PrintToString(arguments);
        EXPECT_EQ(run_json(arguments)["unchanged"], true) << testing::PrintToString(arguments);
    }
    // A limit that leaves the depth as it is makes the same shell.
    EXPECT_EQ(run_json({"build", mesh, "--depth", "auto", "--max-memory", "1G", "-o", shell})["unchanged"],
              true);
}

/// The ball has radius 2 around (1, 2, 3).
TEST_F(Commands, QueryWritesCodes) {
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "5"}).status, 0);
    const std::string points = shop.add("points.csv", "x,y,z\n1,2,3\n1,2,5\n9,9,9\nnan,0,0\n");
    const std::string codes = shop.path("codes.npy"), table = shop.path("table.csv");
    const json asked = run_json({"query", shell, points, "-o", codes});
    EXPECT_EQ(asked["points"], 4);
    EXPECT_EQ(asked["counts"],
              json({{"inside", 1}, {"on_surface", 1}, {"outside", 1}, {"uncertain", 0}, {"not_finite", 1}}));
    EXPECT_GE(asked["seconds"]["query"].get<double>(), 0);
    EXPECT_EQ(content(codes).substr(128), std::string("\xff\x00\x01\x02", 4));
    EXPECT_THAT(content(codes), HasSubstr("|i1"));

    ASSERT_EQ(run({"query", shell, points, "-o", table, "--winding"}).status, 0);
    EXPECT_THAT(content(table), HasSubstr("winding,winding_error"));
    EXPECT_THAT(content(table), HasSubstr("1,2,3,-1,1,0\n"));

    ASSERT_EQ(
        run({"query", shell, points, "-o", table, "--value", "--gradient", "--closest", "--quick"}).status, 0);
    std::istringstream lines(content(table));
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(
        line,
        "x,y,z,code,value,gradient_x,gradient_y,gradient_z,closest_x,closest_y,closest_z,distance,triangle");
    std::getline(lines, line);
    EXPECT_THAT(line, StartsWith("1,2,3,-1,-1.9"));
    std::getline(lines, line);
    EXPECT_THAT(line, StartsWith("1,2,5,0,"));
    std::getline(lines, line);
    EXPECT_THAT(line, StartsWith("9,9,9,1,"));
    std::getline(lines, line);
    EXPECT_EQ(line, "nan,0,0,2,nan,nan,nan,nan,nan,nan,nan,nan,-1");

    const json thick = run_json({"query", shell, points, "-o", codes, "--mode", "shell"});
    EXPECT_EQ(thick["counts"], json({{"inside", 1}, {"on_shell", 1}, {"outside", 1}, {"not_finite", 1}}));
}

TEST_F(Commands, QueryRefusesBadPoints) {
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "3"}).status, 0);
    const std::string bad = shop.add("bad.xyz", "1 2 3\n1 2\n"), out = shop.path("out.npy");
    const auto expect_error = [&](const std::vector<std::string>& arguments, const std::string& part) {
        const Result result = run(arguments);
        EXPECT_EQ(result.status, 2);
        EXPECT_THAT(result.error, StartsWith("its: error: "));
        EXPECT_THAT(result.error, HasSubstr(part));
        EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1);
        EXPECT_FALSE(std::filesystem::exists(out));
    };
    expect_error({"query", shell, bad, "-o", out}, "bad.xyz: line 2: three numbers");
    expect_error({"query", shell, mesh, "-o", out}, ".npy, .csv, .xyz and .ply");
    expect_error({"query", shell, bad, "-o", shop.path("out.txt")}, ".npy, .csv, .xyz and .ply");
    expect_error({"query", mesh, bad, "-o", out}, "ball.obj");
    expect_error({"query", shell, shop.path("missing.npy"), "-o", out}, "missing.npy");
}

TEST_F(Commands, ABrokenShellIsBuiltAgain) {
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "3"}).status, 0);
    const std::string good = content(shell);
    for (std::size_t at = 0; at < good.size(); at += good.size() / 40) {
        std::string bad = good;
        bad[at] = char(bad[at] ^ 4);
        std::ofstream(shell, std::ios::binary) << (at % 3 ? bad : bad.substr(0, at));
        EXPECT_EQ(run_json({"build", mesh, "-o", shell, "--depth", "3"})["unchanged"], false) << at;
        EXPECT_EQ(content(shell), good);
    }
}

TEST_F(Commands, InfoSaysWhatBuildSaid) {
    const json built = run_json({"build", mesh, "-o", shell, "--depth", "4", "--sign", "unsigned"});
    const json info = run_json({"info", shell});
    expect_fields(info, shell_fields);
    EXPECT_EQ(info["sign"], "unsigned");
    for (const std::string& field : shell_fields)
        EXPECT_EQ(info[json::json_pointer(field)], built[json::json_pointer(field)]) << field;
}

TEST_F(Commands, CheckJson) {
    const json report = run_json({"check", mesh});
    expect_fields(report,
                  {"/vertices", "/triangles", "/degenerate", "/duplicate", "/boundary_edges",
                   "/nonmanifold_edges", "/inconsistent_edges", "/components", "/euler", "/closed", "/oriented",
                   "/bounds/min", "/bounds/max", "/signed_volume", "/sign", "/sign_reason"});
    EXPECT_EQ(report["closed"], true);
    EXPECT_EQ(report["euler"], 2);
    EXPECT_EQ(report["sign"], "winding");

    const json open = run_json({"check", shop.add("sheet.off", zoo::sheet(4))});
    EXPECT_EQ(open["closed"], false);
    EXPECT_EQ(open["boundary_edges"], 16);
    EXPECT_NE(open["sign"], "winding");
}

TEST_F(Commands, VerifyPassesOnTheMeshAndFailsOnAnother) {
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "5"}).status, 0);
    const json passed = run_json({"verify", shell, mesh, "--samples", "20000", "--seed", "7"});
    EXPECT_EQ(passed["passed"], true);
    EXPECT_THAT(passed["checks"], Not(IsEmpty()));
    for (const json& check : passed["checks"])
        expect_fields(check, {"/name", "/passed", "/tested", "/violations", "/worst", "/detail"});

    const std::string smaller = shop.add("smaller.obj", zoo::sphere({1, 2, 3}, 1.8, 3));
    const json failed = run_json({"verify", shell, smaller, "--samples", "20000"}, 1);
    EXPECT_EQ(failed["passed"], false);
    const Result result = run({"verify", shell, smaller, "--samples", "20000"});
    EXPECT_EQ(result.status, 1);
    EXPECT_THAT(result.out, HasSubstr("FAIL"));
    EXPECT_THAT(result.error, StartsWith("its: failed: "));
}

TEST_F(Commands, SliceWritesAPng) {
    if (!has_command("slice")) GTEST_SKIP() << "built without pictures";
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "4"}).status, 0);
    const std::string picture = shop.path("ball.png");
    const json slice = run_json({"slice", shell, "-o", picture, "--axis", "X", "--size", "128", "--cells"});
    expect_fields(slice, {"/file", "/width", "/height", "/axis", "/at"});
    EXPECT_GE(slice["width"], 128);
    EXPECT_THAT(content(picture), StartsWith("\x89PNG"));
}

TEST_F(Commands, SliceOnAnyPlane) {
    if (!has_command("slice")) GTEST_SKIP() << "built without pictures";
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "4"}).status, 0);
    const std::string picture = shop.path("ball.png");
    const json slice = run_json({"slice", shell, "-o", picture, "--normal", "1,-1,0.5", "--through", "-1,2,3",
                                 "--mesh", mesh, "--size", "128"});
    EXPECT_EQ(slice["normal"], json({1, -1, 0.5}));
    EXPECT_EQ(slice["through"], json({-1, 2, 3}));
    EXPECT_FALSE(slice.contains("axis"));
    for (const std::vector<std::string>& wrong :
         std::vector<std::vector<std::string>>{{"--normal", "1,2"},
                                               {"--normal", "0,0,0"},
                                               {"--normal", "1,2,nan"},
                                               {"--normal", "1,2,3,4"},
                                               {"--normal", "1,0,0", "--axis", "x"},
                                               {"--through", "0,0,0", "--at", "0.5"},
                                               {"--mesh", "/nowhere.obj"}}) {
        std::vector<std::string> arguments = {"slice", shell, "-o", picture};
        arguments.insert(arguments.end(), wrong.begin(), wrong.end());
        const Result result = run(arguments);
        EXPECT_EQ(result.status, 2) << wrong[1];
        EXPECT_THAT(result.error, StartsWith("its: error: "));
        EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1) << result.error;
    }
}

TEST_F(Commands, RenderWritesAPng) {
    if (!has_command("render")) GTEST_SKIP() << "built without pictures";
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "3"}).status, 0);
    const std::string picture = shop.path("render.png");
    const json render = run_json({"render", shell, "-o", picture, "--size", "256", "--samples", "1", "--view",
                                  "-40,10", "--cut", "30,0.6", "--up", "y"});
    EXPECT_EQ(render["width"], 256);
    EXPECT_THAT(content(picture), StartsWith("\x89PNG"));
    for (const char* wrong : {"30", "30,95", "a,b", "1,2,3"})
        EXPECT_EQ(run({"render", shell, "-o", picture, "--view", wrong}).status, 2) << wrong;
}

TEST_F(Commands, ViewWritesAPageOrRefuses) {
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "3"}).status, 0);
    const std::string page = shop.path("ball.html");
    const Result result = run({"view", shell, "-o", page, "--samples", "16", "--json"});
    if (result.status == 0) {
        EXPECT_THAT(content(page), HasSubstr("\"title\":\"ball\""));
        EXPECT_EQ(json::parse(result.out)["file_bytes"], std::filesystem::file_size(page));
    } else {
        EXPECT_EQ(result.status, 2);
        EXPECT_THAT(result.error, HasSubstr("built without pages"));
        EXPECT_FALSE(std::filesystem::exists(page));
    }
}

TEST_F(Commands, ReportsForPeople) {
    const Result built = run({"build", mesh, "-o", shell, "--depth", "4"});
    EXPECT_EQ(built.status, 0);
    for (const char* part :
         {"1,280 triangles", "Sign rule", "ε₁", "ε₂", "Thickness", "longest side", "Memory", "extrema", "ms"})
        EXPECT_THAT(built.out, HasSubstr(part));
    EXPECT_THAT(run({"info", shell}).out, HasSubstr("Root cube"));
    EXPECT_THAT(run({"check", mesh}).out, HasSubstr("Boundary edges"));
    EXPECT_THAT(run({"verify", shell, mesh, "--samples", "1000"}).out, HasSubstr("all checks passed"));
}

TEST_F(Commands, QuietPrintsNothing) {
    for (const auto& arguments : std::vector<std::vector<std::string>>{
             {"build", mesh, "-o", shell, "--depth", "4", "-q"},
             {"info", shell, "--quiet"},
             {"check", mesh, "--quiet"},
             {"verify", shell, mesh, "--samples", "1000", "--quiet"},
             {"slice", shell, "-o", shop.path("a.png"), "--size", "64", "--quiet"}}) {
        if (!has_command(arguments[0])) continue;
        const Result result = run(arguments);
        EXPECT_EQ(result.status, 0);
        EXPECT_THAT(result.out, IsEmpty());
        EXPECT_THAT(result.error, IsEmpty());
    }
}

TEST_F(Commands, SameBytesForAnyNumberOfThreads) {
    const std::string knot = shop.add("knot.ply", zoo::twisted_knot(60, 12));
    const std::string one = shop.path("one.its"), two = shop.path("two.its");
    ASSERT_EQ(run({"build", knot, "-o", one, "--depth", "6", "--threads", "1"}).status, 0);
    ASSERT_EQ(run({"build", knot, "-o", two, "--depth", "6", "--threads", "2"}).status, 0);
    EXPECT_TRUE(content(one) == content(two));
    EXPECT_GT(content(one).size(), 10'000u);
}

TEST_F(Commands, TheThicknessIsReachedWithinTheMemoryOrTheReportSaysSo) {
    const json free = run_json({"build", mesh, "-o", shell});
    EXPECT_LE(free["thickness_relative"].get<double>(), 0.002);
    EXPECT_EQ(free["coarse_cells"].get<int>(), 0);
    const std::vector<std::string> tight = {"build", mesh,          "-o",   shell, "--max-memory",
                                            "44M",   "--thickness", "0.01%"};  // 40 are the program's
    const Result asked = run(tight);
    EXPECT_EQ(asked.status, 1) << "what was asked for is not reached";
    EXPECT_THAT(asked.error, HasSubstr("too coarse"));
    const json info = run_json({"info", shell});
    EXPECT_GT(info["coarse_cells"].get<int>(), 0);
    EXPECT_GT(info["thickness_relative"].get<double>(), 0.0001);
    EXPECT_LE(info["memory_bytes"].get<double>(), 4e6);
    std::vector<std::string> strict = tight;
    strict[3] = shop.path("strict.its");
    strict.emplace_back("--strict");
    EXPECT_EQ(run(strict).status, 2);
    EXPECT_FALSE(std::filesystem::exists(strict[3]));
}

TEST_F(Commands, NobodyAskedForTheDefaultThickness) {
    const Result few = run({"build", mesh, "-o", shell, "--max-cells", "4000"});
    EXPECT_EQ(few.status, 0) << few.error;
    EXPECT_THAT(few.error, HasSubstr("too coarse"));
    EXPECT_THAT(few.out, HasSubstr("Not reached"));
    EXPECT_EQ(run({"build", mesh, "-o", shell, "--max-cells", "4000", "--strict"}).status, 2);
    EXPECT_EQ(run({"build", mesh, "-o", shell, "--depth", "auto", "--max-depth", "12", "--strict"}).status, 0);
    for (const std::vector<std::string>& limit : {std::vector<std::string>{"--max-cells", "4000"},
                                                  {"--max-depth", "5"},
                                                  {"--strict"},
                                                  {"--thickness", "1%"}}) {
        std::vector<std::string> line = {"build", mesh, "-o", shell, "--depth", "5"};
        line.insert(line.end(), limit.begin(), limit.end());
        EXPECT_EQ(run(line).status, 2) << limit[0];
    }
    const Result lscg = run({"build", mesh, "-o", shell, "--solver", "lscg"});
    EXPECT_EQ(lscg.status, 2);
    EXPECT_THAT(lscg.error, HasSubstr("give a depth"));
}

TEST_F(Commands, SimplifyStaysInAShellOfTheThicknessAskedFor) {
    const json report = run_json({"simplify", mesh, "-o", shop.path("small.ply"), "--thickness", "1%"});
    EXPECT_EQ(report["in_shell"], true);
    const double thickness = report["shell"]["thickness"].get<double>();
    EXPECT_LE(thickness, 0.0101 * run_json({"build", mesh, "-o", shell})["scale"].get<double>());
    EXPECT_EQ(run({"simplify", mesh, "-o", shop.path("small.ply"), "--thickness", "1%", "--depth", "4"}).status,
              2);
}

TEST_F(Commands, AllKeepToTheMemoryThatIsAllowed) {
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "6"}).status, 0);
    const std::string points = shop.add("points.csv", std::string("0,0,0\n1,2,3\n"));
    const std::vector<std::vector<std::string>> commands = {
        {"check", mesh},
        {"build", mesh, "-o", shell, "--depth", "7"},
        {"info", shell},
        {"query", shell, points, "-o", shop.path("answers.csv")},
        {"simplify", mesh, "-o", shop.path("small.obj"), "--faces", "8"},
        {"slice", shell, "-o", shop.path("slice.png")},
        {"verify", shell, mesh}};
    for (std::vector<std::string> command : commands) {
        command.insert(command.end(), {"--max-memory", "30M"});
        const Result result = run(command);
        EXPECT_EQ(result.status, 2) << command[0];
        EXPECT_THAT(result.error, HasSubstr("memory")) << command[0];
        command.back() = "4G";
        EXPECT_EQ(run(command).status, 0) << command[0];
    }
}

TEST_F(Commands, NoProgressBarInAPipe) {
    const Result result = run({"build", mesh, "-o", shell, "--depth", "7"});
    EXPECT_EQ(result.status, 0);
    EXPECT_THAT(result.error, IsEmpty());
}

TEST_F(Commands, ProgressBarOnATerminalUnlessQuiet) {
    const Result shown = run_on_terminal({"build", mesh, "-o", shell, "--depth", "6"});
    EXPECT_EQ(shown.status, 0);
    EXPECT_THAT(shown.out, HasSubstr(" %  octree"));
    const Result quiet = run_on_terminal({"build", mesh, "-o", shell, "--depth", "6", "--quiet"});
    EXPECT_EQ(quiet.status, 0);
    EXPECT_THAT(quiet.out, IsEmpty());
}

TEST_F(Commands, InterruptionLeavesNothingBehind) {
    // Deep enough to be still at work when the signal comes, which is sent at the first sign of progress.
    const Result result = run_on_terminal({"build", mesh, "-o", shell, "--depth", "9"}, true);
    EXPECT_EQ(result.status, 130);
    EXPECT_THAT(result.out, HasSubstr("its: error: stopped; nothing was written"));
    EXPECT_THAT(shop.names(), ElementsAre("ball.obj"));
}

TEST_F(Commands, FullDiskIsAnError) {
    ASSERT_EQ(run({"build", mesh, "-o", shell, "--depth", "3"}).status, 0);
    const std::string command =
        std::string("'") + ITS_PROGRAM + "' info '" + shell + "' >/dev/full 2>/dev/null";
    const int status = std::system(command.c_str());
    EXPECT_EQ(WEXITSTATUS(status), 2);
}

TEST_F(Commands, WarningsGoToStandardError) {
    const std::string dirty = shop.add("dirty.obj", content(mesh) + "f 1 2 99999\n");
    const Result result = run({"check", dirty, "--json"});
    EXPECT_EQ(result.status, 0);
    EXPECT_THAT(result.error, StartsWith("its: warning: " + dirty + ": "));
    EXPECT_THAT(json::parse(result.out)["warnings"], Not(IsEmpty()));
}

/// Name and status of each file of the folder of test meshes, from its manifest.
std::vector<std::pair<std::string, std::string>> real_meshes(const std::filesystem::path& folder) {
    std::vector<std::pair<std::string, std::string>> files;
    std::ifstream manifest(folder / "MANIFEST.tsv");
    std::size_t status_column = 0;
    for (std::string line; std::getline(manifest, line);) {
        std::vector<std::string> cells;
        std::istringstream stream(line);
        for (std::string cell; std::getline(stream, cell, '\t');) cells.push_back(cell);
        if (status_column == 0)
            status_column = std::size_t(std::find(cells.begin(), cells.end(), "status") - cells.begin());
        else if (status_column < cells.size())
            files.emplace_back(cells[0], cells[status_column]);
    }
    return files;
}

TEST(RealMeshes, AreReadOrRefusedInOneLine) {
    const char* const folder = std::getenv("ITS_TEST_MESHES");
    if (folder == nullptr) return;
    const auto files = real_meshes(folder);
    EXPECT_THAT(files, Not(IsEmpty()));
    for (const auto& [name, status] : files) {
        SCOPED_TRACE(name + ": " + status);
        const std::string path = (std::filesystem::path(folder) / name).string();
        const Result result = run({"check", path});
        const auto lines = std::count(result.error.begin(), result.error.end(), '\n');
        if (result.status == 2) {
            EXPECT_NE(status, "ok") << result.error;
            EXPECT_THAT(result.error, StartsWith("its: error: "));
            EXPECT_THAT(result.error, HasSubstr(path));
            EXPECT_EQ(lines, 1) << result.error;
            continue;
        }
        EXPECT_EQ(result.status, 0) << result.error;
        EXPECT_EQ(status.substr(0, 7) == "NOFACES", false);
        if (status.substr(0, 4) == "WARN") {
            EXPECT_THAT(result.error, StartsWith("its: warning: " + path));
        }
    }
}

}  // namespace
}  // namespace its::cli_test
