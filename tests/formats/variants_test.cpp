// What programs write beside the usual forms of the text formats and STL: each mesh here is the tetrahedron of
// volume 1 from (0, 0, 0) to (1, 2, 3), or nearly.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "base/quote.h"
#include "formats/point_readers.h"
#include "formats/readers.h"
#include "formats/samples.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/points.h"

namespace its {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

using samples::raw;

std::filesystem::path data(const std::string& name) {
    return std::filesystem::path(ITS_SOURCE_DIR) / "tests" / "data" / name;
}

std::string error_of(const std::function<void()>& call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

/// Four triangles, closed, of volume 1.
void expect_tetrahedron(const MeshFile& file, const std::string& what) {
    const MeshReport report = inspect(file.mesh);
    EXPECT_EQ(file.mesh.triangles.size(), 4u) << what;
    EXPECT_TRUE(report.closed) << what;
    EXPECT_NEAR(report.signed_volume, 1, 1e-15) << what;
    EXPECT_EQ(report.bounds.min, (Vec3{0, 0, 0})) << what;
    EXPECT_EQ(report.bounds.max, (Vec3{1, 2, 3})) << what;
}

TEST(Variants, FilesOfReports) {
    for (const char* name :
         {"group_name_backslash.obj", "comment_backslash.off", "counts_on_three_lines.off", "one_line.stl"}) {
        const MeshFile file = read_mesh(data(name));
        expect_tetrahedron(file, name);
        EXPECT_THAT(file.warnings, IsEmpty()) << name;
    }
    const MeshFile attributes = read_mesh(data("binary_attribute_bytes.stl"));
    expect_tetrahedron(attributes, "binary_attribute_bytes.stl");
    EXPECT_THAT(attributes.warnings, ElementsAre(HasSubstr("16 bytes of attributes")));
    EXPECT_EQ(read_points(data("decimal_commas.csv")),
              (std::vector<Vec3>{{0.5, 0.25, 1.5}, {0.5, 0.5, 0.5}, {1.5, 1.5, 2.5}}));
}

TEST(Variants, GltfFilesOfReports) {
    expect_tetrahedron(read_mesh(data("data_uri_other_type.gltf")), "data URI");
    const MeshFile instances = read_mesh(data("gpu_instancing_required.glb"));
    const MeshReport report = inspect(instances.mesh);
    EXPECT_EQ(report.triangles, 8u);
    EXPECT_EQ(report.bounds.min, (Vec3{0, 0, 0}));
    EXPECT_EQ(report.bounds.max, (Vec3{11, 2, 3}));
    for (const auto& [name, extension] : {std::pair{"unknown_required_extension.glb", "XYZ_unknown_geometry"},
                                          {"draco_required.glb", "KHR_draco_mesh_compression"},
                                          {"meshopt_khr_required.glb", "KHR_meshopt_compression"}})
        EXPECT_THAT(error_of([&, file = name] { read_mesh(data(file)); }), HasSubstr(extension));
}

TEST(Variants, SomeFormatsSayWhichAxisIsUp) {
    EXPECT_EQ(read_mesh(data("gpu_instancing_required.glb")).up, UpAxis::y);
    EXPECT_EQ(read_mesh(data("data_uri_other_type.gltf")).up, UpAxis::y);
    EXPECT_EQ(read_mesh(data("slicer_modifier_part.3mf")).up, UpAxis::z);
    EXPECT_EQ(read_mesh(data("group_name_backslash.obj")).up, UpAxis::unknown);
    EXPECT_EQ(read_mesh(data("one_line.stl")).up, UpAxis::unknown);
}

TEST(Variants, ThreeMfFilesOfReports) {
    const MeshFile file = read_mesh(data("slicer_modifier_part.3mf"));
    expect_tetrahedron(file, "modifier");
    EXPECT_THAT(
        file.warnings,
        ElementsAre("part 2 of object 3 left out: Metadata/model_settings.config calls it a modifier, which is "
                    "not printed"));
}

const std::string vertices_3mf = R"(<vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>)"
                                 R"(<vertex x="0" y="2" z="0"/><vertex x="0" y="0" z="3"/></vertices>)";
const std::string triangles_3mf = R"(<triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>)"
                                  R"(<triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3"/>)";

/// A 3MF file with a file of a slicer.
MeshFile sliced(const std::string& resources, const std::string& build, const std::string& name,
                const std::string& config) {
    const std::string model =
        "<model><resources>" + resources + "</resources><build>" + build + "</build></model>";
    return formats::parse_3mf(
        samples::zip({{"3D/3dmodel.model", model}, {name, "<config>" + config + "</config>"}}));
}

TEST(Variants, PrusaSlicersVolumesAreRangesOfTriangles) {
    // Three times the same tetrahedron in one object: its triangles 0 to 3, 4 to 7, 8 to 11.
    const std::string object = R"(<object id="7"><mesh>)" + vertices_3mf + "<triangles>" + triangles_3mf +
                               triangles_3mf + triangles_3mf + "</triangles></mesh></object>";
    const auto volume = [](int first, int last, const std::string& metadata) {
        return fmt::format(R"(<volume firstid="{}" lastid="{}"><metadata type="volume" key="name" value="a"/>)"
                           R"(<metadata type="volume" {}/><mesh edges_fixed="0"/></volume>)",
                           first, last, metadata);
    };
    const std::string item = R"(<item objectid="7"/>)";
    for (const auto& [metadata, what] :
         {std::pair{R"(key="volume_type" value="ParameterModifier")", "a modifier"},
          {R"(key="modifier" value="1")", "a modifier"},
          {R"(key="volume_type" value="NegativeVolume")", "a negative volume, which is not subtracted"},
          {R"(key="volume_type" value="SupportBlocker")", "a support blocker"},
          {R"(key="volume_type" value="SupportEnforcer")", "a support enforcer"}}) {
        const std::string part = R"(key="volume_type" value="ModelPart")";
        const MeshFile file = sliced(object, item + item, "Metadata/Slic3r_PE_model.config",
                                     R"(<object id="7" instances_count="2">)" + volume(0, 3, metadata) +
                                         volume(4, 7, part) + volume(8, 11, metadata) + "</object>");
        EXPECT_EQ(file.mesh.triangles.size(), 8u) << what;
        EXPECT_THAT(file.warnings,
                    ElementsAre(HasSubstr(fmt::format("triangles 0 to 3 of object 7 left out: "
                                                      "Metadata/Slic3r_PE_model.config calls it {}",
                                                      what)),
                                HasSubstr("triangles 8 to 11 of object 7 left out")));
    }
    // Ranges beyond the object, of another object, upside down: nothing is left out.
    const std::string modifier = R"(key="volume_type" value="ParameterModifier")";
    for (const std::string& config :
         {R"(<object id="7">)" + volume(12, 99, modifier) + "</object>",
          R"(<object id="8">)" + volume(0, 3, modifier) + "</object>",
          R"(<object id="7">)" + volume(3, 0, modifier) + "</object>", volume(0, 3, modifier)}) {
        const MeshFile file = sliced(object, item, "Metadata/Slic3r_PE_model.config", config);
        EXPECT_EQ(file.mesh.triangles.size(), 12u) << config;
        EXPECT_THAT(file.warnings, IsEmpty()) << config;
    }
    const MeshFile overlapping =
        sliced(object, item, "Metadata/Slic3r_model.config",
               R"(<object id="7">)" + volume(2, 9, modifier) + volume(0, 4, modifier) + "</object>");
    EXPECT_EQ(overlapping.mesh.triangles.size(), 2u);
}

TEST(Variants, BambusPartsAreComponents) {
    const std::string mesh = "<mesh>" + vertices_3mf + "<triangles>" + triangles_3mf + "</triangles></mesh>";
    const std::string resources =
        R"(<object id="1">)" + mesh + R"(</object><object id="2">)" + mesh +
        R"(</object><object id="3"><components><component objectid="1"/>)"
        R"(<component objectid="2" transform="1 0 0 0 1 0 0 0 1 5 0 0"/></components></object>)"
        R"(<object id="4"><components><component objectid="2"/></components></object>)";
    const std::string build = R"(<item objectid="3"/><item objectid="4"/>)";
    for (const auto& [subtype, what] : {std::pair{"modifier_part", "a modifier"},
                                        {"negative_part", "a negative volume"},
                                        {"support_blocker", "a support blocker"},
                                        {"support_enforcer", "a support enforcer"}}) {
        const MeshFile file = sliced(
            resources, build, "Metadata/model_settings.config",
            fmt::format(R"(<object id="3"><metadata key="name" value="x"/><part id="1" subtype="normal_part"/>)"
                        R"(<part id="2" subtype="{}"><metadata key="name" value="y"/></part></object><plate/>)",
                        subtype));
        EXPECT_EQ(file.mesh.triangles.size(), 8u) << "object 4 uses it as a solid";
        EXPECT_THAT(file.warnings,
                    ElementsAre(HasSubstr(fmt::format("part 2 of object 3 left out: {} calls it {}",
                                                      "Metadata/model_settings.config", what))));
    }
    // Many of them: a few lines.
    std::string many, parts, components;
    for (int i = 10; i < 60; ++i) {
        many += fmt::format(R"(<object id="{}">{}</object>)", i, mesh);
        components += fmt::format(R"(<component objectid="{}"/>)", i);
        if (i > 10) parts += fmt::format(R"(<part id="{}" subtype="modifier_part"/>)", i);
    }
    const MeshFile file =
        sliced(many + R"(<object id="3"><components>)" + components + "</components></object>",
               R"(<item objectid="3"/>)", "Metadata/model_settings.config",
               R"(<object id="3">)" + parts + "</object>");
    EXPECT_EQ(file.mesh.triangles.size(), 4u);
    EXPECT_THAT(file.warnings, SizeIs(17));
    EXPECT_EQ(file.warnings.back(), "33 more such parts left out");
}

/// OBJ statements of the tetrahedron with something after the vertices, with each kind of line end.
void expect_obj(const std::string& between, const std::string& faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n") {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        std::string text = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n" + between + faces, lines;
        for (const char c : text) c == '\n' ? lines += end : lines += c;
        expect_tetrahedron(formats::parse_obj(lines), between);
        expect_tetrahedron(formats::parse_obj(lines, {.attributes = true}), between);
    }
}

