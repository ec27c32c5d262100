#include "its/page.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/zoo.h"

namespace its {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const ThinShell& torus_shell() {
    static const ThinShell shell = build(zoo::torus(1, 0.4, 48, 24), {.depth = 4});
    return shell;
}

/// What the page's script would read.
json data_of(const std::string& html) {
    const std::string open = "<script type=\"application/json\" id=\"its-data\">";
    const std::size_t begin = html.find(open) + open.size(), end = html.find("</script>", begin);
    return json::parse(html.substr(begin, end - begin));
}

std::vector<unsigned char> inflate(const std::string& base64, std::size_t size) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::vector<unsigned char> packed, bytes(size);
    std::uint32_t bits = 0;
    int held = 0;
    for (const char c : base64) {
        if (c == '=') break;
        bits = bits << 6 | std::uint32_t(digits.find(c));
        held += 6;
        if (held >= 8) packed.push_back((bits >> (held -= 8)) & 255);
    }
    uLongf got = uLongf(size);
    EXPECT_EQ(uncompress(bytes.data(), &got, packed.data(), uLong(packed.size())), Z_OK);
    EXPECT_EQ(got, size);
    return bytes;
}

/// The inverse of how the page's numbers are written; as web/src/data.js, in other words.
std::vector<std::int32_t> decode(const std::string& base64, std::size_t count, std::size_t stride) {
    const auto bytes = inflate(base64, 4 * count);
    std::vector<std::int32_t> values(count);
    for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t zigzag = 0;
        for (std::size_t k = 0; k < 4; ++k) zigzag |= std::uint32_t(bytes[k * count + i]) << 8 * k;
        const std::uint32_t difference = zigzag >> 1 ^ (0u - (zigzag & 1));
        values[i] = std::int32_t(difference + (i >= stride ? std::uint32_t(values[i - stride]) : 0));
    }
    return values;
}

TEST(View, PageHoldsTheMesh) {
    const json data = data_of(view_page(torus_shell(), {.title = "a torus", .field_samples = 16}));
    EXPECT_EQ(data["title"], "a torus");
    const Mesh& mesh = torus_shell().mesh();
    const auto positions = decode(data["mesh"]["positions"], 3 * mesh.vertices.size(), 3);
    const auto indices = decode(data["mesh"]["indices"], 3 * mesh.triangles.size(), 3);
    const double step = data["mesh"]["step"], scale = data["scale"];
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(positions[3 * v + std::size_t(axis)] * step * scale +
                            data["centre"][std::size_t(axis)].get<double>(),
                        mesh.vertices[v][axis], 0.51 * step * scale);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(std::uint32_t(indices[3 * t + i]), mesh.triangles[t][i]);
    EXPECT_FALSE(data["outer"].is_null());
    EXPECT_FALSE(data["inner"].is_null());
}

TEST(View, PageHoldsTheField) {
    const json data = data_of(view_page(torus_shell(), {.field_samples = 20}));
    const json& field = data["field"];
    const auto n = field["samples"].get<std::array<std::size_t, 3>>();
    EXPECT_EQ(*std::max_element(n.begin(), n.end()), 20u);
    const auto values = decode(field["values"], n[0] * n[1] * n[2], 1);
    const double scale = data["scale"], step = field["step"];
    const auto place = [&](int axis, std::size_t i) {
        const std::size_t a = std::size_t(axis);
        return scale * (field["low"][a].get<double>() +
                        field["size"][a].get<double>() * double(i) / double(n[a] - 1)) +
               data["centre"][a].get<double>();
    };
    for (std::size_t z = 0; z < n[2]; ++z)
        for (std::size_t y = 0; y < n[1]; ++y)
            for (std::size_t x = 0; x < n[0]; ++x)
                EXPECT_NEAR(values[(z * n[1] + y) * n[0] + x] * step * scale,
                            torus_shell().value({place(0, x), place(1, y), place(2, z)}),
                            0.51 * step * scale + 1e-9);
}

TEST(View, LoadsNothingAndEscapesTheTitle) {
    const std::string html = view_page(torus_shell(), {.title = "</script><!-- \xff", .field_samples = 16});
    EXPECT_EQ(data_of(html)["title"], "</script><!-- \uFFFD");  // what is not UTF-8 is replaced
    for (const char* outside : {"src=\"", "<link rel=\"stylesheet\"", "@import"})
        EXPECT_EQ(html.find(outside), std::string::npos) << outside;
    EXPECT_EQ(html.find("__ITS_DATA__"), std::string::npos);
    EXPECT_NE(html.find("default-src 'none'"), std::string::npos);
}

TEST(View, SameBytesForAnyNumberOfThreads) {
    EXPECT_EQ(view_page(torus_shell(), {.run = {.threads = 1}}),
              view_page(torus_shell(), {.run = {.threads = 2}}));
}

TEST(View, SaysWhatIsShownSimplified) {
    const ThinShell shell = build(zoo::sphere({0, 0, 0}, 1, 5), {.depth = 5});
    const auto notes = [&](const ViewOptions& options) {
        return data_of(view_page(shell, options))["notes"].dump();
    };
    EXPECT_EQ(notes({.field_samples = 16}).find("merged"), std::string::npos);
    EXPECT_EQ(notes({.field_samples = 16}).find("extracted on"), std::string::npos);
    const std::string coarse = notes({.field_samples = 16, .max_triangles = 1000});
    EXPECT_NE(coarse.find("merged"), std::string::npos);
    EXPECT_NE(coarse.find("extracted on"), std::string::npos);
}

TEST(View, EveryKindOfMesh) {
    for (const zoo::Entry& entry : zoo::all()) {
        const json data = data_of(view_page(build(entry.mesh, {.depth = 3}), {.field_samples = 16}));
        EXPECT_FALSE(data["mesh"].is_null()) << entry.name;
        EXPECT_FALSE(data["outer"].is_null()) << entry.name;
    }
}

TEST(View, RefusesOptionsOutOfRange) {
    for (const ViewOptions& wrong : std::vector<ViewOptions>{{.up = 3},
                                                             {.resolution = -1},
                                                             {.field_samples = 15},
                                                             {.field_samples = 257},
                                                             {.max_triangles = 999},
                                                             {.run = {.threads = -1}}})
        EXPECT_THROW(view_page(torus_shell(), wrong), OptionError);
}

TEST(View, IsWrittenWholeOrNotAtAll) {
    const fs::path path = fs::temp_directory_path() / fmt::format("its-view-{}.html", ::getpid());
    EXPECT_THROW(write_view(torus_shell(), "/nowhere/at/all.html", {.field_samples = 16}), FileError);
    write_view(torus_shell(), path, {.field_samples = 16});
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    EXPECT_EQ(text.str(), view_page(torus_shell(), {.field_samples = 16}));
    fs::remove(path);
}

}  // namespace
}  // namespace its
