#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

/// Meshes of any size, through the program: the same answers times that size, or a refusal that names it.
namespace its::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A box of quads, as programs write them: polygons are cut into triangles by exact predicates.
std::string quads(const Workshop& shop, const std::string& name, int exponent) {
    const double s = std::ldexp(1.0, exponent);
    std::string text;
    char line[200];
    for (int i = 0; i < 8; ++i) {
        std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", s * 3 * (i & 1), s * 2 * (i >> 1 & 1),
                      s * (i >> 2));
        text += line;
    }
    return shop.add(name, text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n");
}

json report_of(const std::vector<std::string>& arguments) {
    std::vector<std::string> with_json = arguments;
    with_json.emplace_back("--json");
    const Result result = run(with_json);
    EXPECT_EQ(result.status, 0) << arguments[0] << ": " << result.error;
    return result.status == 0 ? json::parse(result.out) : json();
}

class Sizes : public testing::TestWithParam<int> {
protected:
    const Workshop shop;
    const int e = GetParam();
    const std::string mesh = quads(shop, "box.obj", e), unit = quads(shop, "unit.obj", 0);
    std::string out(const std::string& name) const { return shop.path(name); }
};

class AllSizes : public Sizes {};
class SizesOfShells : public Sizes {};
class OtherSizes : public Sizes {};

TEST_P(AllSizes, AreCheckedAndSimplified) {
    const json report = report_of({"check", mesh}), of_unit = report_of({"check", unit});
    for (const char* key :
         {"vertices", "triangles", "degenerate", "closed", "components", "sign", "open_edges"})
        EXPECT_EQ(report[key], of_unit[key]) << key;
    EXPECT_EQ(report["bounds"]["max"][0], std::ldexp(3.0, e));
    EXPECT_EQ(read_mesh(mesh).mesh.triangles, read_mesh(unit).mesh.triangles);
    const json simplified =
        report_of({"simplify", mesh, "-o", out("s.obj"), "--faces", "8", "--samples", "1000"});
    const json unit_simplified =
        report_of({"simplify", unit, "-o", out("u.obj"), "--faces", "8", "--samples", "1000"});
    EXPECT_EQ(simplified["faces_after"], unit_simplified["faces_after"]);
    EXPECT_EQ(simplified["proven_bound"], std::ldexp(unit_simplified["proven_bound"].get<double>(), e));
    EXPECT_LE(simplified["measured"]["hausdorff"], simplified["proven_bound"]);
    EXPECT_GT(simplified["measured"]["hausdorff"], 0);
}

INSTANTIATE_TEST_SUITE_P(PowersOfTwo, AllSizes, testing::Values(-1000, -541, -250, -101, 101, 250, 511, 1000));

TEST_P(SizesOfShells, GoThroughAllCommands) {
    const std::string shell = out("a.its"), of_unit = out("u.its");
    report_of({"build", mesh, "-o", shell, "--depth", "4"});
    report_of({"build", unit, "-o", of_unit, "--depth", "4"});
    std::string points = "x,y,z\n", unit_points = points;
    char line[200];
    for (int i = 0; i < 200; ++i) {
        const double p[3] = {i % 13 / 4.0, i % 11 / 5.0 - 0.1, i % 7 / 6.0 - 0.1};
        std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g\n", p[0], p[1], p[2]);
        unit_points += line;
        std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g\n", std::ldexp(p[0], e), std::ldexp(p[1], e),
                      std::ldexp(p[2], e));
        points += line;
    }
    report_of({"query", shell, shop.add("p.csv", points), "-o", out("a.csv")});
    report_of({"query", of_unit, shop.add("u.csv", unit_points), "-o", out("ua.csv")});
    const auto sides = [](const std::string& text) {
        std::string codes;
        for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n', end + 1))
            codes += text.substr(text.rfind(',', end) + 1, end - text.rfind(',', end));
        return codes;
    };
    EXPECT_EQ(sides(content(out("a.csv"))), sides(content(out("ua.csv"))));
    const json surface = report_of({"surface", shell, "-o", out("s.ply")});
    EXPECT_EQ(surface["surfaces"][0]["certified"], true);
    EXPECT_EQ(surface["surfaces"][0]["faces"],
              report_of({"surface", of_unit, "-o", out("us.ply")})["surfaces"][0]["faces"]);
    report_of({"verify", shell, mesh});
    report_of({"slice", shell, "-o", out("s.png"), "--mesh", mesh, "--size", "64"});
    report_of({"render", shell, "-o", out("r.png"), "--size", "256", "--samples", "1"});
    report_of({"view", shell, "-o", out("v.html")});
    // Formats of 32 bits: what is written is that size, or refused.
    const Result single = run({"surface", shell, "-o", out("s.stl"), "-q", "--no-measure"});
    if (std::abs(e) < 120) {
        EXPECT_EQ(single.status, 0) << single.error;
    } else {
        EXPECT_EQ(single.status, 2);
        EXPECT_THAT(single.error, HasSubstr("32-bit numbers"));
    }
    const Result grid = run({"surface", shell, "-o", out("s.vdb"), "-q"});
    if (grid.status != 0) {
        EXPECT_THAT(grid.error, testing::AnyOf(HasSubstr("OpenVDB"), HasSubstr("32-bit"))) << e;
    }
}

INSTANTIATE_TEST_SUITE_P(PowersOfTwo, SizesOfShells, testing::Values(-245, -101, 101, 245));

TEST_P(OtherSizes, AreRefusedByTheirSize) {
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"build", mesh, "-o", out("a.its")},
          std::vector<std::string>{"build", mesh, "-o", out("a.its"), "--depth", "3", "--turn-parts"}}) {
        const Result result = run(arguments);
        EXPECT_EQ(result.status, 2);
        EXPECT_THAT(result.error, HasSubstr("must lie in [1e-75, 1e+75]"));
        EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1);
    }
    const json simplified = report_of({"simplify", mesh, "-o", out("s.obj"), "--depth", "4"});
    EXPECT_EQ(simplified["in_shell"], true);
}

INSTANTIATE_TEST_SUITE_P(PowersOfTwo, OtherSizes, testing::Values(-1000, -541, -253, 253, 511, 1000));

}  // namespace
}  // namespace its::cli_test