TEST(Variants, ObjNamesAndCommentsEndWithTheirLine) {
    for (const char* name : {"g C:\\x\\\n", "o part \\\n", "usemtl a\\\n", "mtllib C:\\my parts\\\n",
                             "# C:\\\n", "  #\\\n", "s \\\n", "\\\n", "vp 1 2 # \\\n", "unknown \\\n"})
        expect_obj(name);
    expect_obj("", "f 1 3 2 # a \\\nf 1 2 4\nf 1 4 3#\\\nf 2 3 4 \\");
    expect_obj("", "f 1 3 2 # a\nf 1//7#\\ \\\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");  // a face of one corner, left out
}

TEST(Variants, ObjNumbersGoOnInTheNextLine) {
    expect_obj("", "f 1\\\n3 2\nf \\\n1 \\\n2 \\\n4\nf\\\n1 4 3\nf 2/1/1\\\n3/1/1 4/1/1\n");
    expect_obj("vn 0 0 \\\n1\nvt 0 \\\n0\n");
    const MeshFile file =
        formats::parse_obj("v 0 0\\\n0\nv 1\\\n\\\n0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4");
    expect_tetrahedron(file, "vertices");
}

TEST(Variants, ObjHomogeneousVerticesAreDivided) {
    const std::string faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    const MeshFile file = formats::parse_obj("v 0 0 0 7\nv 2 0 0 2\nv 0 1 0 0.5\nv 0 0 -3 -1\n" + faces);
    expect_tetrahedron(file, "weights");
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("4 vertices have a weight")));
    const MeshFile ones = formats::parse_obj("v 0 0 0 1\nv 1 0 0 1.0\nv 0 2 0\nv 0 0 3 1 # w\n" + faces);
    expect_tetrahedron(ones, "weights of 1");
    EXPECT_THAT(ones.warnings, IsEmpty());
    const MeshFile colours = formats::parse_obj(
        "v 0 0 0 .5 .5 .5\nv 1 0 0 0 0 0\nv 0 2 0 .5 .5 .5 .5\nv 0 0 3 1 0 1\n" + faces, {.attributes = true});
    expect_tetrahedron(colours, "colours");
    EXPECT_EQ(colours.attributes.colours.at(0, 1), (Colour{0.5, 0.5, 0.5, 0.5}));
    const MeshFile infinite = formats::parse_obj("v 0 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n" + faces);
    EXPECT_EQ(infinite.mesh.triangles.size(), 1u) << "the point with w = 0 is none";
}

/// The tetrahedron in OFF: the header, then vertices and faces.
std::string off(const std::string& header, const std::string& vertices, const std::string& faces = "") {
    return header + vertices + (faces.empty() ? "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n" : faces);
}

const std::string plain = "0 0 0\n1 0 0\n0 2 0\n0 0 3\n";

TEST(Variants, OffCountsAndVerticesAreFreeOfLines) {
    for (const std::string header :
         {"OFF 4 4 6\n", "OFF\n4\n4\n6\n", "OFF 4\n4 6\n", "OFF\n4 4\n6\n",
          "OFF\n4 # vertices\\\n4\n\n6#edges\n", "OFF\n4 4 6 ", "OFF\n4 4\n", "OFF\n4\n4\n", "4 4 6\n",
          "nOFF 3 4 4 6\n", "nOFF\n3\n4 4 6\n", "off\n4 4 0\n", "\xef\xbb\xbfOFF\n4 4 6\n"})
        for (const std::string& vertices :
             {plain, std::string("0 0 0 1 0 0 0 2 0 0 0 3\n"), std::string("0\n0\n0\n1 0\n0 0\n2 0 0 0 3\n"),
              std::string("0 0 0 1 0 0\n0 2 0 0 0 3\n"),
              std::string("0 0 0 # a\\\n\n1 0 0\n# C:\\\n0 2 0\n0 0 3 ")}) {
            if ((header == "OFF\n4 4\n" || header == "OFF\n4\n4\n") && vertices != plain)
                continue;  // ambiguous
            const MeshFile file = formats::parse_off(off(header, vertices));
            expect_tetrahedron(file, header + vertices);
            EXPECT_THAT(file.warnings, IsEmpty()) << header + vertices;
        }
    std::string windows;
    for (const char c : off("OFF\n4\n4\n6\n", "0\n0 0\n1 0 0\n0 2 0\n0 0 3\n"))
        c == '\n' ? windows += "\r\n" : windows += c;
    expect_tetrahedron(formats::parse_off(windows), "CR LF");
}

TEST(Variants, OffKeywordsSayWhatAVertexIs) {
    struct Case {
        const char *keyword, *vertices;
    };
    for (const auto& [keyword, vertices] : {
             Case{"COFF", "0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 2 0 255 0 0 255\n0 0 3 255 0 0 255\n"},
             Case{"COFF", "0 0 0 1 0 0\n1 0 0 1 0 0\n0 2 0 1 0 0\n0 0 3 1 0 0\n"},
             Case{"COFF", "0 0 0 1 0 0 1 1 0 0 1 0 0 1\n0 2 0 1 0 0 1 0 0 3 1 0 0 1\n"},
             Case{"COFF", "0 0 0\n1 0 0 1\n1 0 0\n1 0 0 1\n0 2 0\n1 0 0 1\n0 0 3\n1 0 0 1\n"},
             Case{"NOFF", "0 0 0 0 0 1\n1 0 0 0 0 1\n0 2 0 0 0 1\n0 0 3 0 0 1\n"},
             Case{"NOFF", "0 0 0\n0 0 1\n1 0 0\n0 0 1\n0 2 0\n0 0 1\n0 0 3\n0 0 1\n"},
             Case{"4OFF", "0 0 0 1\n2 0 0 2\n0 1 0 0.5\n0 0 3 1\n"},
             Case{"4OFF", "0 0 0 1 2 0 0 2 0 1\n0 0.5 0 0 3 1\n"},
             Case{"STCN4nOFF 3",
                  "0 0 0 1 0 0 1 1 0 0 1 .5 .5\n2 0 0 2 0 0 1 1 0 0 1 .5 .5\n0 1 0 .5 0 0 1 1 0 0 1 .5 .5\n"
                  "0 0 3 1 0 0 1 1 0 0 1 .5 .5\n"},
             Case{"STOFF", "0 0 0 .5 .5 1 0 0 .5 .5\n0 2 0 .5 .5\n0 0 3 .5 .5\n"},
         }) {
        const MeshFile file =
            formats::parse_off(off(fmt::format("{}\n4 4 6\n", keyword), vertices), {.attributes = true});
        expect_tetrahedron(file, fmt::format("{} {}", keyword, vertices));
        EXPECT_THAT(file.warnings, IsEmpty()) << keyword << vertices;
        const std::string word = keyword;
        EXPECT_EQ(!file.attributes.colours.empty(), word.find('C') != word.npos) << keyword << vertices;
        EXPECT_EQ(!file.attributes.normals.empty(), word.find('N') != word.npos) << keyword << vertices;
        EXPECT_EQ(!file.attributes.texture.empty(), word.find("ST") != word.npos) << keyword << vertices;
        if (!file.attributes.colours.empty()) {
            EXPECT_EQ(file.attributes.colours.at(0, 0), (Colour{1, 0, 0, 1})) << keyword << vertices;
        }
    }
}

TEST(Variants, OffNumbersThatNobodyAnnouncedAreSaid) {
    const std::string coloured = "0 0 0 9 9 9\n1 0 0 9 9 9\n0 2 0 9 9 9\n0 0 3 9 9 9\n";
    const MeshFile file = formats::parse_off(off("OFF\n4 4 6\n", coloured));
    expect_tetrahedron(file, coloured);
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("4 vertices have more numbers on their line")));
    const MeshFile mixed = formats::parse_off(off("OFF\n4 4 6\n", "0 0 0\n1 0 0 5\n0 2 0\n0 0 3 1 1 1 1\n"));
    expect_tetrahedron(mixed, "mixed");
    EXPECT_THAT(mixed.warnings, ElementsAre(HasSubstr("2 vertices have more numbers on their line")));
    // A keyword that promises colours, and none there.
    expect_tetrahedron(formats::parse_off(off("COFF\n4 4 6\n", plain)), "COFF without colours");
}

TEST(Variants, OffFacesEndWithTheirLine) {
    const MeshFile file = formats::parse_off(
        off("OFF\n4 4 6\n", plain, "3 0 2 1 7\n3 0 1 3 255 0 0\n3 0 3\n2 .5 .5 .5 1 # c\n3 1 2 3\n"));
    expect_tetrahedron(file, "colours");
    EXPECT_THAT(file.warnings, IsEmpty());
    const auto read = [](const std::string& faces) { formats::parse_off(off("OFF\n4 4 6\n", plain, faces)); };
    EXPECT_THAT(error_of([&] { read("3 0 2 1\n3 0 1 3 3 0 3 2 9\n3 1 2 3\n"); }),
                HasSubstr("line 8: more than a face"));
    EXPECT_THAT(error_of([&] { read("3 0 2 1 red\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"); }),
                HasSubstr("line 7: more than"));
    EXPECT_THAT(formats::parse_off(off("OFF\n4 3 6\n", plain)).warnings,
                ElementsAre(HasSubstr("line 10: the file goes on after its 3 faces")));
    // Two faces on a line read as one with a colour; the count tells.
    EXPECT_THAT(formats::parse_off(off("OFF\n4 4 6\n", plain, "3 0 2 1 3 0 1 3\n3 0 3 2\n3 1 2 3\n")).warnings,
                ElementsAre(HasSubstr("4 faces, the file has 3")));
}

const std::string facets[4] = {
    "facet normal 0 0 0 outer loop vertex 0 0 0 vertex 0 2 0 vertex 1 0 0 endloop endfacet",
    "facet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 0 3 endloop endfacet",
    "facet normal 0 0 0 outer loop vertex 0 0 0 vertex 0 0 3 vertex 0 2 0 endloop endfacet",
    "facet normal 0 0 0 outer loop vertex 1 0 0 vertex 0 2 0 vertex 0 0 3 endloop endfacet"};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += by.size())
        text.replace(at, what.size(), by);
    return text;
}

TEST(Variants, StlTextIsFreeInItsWhiteSpaceAndWords) {
    const std::string all = facets[0] + " " + facets[1] + " " + facets[2] + " " + facets[3];
    std::string upper = "solid x " + all + " endsolid x";
    for (char& c : upper) c = c >= 'a' && c <= 'z' ? char(c - 32) : c;
    for (const std::string& text :
         {"solid " + all + " endsolid", "solid my part (v2) vertex " + all + " endsolid my part", upper,
          "solid x\n" + replaced(all, "endloop endfacet", "end loop\nend facet") + "\nend solid x\n",
          "solid a " + facets[0] + " " + facets[1] + " endsolid a solid b " + facets[2] + " " + facets[3] +
              " endsolid b\n",
          "solid a\n" + facets[0] + "\nendsolid a\nsolid facet\n" + facets[1] + facets[2] +
              "\nendsolid\n\n solid c " + facets[3] + " endsolid c",
          "solid x\r" + replaced(all, " vertex", "\r\n\tvertex") + "\rendsolid x"}) {
        const MeshFile file = formats::parse_mesh(text, ".stl");
        expect_tetrahedron(file, text);
        EXPECT_EQ(file.format, "stl-ascii");
        EXPECT_THAT(file.warnings, IsEmpty()) << text;
    }
}

/// The tetrahedron as binary STL; `attributes`: the number after each facet, `bytes` what follows it.
std::string binary_stl(std::uint32_t claimed, std::uint16_t attributes, const std::string& bytes) {
    const MeshFile mesh = formats::parse_stl("solid " + facets[0] + facets[1] + facets[2] + facets[3]);
    std::string file = std::string(80, ' ') + raw(claimed);
    for (const Triangle& t : mesh.mesh.triangles) {
        file += std::string(12, '\0');
        for (const std::uint32_t v : t)
            for (int axis = 0; axis < 3; ++axis) file += raw(float(mesh.mesh.vertices[v][axis]));
        file += raw(attributes) + bytes;
    }
    return file;
}

TEST(Variants, StlAttributesThatFollowAreSkipped) {
    for (const std::size_t count : {1u, 2u, 50u, 300u}) {
        const MeshFile file =
            formats::parse_mesh(binary_stl(4, std::uint16_t(count), std::string(count, 'A')), ".stl");
        expect_tetrahedron(file, std::to_string(count));
        EXPECT_THAT(file.warnings, ElementsAre(HasSubstr(fmt::format("{} bytes of attributes", 4 * count))));
    }
    const MeshFile colours =
        formats::parse_mesh(binary_stl(4, 0x801f, ""), ".stl");  // colours, as most write them
    expect_tetrahedron(colours, "colours");
    EXPECT_THAT(colours.warnings, IsEmpty());
    for (const std::uint32_t unknown : {0u, 0xffffffffu}) {
        const MeshFile file = formats::parse_mesh(binary_stl(unknown, 0, ""), ".stl");
        expect_tetrahedron(file, "count unknown");
        EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("all read")));
    }
}

TEST(Variants, CsvDecimalCommas) {
    const std::vector<Vec3> points = {{0.5, -0.25, 15}, {1e-3, 0.5, 2}};
    for (const char* text : {"0,5;-0,25;1,5e1\n,001;0,5;2\n", "x\ty\tz\n0,5\t-0,25\t15,0\n1,0e-3\t,5\t2,\n",
                             "z; y ;x;name\r\n15;\"-0,25\";0,5;a,b\r\n2; 0,5 ;0,001;\"c;d\"\r\n",
                             "\"0,5\",\"-0,25\",15\n0.001,\"0,5\",\"2\"\n", "0.5;-0.25;15\n0,001;0.5;2\n"})
        EXPECT_EQ(formats::parse_csv(text), points) << text;
    for (const char* text :
         {"1,234,5;0;0\n", "1.234,5;0;0\n", "1,234.5;0;0\n", "0,5 0,25 1,5\n", "x;y;z\n1,2,3\n"})
        EXPECT_THAT(error_of([&] { formats::parse_csv(text); }), HasSubstr("numbers are expected")) << text;
}

TEST(Variants, NpyRecordsAreNamedAsSuch) {
    for (const std::string type : {"[('x', '<f8'), ('y', '<f8'), ('z', '<f8')]", "('<f8', (3,))"}) {
        const std::string header = "{'descr': " + type + ", 'fortran_order': False, 'shape': (1,), }\n";
        const std::string file = std::string("\x93NUMPY\x01\x00", 8) + raw(std::uint16_t(header.size())) +
                                 header + std::string(24, '\0');
        EXPECT_THAT(error_of([&] { formats::parse_npy(file); }), HasSubstr("structured array"));
    }
}

/// Errors and warnings repeat what a file says, however long and whatever is in it.
TEST(Variants, LinesStayShort) {
    const std::string longest(100'000, 'x');
    const samples::TemporaryFolder folder;
    const auto line_of = [&](const std::string& name, const std::string& bytes) {
        samples::write_file(folder / name, bytes);
        try {
            if (name.ends_with(".npy") || name.ends_with(".csv"))
                read_points(folder / name);
            else
                return read_mesh(folder / name).warnings.at(0);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("no error");
    };
    const std::string npy =
        "{'descr': '" + std::string(50'000, 'f') + "', 'fortran_order': False, 'shape': (1,), }\n";
    const std::string name = std::string(200, 'n');
    for (const auto& [file, bytes] : std::vector<std::pair<std::string, std::string>>{
             {name + ".ply",
              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
              "float z\nelement face 1\nproperty list uchar int vertex_indices\nelement " +
                  longest + "\x1b[31m 2\nproperty int a\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n7\n"},
             {name + ".npy", std::string("\x93NUMPY\x01\x00", 8) + raw(std::uint16_t(npy.size())) + npy},
             {name + ".csv", "1," + longest + "\n"},
             {name + ".off", "OFF\n3 1 0\n" + longest}}) {
        const std::string line = line_of(file, bytes);
        EXPECT_LT(line.size(), 300u) << line;
        EXPECT_GT(line.size(), 30u) << line;
        EXPECT_EQ(line.find_first_of("\n\x1b"), line.npos) << line;
    }
}

TEST(Variants, QuotedTextEndsBetweenCharacters) {
    const std::string text = "\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4";  // five of two bytes
    EXPECT_EQ(quotable(text, 10), text);
    EXPECT_EQ(quotable(text, 9), text.substr(0, 6) + "...");
    EXPECT_EQ(quotable(text, 8), text.substr(0, 4) + "...");
    EXPECT_EQ(quotable_end(text, 9), "..." + text.substr(4));
    EXPECT_EQ(quotable_end(text, 8), "..." + text.substr(6));
    EXPECT_EQ(quotable("a\tb\x7f", 8), "a b ");
}

}  // namespace
}  // namespace its
