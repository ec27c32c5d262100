// What each reader understands, one quirk a test.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "formats/readers.h"
#include "formats/samples.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

namespace its {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using samples::raw;

/// Twice the area, signed, of a mesh in a plane z = const.
double area(const Mesh& mesh) {
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
        sum += cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]).z;
    }
    return sum;
}

std::string error_of(const std::function<void()>& call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

TEST(Obj, ReadsAllFormsOfFaces) {
    const MeshFile file = formats::parse_obj(
        "# comment\nmtllib x.mtl\no a\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 1\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
        "g first\nusemtl red\ns off\nf 1 2 3\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/1/1 4/1/1 # tail\nl 1 "
        "2\np 1\n");
    EXPECT_EQ(file.format, "obj");
    EXPECT_THAT(file.warnings, IsEmpty());
    EXPECT_THAT(file.mesh.triangles,
                ElementsAre(Triangle{0, 1, 2}, Triangle{0, 1, 2}, Triangle{0, 1, 2}, Triangle{0, 1, 3}));
    EXPECT_EQ(file.mesh.vertices[2], (Vec3{1, 1, 0}));
}

TEST(Obj, NegativeIndicesCountBackFromTheLastVertexSoFar) {
    const MeshFile file =
        formats::parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -1/5 -2/6 -4\nf -5 1 2");
    EXPECT_THAT(file.mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{3, 2, 0}));
    ASSERT_EQ(file.warnings.size(), 1u);
    EXPECT_THAT(file.warnings[0], HasSubstr("face 3"));
}

TEST(Obj, FacesMayComeBeforeTheirVertices) {
    EXPECT_THAT(formats::parse_obj("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").mesh.triangles,
                ElementsAre(Triangle{0, 1, 2}));
}

TEST(Obj, JoinsLinesAndTakesEveryLineEnd) {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        const std::string text = "v 0 0 0" + end + "v 1 \\" + end + "0 0" + end + "v 0 1 0" + end + "# no \\" +
                                 end + " joined comment" + end + "f 1 2\\" + end + " 3" + end + end;
        const MeshFile file = formats::parse_obj(text);
        EXPECT_THAT(file.mesh.triangles, ElementsAre(Triangle{0, 1, 2})) << testing::PrintToString(end);
        EXPECT_EQ(file.mesh.vertices[1], (Vec3{1, 0, 0}));
    }
}

TEST(Obj, ReadsNumbersOfAllShapes) {
    const MeshFile file =
        formats::parse_obj("v +1.5 -.5 1e+2\nv 1E-3 2. 1e-400\nv 0 0.1 123456789012345678\nf 1 2 3\n");
    EXPECT_EQ(file.mesh.vertices[0], (Vec3{1.5, -0.5, 100}));
    EXPECT_EQ(file.mesh.vertices[1], (Vec3{1e-3, 2, 0}));
    EXPECT_EQ(file.mesh.vertices[2], (Vec3{0, 0.1, 123456789012345678.0}));
}

TEST(Obj, NumbersOfOldCLibrariesAreNotFinite) {
    for (const char* odd : {"1.#QNAN", "-1.#IND00", "1.#INF", "nan(ind)", "-nan", "+inf"}) {
        const MeshFile file =
            formats::parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv " + std::string(odd) + " 0 0\nf 1 2 3\nf 1 2 4\n");
        EXPECT_EQ(file.mesh.triangles.size(), 1u) << odd;
    }
    EXPECT_EQ(formats::parse_obj("v 0 0 0\nv 1 0 5#comment\nv 0 1 0\nf 1 2 3\n").mesh.vertices[1].z, 5);
}

TEST(Obj, ByteOrderMarkTabsAndHugeComments) {
    const MeshFile file = formats::parse_obj("\xef\xbb\xbf# " + std::string(1 << 20, 'x') +
                                             "\n\tv\t0 0\t0\t\nv 1 0 0\nv 0 1 0\n  f \t1//7\t2//7  3//7 \t\n");
    EXPECT_EQ(file.mesh.triangles.size(), 1u);
    EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(Obj, LeavesOutFacesThatCannotBe) {
    const MeshFile file = formats::parse_obj(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 0 1e999 0\nv 1 2\nv a b c\n"
        "f 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 2 6\nf 1 2 7\nf 1 2\nf 0 1 2\nf 1 2 8\nf a b c\nf 1 2 3x\nf 1.5 2 "
        "3\nf\n");
    EXPECT_EQ(file.mesh.triangles.size(), 1u);
    EXPECT_EQ(file.mesh.vertices.size(), 3u) << "vertices that are not finite must go";
    EXPECT_THAT(
        file.warnings,
        ElementsAre(HasSubstr("3 face(s) left out: not readable"),
                    HasSubstr("2 faces left out: corner index out of range (the first is face 7)"),
                    HasSubstr("2 faces left out: fewer than three corners"),
                    HasSubstr("4 faces left out: corner that is not a finite point (the first is face 2)"),
                    HasSubstr("4 vertices left out")));
}

TEST(Obj, IndicesFollowWhenVerticesAreLeftOut) {
    const MeshFile file = formats::parse_obj("v nan 0 0\nv 1 0 0\nv 2 0 0\nv inf 1 1\nv 3 4 0\nf 2 3 5\n");
    EXPECT_THAT(file.mesh.triangles, ElementsAre(Triangle{0, 1, 2}));
    EXPECT_EQ(file.mesh.vertices[2], (Vec3{3, 4, 0}));
}

TEST(Obj, RefusesWhatHasNoUsableFace) {
    EXPECT_THAT(error_of([] { formats::parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\n"); }), HasSubstr("no faces"));
    EXPECT_THAT(error_of([] { formats::parse_obj("v 0 0 0\nf 1 2 3\n"); }), HasSubstr("none of its 1 faces"));
}

TEST(Polygons, ConcaveOnesKeepTheirArea) {
    // An L, a star, and a comb, in all rotations of their corners, in planes along every axis.
    const std::vector<std::vector<Vec3>> shapes = {
        {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}},
        {{0, 3, 0}, {-1, 1, 0}, {-3, 0, 0}, {-1, -1, 0}, {0, -3, 0}, {1, -1, 0}, {3, 0, 0}, {1, 1, 0}},
        {{0, 0, 0},
         {5, 0, 0},
         {5, 3, 0},
         {4, 3, 0},
         {4, 1, 0},
         {3, 1, 0},
         {3, 3, 0},
         {2, 3, 0},
         {2, 1, 0},
         {1, 1, 0},
         {1, 3, 0},
         {0, 3, 0}},
        {{0, 0, 0}, {2, 0, 0}, {1, 0.1, 0}, {1, 3, 0}}};
    for (const auto& shape : shapes) {
        double expected = 0;
        for (std::size_t i = 0; i < shape.size(); ++i)
            expected += cross(shape[i], shape[(i + 1) % shape.size()]).z;
        for (std::size_t turn = 0; turn < shape.size(); ++turn) {
            for (int axis = 0; axis < 3; ++axis) {
                std::vector<Vec3> points;
                std::vector<std::uint32_t> polygon;
                for (std::size_t i = 0; i < shape.size(); ++i) {
                    const Vec3 p = shape[(i + turn) % shape.size()];
                    points.push_back(axis == 0 ? p : axis == 1 ? Vec3{p.z, p.x, p.y} : Vec3{p.y, p.z, p.x});
                    polygon.push_back(std::uint32_t(i));
                }
                std::uint64_t budget = 1000000;
                std::vector<Triangle> triangles;
                EXPECT_TRUE(formats::triangulate(polygon, points, budget, triangles));
                EXPECT_EQ(triangles.size(), shape.size() - 2);
                double sum = 0;
                for (const auto& [a, b, c] : triangles) {
                    const Vec3 n = cross(points[b] - points[a], points[c] - points[a]);
                    const double part = n[axis == 0 ? 2 : axis == 1 ? 0 : 1];
                    EXPECT_GT(part, 0) << "a triangle outside of the polygon";
                    sum += part;
                }
                EXPECT_NEAR(sum, expected, 1e-12);
            }
        }
    }
}

TEST(Polygons, RandomStarsKeepTheirAreaAndHaveOnlyForwardTriangles) {
    for (unsigned seed = 1; seed <= 200; ++seed) {
        std::uint32_t state = seed * 2654435761u;
        std::vector<Vec3> points;
        std::vector<std::uint32_t> polygon;
        const unsigned n = 4 + seed % 40;
        double expected = 0;
        for (unsigned i = 0; i < n; ++i) {
            state = state * 1664525u + 1013904223u;
            const double radius = 0.2 + double(state >> 8) / double(1 << 24), angle = 6.283185307179586 * i / n;
            points.push_back({radius * std::cos(angle), radius * std::sin(angle), 0.25});
            polygon.push_back(i);
        }
        for (unsigned i = 0; i < n; ++i) expected += cross(points[i], points[(i + 1) % n]).z;
        std::uint64_t budget = 1000000;
        Mesh mesh{points, {}};
        EXPECT_TRUE(formats::triangulate(polygon, points, budget, mesh.triangles));
        for (const auto& [a, b, c] : mesh.triangles) {
            EXPECT_GT(cross(points[b] - points[a], points[c] - points[a]).z, 0);
        }
        EXPECT_NEAR(area(mesh), expected, 1e-12);
    }
}

TEST(Polygons, CollinearCornersOfAConvexOneMakeNoDegenerateTriangles) {
    const MeshFile file = formats::parse_obj("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n");
    EXPECT_EQ(inspect(file.mesh).degenerate, 0u);
    EXPECT_EQ(area(file.mesh), 8);
}

TEST(Polygons, ABridgeToAHoleWorks) {
    const MeshFile file = formats::parse_obj(
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n");
    EXPECT_EQ(file.mesh.triangles.size(), 8u);
    EXPECT_EQ(area(file.mesh), 2 * (16 - 4));
    EXPECT_EQ(inspect(file.mesh).degenerate, 0u);
}

TEST(Polygons, RepeatedCornersBecomeSegments) {
    const MeshFile file =
        formats::parse_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 2 3\nf 1 1 1 2\nf 3 3 3 3\nf 1 2 2\n");
    EXPECT_EQ(file.mesh.triangles.size(), 2u + 2 + 3 + 1 - 0);
    EXPECT_EQ(inspect(file.mesh).degenerate, 7u);
}

TEST(Polygons, CrossingOnesAndFlatOnesEnd) {
    const MeshFile file = formats::parse_obj(
        "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nv 2 2 0\nv 3 3 0\nf 1 2 3 4\nf 1 2 5 6\nf 1 5 2 6 1 2\nf 1 2 1 2 "
        "1 2 3 4 3 4\n");
    EXPECT_EQ(file.mesh.triangles.size(), 2u + 2 + 4 + 8);
}

TEST(Polygons, AHugeConcaveOneEndsSoon) {
    // A comb of 60,000 corners: quadratic clipping of it would take minutes.
    std::string text, face = "f";
    const int teeth = 15000;
    int count = 0;
    const auto add = [&](double x, double y) {
        text += fmt::format("v {} {} 0\n", x, y);
        face += fmt::format(" {}", ++count);
    };
    for (int i = 0; i < teeth; ++i)
        add(2 * i, 0), add(2 * i + 1, 0), add(2 * i + 1, 1 + i % 7), add(2 * i + 2, 1 + i % 7);
    add(2 * teeth, -1), add(0, -1);
    const MeshFile file = formats::parse_obj(text + face);
    EXPECT_EQ(file.mesh.triangles.size(), std::size_t(4 * teeth));
}

TEST(Stl, AsciiTakesAnyCaseNameAndSpacing) {
    const MeshFile file = formats::parse_stl(
        "  SOLID vertex 1 2 3 facet\nFacet Normal 0 0 1 outer loop vertex 0 0 0\tvertex 1 0 0\n\n vertex 0 1e0 "
        "-0.0 endloop "
        "endfacet\r\nfacet normal 0 0 1\nouter loop\nvertex 0 1 0\nvertex 1 0 0\nvertex 1 1 "
        "0\nendloop\nendfacet\nendsolid vertex");
    EXPECT_EQ(file.format, "stl-ascii");
    EXPECT_THAT(file.warnings, IsEmpty());
    EXPECT_THAT(file.mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{2, 1, 3}));
}

TEST(Stl, AsciiCutFacetsAreLeftOut) {
    const MeshFile file = formats::parse_stl(
        "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n");
    EXPECT_EQ(file.mesh.triangles.size(), 1u);
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("1 facet(s) left out"), HasSubstr("endsolid")));
}

std::string binary_stl(std::string header, std::uint32_t claimed, const std::vector<float>& corners) {
    header.resize(80, '\0');
    header += raw(claimed);
    for (std::size_t i = 0; i < corners.size(); i += 9) {
        header += std::string(12, '\0');
        for (std::size_t k = 0; k < 9; ++k) header += raw(corners[i + k]);
        header += std::string(2, '\0');
    }
    return header;
}

TEST(Stl, BinaryMayBeginWithSolid) {
    const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    for (const std::uint32_t claimed : {1u, 2u}) {  // also where the size does not give it away
        const MeshFile file = formats::parse_stl(binary_stl("solid of revolution", claimed, corners));
        EXPECT_EQ(file.format, "stl-binary");
        EXPECT_EQ(file.mesh.triangles.size(), 1u);
        EXPECT_EQ(file.warnings.size(), claimed - 1);
    }
}

TEST(Stl, SeveralSolidsAndNoEnd) {
    const std::string facet =
        "facet normal 0 0 0\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\n";
    const MeshFile two =
        formats::parse_stl("solid a b c\n" + facet + "endsolid a b c\n\nsolid\n" + facet + "endsolid\n");
    EXPECT_EQ(two.mesh.triangles.size(), 2u);
    EXPECT_THAT(two.warnings, IsEmpty());
    const MeshFile open = formats::parse_stl("solid a\n" + facet);
    EXPECT_EQ(open.mesh.triangles.size(), 1u);
    EXPECT_THAT(open.warnings, ElementsAre(HasSubstr("endsolid")));
}

TEST(Stl, CornersAreMergedInTheOrderOfTheFile) {
    const MeshFile file = formats::parse_stl(
        binary_stl("", 2, {0, 0, 0, 1, 0, 0, -0.0f, 1, 0, 0, 1, -0.0f, 1, -0.0f, 0, 5, 5, 5}));
    EXPECT_THAT(file.mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{2, 1, 3}));
    EXPECT_THAT(file.mesh.vertices, ElementsAre(Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{5, 5, 5}));
    EXPECT_FALSE(std::signbit(file.mesh.vertices[2].x));
}

TEST(Stl, WrongCountsInTheHeader) {
    const std::vector<float> two = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    EXPECT_THAT(formats::parse_stl(binary_stl("", 2000, two)).warnings, ElementsAre(HasSubstr("room for 2")));
    EXPECT_THAT(error_of([&] { formats::parse_stl(binary_stl("", 0xffffffff, two) + "x"); }),
                HasSubstr("no STL file, or cut"));
    EXPECT_THAT(error_of([&] { formats::parse_stl(binary_stl("", 0xfffffffe, two)); }),
                HasSubstr("no STL file, or cut"));
    for (const std::uint32_t unknown : {0u, 0xffffffffu}) {  // the size says how many there are
        const MeshFile all = formats::parse_stl(binary_stl("", unknown, two));
        EXPECT_THAT(all.warnings, ElementsAre(HasSubstr("all read")));
        EXPECT_EQ(all.mesh.triangles.size(), 2u);
    }
    const MeshFile fewer = formats::parse_stl(binary_stl("", 1, two));
    EXPECT_THAT(fewer.warnings, ElementsAre(HasSubstr("50 bytes after the last triangle")));
    EXPECT_EQ(fewer.mesh.triangles.size(), 1u);
    EXPECT_THAT(error_of([] { formats::parse_stl("short"); }), HasSubstr("too few"));
}

TEST(Stl, NonFiniteCornersSpoilTheirFacet) {
    const MeshFile file =
        formats::parse_stl(binary_stl("", 2, {0, 0, 0, 1, 0, 0, 0, 1, 0, NAN, 0, 0, 1, INFINITY, 0, 0, 0, 1}));
    EXPECT_EQ(file.mesh.triangles.size(), 1u);
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("1 face left out: corner that is not a finite point (the "
                                                     "first is face 2)")));
    const MeshFile ascii = formats::parse_stl(
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex nan 0 0\nvertex 1 0 0\nvertex 0 1 "
        "0\nendloop\nendfacet\nfacet "
        "normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n");
    EXPECT_EQ(ascii.mesh.triangles.size(), 1u);
    EXPECT_THAT(ascii.warnings, ElementsAre(HasSubstr("not a finite point (the first is face 1)")));
    // An index of other formats that looks like the mark of such a corner is out of range all the same.
    EXPECT_THAT(
        formats::parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4294967295\nf 1 2 4294967296\n").warnings,
        ElementsAre(HasSubstr("2 faces left out: corner index out of range")));
}

TEST(Ply, ReadsEveryScalarTypeInEveryFormat) {
    const std::string types[][2] = {{"char", "int8"},     {"uchar", "uint8"},   {"short", "int16"},
                                    {"ushort", "uint16"}, {"int", "int32"},     {"uint", "uint32"},
                                    {"float", "float32"}, {"double", "float64"}};
    const auto number = [](std::size_t type, double value, bool big) {
        std::string bytes = type == 0   ? raw(std::int8_t(value))
                            : type == 1 ? raw(std::uint8_t(value))
                            : type == 2 ? raw(std::int16_t(value))
                            : type == 3 ? raw(std::uint16_t(value))
                            : type == 4 ? raw(std::int32_t(value))
                            : type == 5 ? raw(std::uint32_t(value))
                            : type == 6 ? raw(float(value))
                                        : raw(value);
        if (big) std::reverse(bytes.begin(), bytes.end());
        return bytes;
    };
    for (std::size_t type = 0; type < 8; ++type) {
        for (const std::string& word : types[type]) {
            for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
                std::string file = "ply\r\nformat " + std::string(format) +
                                   " 1.0\r\nobj_info x\r\nelement vertex 3\r\nproperty " + word +
                                   " x\r\nproperty list " + word + " " + word + " extra\r\nproperty " + word +
                                   " y\r\nproperty " + word + " z\r\nelement face 1\r\nproperty list " + word +
                                   " " + word + " vertex_index\r\nend_header\r\n";
                for (const double v : {0, 0, 0, 0, 101, 2, 7, 8, 3, 0, 5, 0, 103, 100, 3, 0, 1, 2}) {
                    file += *format == 'a' ? std::to_string(v) + " " : number(type, v, format[7] == 'b');
                }
                const MeshFile mesh = formats::parse_ply(file);
                EXPECT_THAT(mesh.mesh.vertices, ElementsAre(Vec3{0, 0, 0}, Vec3{101, 3, 0}, Vec3{5, 103, 100}))
                    << file;
                EXPECT_THAT(mesh.mesh.triangles, ElementsAre(Triangle{0, 1, 2}));
                EXPECT_THAT(mesh.warnings, IsEmpty());
            }
        }
    }
}

TEST(Ply, SkipsUnknownElementsAndReadsStrips) {
    const MeshFile file = formats::parse_ply(
        "ply\nformat ascii 1.0\ncomment c\nelement camera 1\nproperty float f\nproperty list uchar int "
        "l\nelement empty 999999999999\n"
        "element vertex 5\nproperty float z\nproperty float y\nproperty float x\nelement tristrips 1\n"
        "property list int int vertex_indices\nelement edge 1\nproperty int a\nend_header\n"
        "0.5 2 7 7\n0 0 0\n0 0 1\n0 1 0\n0 1 1\n0 2 2\n10 0 1 2 3 3 4 -1 1 2 4\n3\n");
    EXPECT_EQ(file.mesh.vertices[1], (Vec3{1, 0, 0}));
    EXPECT_THAT(file.mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{2, 1, 3}, Triangle{1, 2, 4}));
}

TEST(Ply, FirstLineMayHaveBlanks) {
    const std::string rest =
        "format ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
        "element face 1\nproperty list uint8 int32 vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for (const char* first : {"ply\n", "ply \n", "ply\r\n", "ply\t\r\n"})
        EXPECT_EQ(formats::parse_mesh(first + rest, "").mesh.triangles.size(), 1u) << first;
}

TEST(Ply, SaysWhatIsWrong) {
    const std::string vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
    const std::string ascii = "ply\nformat ascii 1.0\n";
    EXPECT_THAT(error_of([&] { formats::parse_ply(ascii + vertices); }), HasSubstr("no end"));
    EXPECT_THAT(error_of([&] { formats::parse_ply(ascii + vertices + "end_header\n0 0 0 1 0 0 0 1 0\n"); }),
                HasSubstr("points"));
    EXPECT_THAT(error_of([&] { formats::parse_ply("ply\n" + vertices + faces + "end_header\n"); }),
                HasSubstr("format"));
    EXPECT_THAT(
        error_of([&] { formats::parse_ply("ply\nformat text 1\n" + vertices + faces + "end_header\n"); }),
        HasSubstr("format"));
    EXPECT_THAT(error_of([&] { formats::parse_ply(ascii + "element vertex 1\nproperty quad x\n"); }),
                HasSubstr("line 4: unknown type"));
    EXPECT_THAT(error_of([&] { formats::parse_ply(ascii + "property float x\n"); }), HasSubstr("before"));
    EXPECT_THAT(error_of([&] { formats::parse_ply(ascii + "element vertex\n"); }), HasSubstr("missing"));
    EXPECT_THAT(
        error_of([&] {
            formats::parse_ply(ascii + "element vertex 1\nproperty float x\n" + faces + "end_header\n1\n");
        }),
        HasSubstr("no x, y and z"));
    EXPECT_THAT(error_of([&] {
                    formats::parse_ply(ascii + vertices +
                                       "element face 1\nproperty int a\nend_header\n0 0 0 1 0 0 0 1 0 1");
                }),
                HasSubstr("vertex_indices"));
    EXPECT_THAT(error_of([&] { formats::parse_ply(ascii + vertices + faces + "end_header\n0 0 0 1 x 0"); }),
                HasSubstr("line 10: a number"));
    EXPECT_THAT(error_of([&] {
                    formats::parse_ply(ascii + vertices + faces + "end_header\n0 0 0 1 0 0 0 1 0 -3 0 1 2");
                }),
                HasSubstr("length -3"));
    EXPECT_THAT(error_of([&] { formats::parse_ply(ascii + vertices + faces + "end_header\n0 0 0 1 0"); }),
                HasSubstr("no faces"));
}

TEST(Off, TakesEveryHeaderAndComments) {
    const std::string body = "0 0 0\n1 0 0 # c\n\n1 1 0\n# c\n0 1 0\n4 0 1 2 3\n";
    for (const char* header : {"OFF\n4 1 0\n", "OFF 4 1 0\n", "OFF4 1 0\n", "# c\nOFF # c\n4 1\n", "4 1 4\n",
                               "OFF\r\n4 1 0\r\n", "OFF\n\n4\n1\n", "off\n4 1 0\n", "NOff 4 1 0\n"}) {
        const MeshFile file = formats::parse_off(header + body);
        EXPECT_EQ(file.mesh.triangles.size(), 2u) << header;
        EXPECT_THAT(file.warnings, IsEmpty());
    }
}

TEST(Off, SkipsColoursNormalsAndTextureCoordinates) {
    const MeshFile file = formats::parse_off(
        "STCNOFF\n3 2 0\n0 0 0 0 0 1 255 0 0 255 0.5 0.5\n1 0 0 0 0 1 255 0 0 255 0 0\n0 1 0 0 0 1 1 1 1 1 1 "
        "1\n"
        "3 0 1 2 255 0 0\n3 2 1 0 0.5 0.5 0.5 1 # c\n");
    EXPECT_THAT(file.mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{2, 1, 0}));
    EXPECT_EQ(file.mesh.vertices[1], (Vec3{1, 0, 0}));
}

TEST(Off, SaysWhatIsWrong) {
    EXPECT_THAT(error_of([] { formats::parse_off("nOFF\n5\n1 1 1\n"); }), HasSubstr("line 2: vertices of 5"));
    EXPECT_THAT(error_of([] { formats::parse_off("OFF BINARY\n\0"); }), HasSubstr("binary"));
    EXPECT_THAT(error_of([] { formats::parse_off("OFF\nx\n"); }), HasSubstr("line 2"));
    EXPECT_THAT(error_of([] { formats::parse_off("OFF\n3 1 0\n0 0 0\n1 x 0\n"); }), HasSubstr("line 4"));
    EXPECT_THAT(error_of([] { formats::parse_off("OFF\n5000000000 1 0\n0 0 0\n"); }), HasSubstr("4294967294"));
    const MeshFile cut = formats::parse_off("OFF\n3 9 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1");
    EXPECT_THAT(cut.warnings, ElementsAre(HasSubstr("9 faces, the file has 1")));
}

const char* const gltf_nodes =
    R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[%N],"meshes":[{"primitives":[%P]}],)"
    R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
    R"({"bufferView":1,"componentType":%T,"count":%C,"type":"SCALAR"}],)"
    R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":%L}],"buffers":[{"byteLength":%B}]})";

/// Four points of a tetrahedron, some indices, one mesh.
std::string gltf_file(const std::string& nodes, const std::string& primitives, const std::string& indices,
                      std::size_t size, std::size_t claimed_bytes = 0) {
    std::string json = gltf_nodes;
    const auto put = [&](const std::string& mark, const std::string& text) {
        json.replace(json.find(mark), 2, text);
    };
    put("%N", nodes);
    put("%P", primitives);
    put("%T", size == 1 ? "5121" : size == 2 ? "5123" : "5125");
    put("%C", std::to_string(indices.size() / size));
    put("%L", std::to_string(claimed_bytes != 0 ? claimed_bytes : indices.size()));
    const std::string data = raw(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}) + indices;
    put("%B", std::to_string(data.size()));
    return samples::glb(json, data);
}

const std::string plain = R"({"attributes":{"POSITION":0},"indices":1})";

TEST(Gltf, ReadsIndicesOfAllSizes) {
    const auto expected = ElementsAre(Triangle{0, 2, 1}, Triangle{1, 2, 3});
    EXPECT_THAT(formats::parse_gltf(
                    gltf_file(R"({"mesh":0})", plain, raw(std::vector<std::uint8_t>{0, 2, 1, 1, 2, 3}), 1))
                    .mesh.triangles,
                expected);
    EXPECT_THAT(formats::parse_gltf(
                    gltf_file(R"({"mesh":0})", plain, raw(std::vector<std::uint16_t>{0, 2, 1, 1, 2, 3}), 2))
                    .mesh.triangles,
                expected);
    EXPECT_THAT(formats::parse_gltf(
                    gltf_file(R"({"mesh":0})", plain, raw(std::vector<std::uint32_t>{0, 2, 1, 1, 2, 3}), 4))
                    .mesh.triangles,
                expected);
}

TEST(Gltf, ReadsStripsFansAndUnindexedTriangles) {
    const std::string indices = raw(std::vector<std::uint8_t>{0, 1, 2, 3});
    const auto read = [&](const std::string& primitive) {
        return formats::parse_gltf(gltf_file(R"({"mesh":0})", primitive, indices, 1)).mesh.triangles;
    };
    EXPECT_THAT(read(R"({"attributes":{"POSITION":0},"indices":1,"mode":5})"),
                ElementsAre(Triangle{0, 1, 2}, Triangle{2, 1, 3}));
    EXPECT_THAT(read(R"({"attributes":{"POSITION":0},"indices":1,"mode":6})"),
                ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
    EXPECT_THAT(read(R"({"attributes":{"POSITION":0}},{"attributes":{"POSITION":0},"mode":1})"),
                ElementsAre(Triangle{0, 1, 2}));
}

TEST(Gltf, ReadsSparseAccessors) {
    const std::string data = raw(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}) + raw(std::uint16_t{2}) +
                             raw(std::uint16_t{0}) + raw(std::vector<float>{5, 6, 7});
    const auto model = [&](const std::string& base, const std::string& changes) {
        return samples::glb(
            R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
            R"("accessors":[{)" +
                base + R"("componentType":5126,"count":3,"type":"VEC3","sparse":{)" + changes +
                R"(}}],"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":2},)"
                R"({"buffer":0,"byteOffset":40,"byteLength":12}],"buffers":[{"byteLength":52}]})",
            data);
    };
    const std::string one =
        R"("count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":2})";
    EXPECT_THAT(formats::parse_gltf(model(R"("bufferView":0,)", one)).mesh.vertices,
                ElementsAre(Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{5, 6, 7}));
    EXPECT_THAT(formats::parse_gltf(model("", one)).mesh.vertices,
                ElementsAre(Vec3{0, 0, 0}, Vec3{0, 0, 0}, Vec3{5, 6, 7}))
        << "without a base, zeros";
    const std::string two =
        R"("count":2,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":2})";
    EXPECT_THAT(error_of([&] { formats::parse_gltf(model("", two)); }), HasSubstr("outside of its buffer"));
    const std::string wrong =
        R"("count":1,"indices":{"bufferView":2,"componentType":5125},"values":{"bufferView":2})";
    EXPECT_THAT(error_of([&] { formats::parse_gltf(model("", wrong)); }),
                HasSubstr("sparse index out of range"));
}

TEST(Gltf, JsonMayNotHaveMillionsOfObjects) {
    std::string nodes = R"({"asset":{"version":"2.0"},"nodes":[{})";
    for (int i = 0; i < 1500000; ++i) nodes += ",{}";
    EXPECT_THAT(error_of([&] { formats::parse_gltf(nodes + "]}"); }), HasSubstr("out of all proportion"));
}

TEST(Gltf, AppliesTheTransformsOfNodes) {
    const std::string nodes =
        R"({"children":[1,2],"scale":[2,2,2]},)"
        R"({"mesh":0,"translation":[10,0,0],"rotation":[0,0,0.7071067811865476,0.7071067811865476]},)"
        R"({"mesh":0,"matrix":[-1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1]})";
    const Mesh mesh =
        formats::parse_gltf(gltf_file(nodes, plain, raw(std::vector<std::uint8_t>{0, 2, 1}), 1)).mesh;
    ASSERT_EQ(mesh.vertices.size(), 8u);
    EXPECT_NEAR(norm(mesh.vertices[1] - Vec3{20, 2, 0}), 0, 1e-12)
        << "x turns to y, then shifted, then doubled";
    EXPECT_NEAR(norm(mesh.vertices[2] - Vec3{18, 0, 0}), 0, 1e-12);
    EXPECT_EQ(mesh.vertices[5], (Vec3{-2, 0, 10}));
    EXPECT_THAT(mesh.triangles, ElementsAre(Triangle{0, 2, 1}, Triangle{6, 4, 5}))
        << "a mirror turns triangles over";
}

TEST(Gltf, RefusesWhatLiesOutside) {
    const std::string node = R"({"mesh":0})", few = raw(std::vector<std::uint8_t>{0, 2, 1});
    EXPECT_THAT(error_of([&] { formats::parse_gltf(gltf_file(node, plain, few, 1, 4)); }),
                HasSubstr("outside of its buffer"));
    EXPECT_THAT(error_of([&] { formats::parse_gltf(gltf_file(node, plain, few, 1, 2)); }),
                HasSubstr("outside of its buffer"));
    EXPECT_THAT(error_of([&] {
                    formats::parse_gltf(gltf_file(node, plain, raw(std::vector<std::uint8_t>{0, 2, 9}), 1));
                }),
                HasSubstr("out of range"));
    EXPECT_THAT(error_of([&] { formats::parse_gltf(gltf_file(R"({"mesh":7})", plain, few, 1)); }),
                HasSubstr("does not exist"));
    EXPECT_THAT(error_of([&] { formats::parse_gltf(gltf_file(R"({"children":[0]})", plain, few, 1)); }),
                HasSubstr("two parents"));
    EXPECT_THAT(
        error_of([&] {
            formats::parse_gltf(gltf_file(R"({"children":[1]},{"mesh":0,"children":[0]})", plain, few, 1));
        }),
        HasSubstr("two parents"));
    EXPECT_THAT(
        error_of([&] { formats::parse_gltf(gltf_file(node, R"({"attributes":{"POSITION":5}})", few, 1)); }),
        HasSubstr("accessor 5"));
    EXPECT_THAT(
        error_of([&] { formats::parse_gltf(gltf_file(node, R"({"attributes":{"POSITION":1}})", few, 1)); }),
        HasSubstr("wrong type"));
    EXPECT_THAT(error_of([&] { formats::parse_gltf(std::string(200000, '{')); }), HasSubstr("nested"));
    EXPECT_THAT(error_of([&] {
                    formats::parse_gltf(R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_geometry"]})");
                }),
                HasSubstr("KHR_geometry"));
}

TEST(Gltf, LoadsBuffersOnlyFromItsOwnFolder) {
    const samples::TemporaryFolder folder;
    const std::string data = raw(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
    const auto model = [](const std::string& uri) {
        return R"({"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],)"
               R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"images":[{"uri":"no.png"}],)"
               R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":")" +
               uri + R"("}]})";
    };
    samples::write_file(folder / "data.bin", data);
    std::filesystem::create_directory(folder / "inner");
    samples::write_file(folder / "m.gltf", model("data.bin"));
    samples::write_file(folder / "inner/m.gltf", model("../data.bin"));
    samples::write_file(folder / "absolute.gltf", model((folder / "data.bin").string()));
    samples::write_file(folder / "missing.gltf", model("none.bin"));
    EXPECT_EQ(read_mesh(folder / "m.gltf").mesh.triangles.size(), 1u);
    EXPECT_THAT(error_of([&] { read_mesh(folder / "inner/m.gltf"); }), HasSubstr("not at or below the folder"));
    EXPECT_THAT(error_of([&] { read_mesh(folder / "absolute.gltf"); }),
                HasSubstr("not at or below the folder"));
    EXPECT_THAT(error_of([&] { read_mesh(folder / "missing.gltf"); }), HasSubstr("none.bin"));
}

const std::string tetrahedron_object =
    R"(<object id="1" type="model"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>)"
    R"(<vertex x="0" y="2" z="0"/><vertex x="0" y="0" z="3"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/>)"
    R"(<triangle v1="0" v2="1" v3="3"/><triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3"/></triangles></mesh></object>)";

TEST(ThreeMf, AppliesTransformsOfItemsAndComponents) {
    // A row vector times the matrix: x becomes y, y becomes −x (a quarter turn), then the shift.
    const std::string file = samples::threemf(
        tetrahedron_object +
            R"(<object id="2" type="model"><components><component objectid="1" transform="0 1 0 -1 0 0 0 0 1 5 0 0"/>)"
            R"(<component objectid="1"/></components></object>)",
        R"(<item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 7"/><item objectid="1"/>)");
    const MeshFile read = formats::parse_3mf(file);
    EXPECT_EQ(read.format, "3mf");
    ASSERT_EQ(read.mesh.vertices.size(), 12u);
    ASSERT_EQ(read.mesh.triangles.size(), 12u);
    EXPECT_EQ(read.mesh.vertices[1], (Vec3{5, 1, 7}));
    EXPECT_EQ(read.mesh.vertices[2], (Vec3{3, 0, 7}));
    EXPECT_EQ(read.mesh.vertices[6], (Vec3{0, 2, 7}));
    EXPECT_EQ(read.mesh.vertices[10], (Vec3{0, 2, 0}));
    EXPECT_EQ(inspect(read.mesh).signed_volume, 3);
}

TEST(ThreeMf, AMirrorTurnsTrianglesOver) {
    const MeshFile read = formats::parse_3mf(
        samples::threemf(tetrahedron_object, R"(<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>)"));
    EXPECT_EQ(inspect(read.mesh).signed_volume, 1);
}

TEST(ThreeMf, RepeatedPartsMayNotGrowWithoutBound) {
    std::string objects = tetrahedron_object;
    for (int i = 2; i <= 40; ++i) {  // each is two of the one before: 2³⁹ tetrahedra
        const std::string one = fmt::format("<component objectid=\"{}\"/>", i - 1);
        objects +=
            fmt::format("<object id=\"{}\" type=\"model\"><components>{}{}</components></object>", i, one, one);
    }
    EXPECT_THAT(error_of([&] { formats::parse_3mf(samples::threemf(objects, R"(<item objectid="40"/>)")); }),
                HasSubstr("repeated parts"));
}

/// The same archive with another model.
std::string threemf_xml(const std::string& xml) {
    return samples::zip({{"3D/3dmodel.model", xml}});
}

TEST(ThreeMf, TakesXmlInAllItsForms) {
    const MeshFile read = formats::parse_3mf(threemf_xml(
        "<?xml version='1.0'?>\n<!-- <object id='9'> --><m:model xmlns:m='x'><m:resources>\n<m:object\n id = "
        "'1'\tname=\"a>b\">"
        "<m:mesh ><m:vertices><m:vertex z='3' y=\" 2\" x='+1e0' /><m:vertex x='1' y='0' z='0'></m:vertex>"
        "<m:vertex x='0' y='1' z='0'/></m:vertices><![CDATA[<vertex x='7'/>]]><m:triangles>"
        "<m:triangle v1='0' v2='1' v3='2' pid='5'/></m:triangles></m:mesh></m:object></m:resources>"
        "<m:build><m:item objectid='1'/></m:build></m:model>"));
    EXPECT_THAT(read.warnings, IsEmpty());
    EXPECT_THAT(read.mesh.vertices, ElementsAre(Vec3{1, 2, 3}, Vec3{1, 0, 0}, Vec3{0, 1, 0}));
    EXPECT_THAT(read.mesh.triangles, ElementsAre(Triangle{0, 1, 2}));
}

TEST(ThreeMf, ReadsObjectsOfOtherParts) {
    const std::string root =
        "<model><resources/><build><item objectid=\"1\" p:path=\"/3D/Objects/Other.model\"/></build></model>";
    const std::string other =
        "<model><resources>" + tetrahedron_object + "</resources><build><item objectid=\"1\"/></build></model>";
    const auto file = [&](const std::string& name) {
        return samples::zip({{"3D/3dmodel.model", root}, {name, other}, {"Metadata/thumbnail.png", "\x89PNG"}});
    };
    EXPECT_EQ(formats::parse_3mf(file("3D/Objects/other.model")).mesh.triangles.size(), 4u)
        << "and builds of others do not count";
    EXPECT_THAT(error_of([&] { formats::parse_3mf(file("3D/another.model")); }),
                HasSubstr("object 1, which is not in it"));
}

TEST(ThreeMf, OnlyVerticesOfMeshesCount) {
    const std::string slices =
        "<s:slicestack id=\"2\"><s:slice><s:vertices><s:vertex x=\"1\" "
        "y=\"1\"/></s:vertices></s:slice></s:slicestack>";
    const MeshFile read =
        formats::parse_3mf(samples::threemf(slices + tetrahedron_object, R"(<item objectid="1"/>)"));
    EXPECT_EQ(read.mesh.vertices.size(), 4u);
}

TEST(ThreeMf, BadNumbersSpoilTheirFaces) {
    const auto read = [](const std::string& x, const std::string& v) {
        return formats::parse_3mf(
            threemf_xml("<model><object id=\"1\"><mesh><vertex x=\"" + x +
                        "\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/>"
                        "<vertex x=\"0\" y=\"1\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"1\"/><triangle v1=\"0\" "
                        "v2=\"1\" v3=\"2\"/><triangle v1=\"1\" v2=\"2\" v3=\"" +
                        v +
                        "\"/>"
                        "<triangle v1=\"1\" v2=\"2\" v3=\"3\"/></mesh></object><build><item "
                        "objectid=\"1\"/></build></model>"));
    };
    EXPECT_EQ(read("nan", "3").mesh.triangles.size(), 2u);
    EXPECT_EQ(read("", "3").mesh.triangles.size(), 2u);
    for (const char* index : {"4", "-1", "4294967295", "99999999999999999999", "x"}) {
        const MeshFile file = read("0", index);
        EXPECT_EQ(file.mesh.triangles.size(), 2u) << index;
        EXPECT_EQ(file.warnings.size(), 1u);
    }
}

TEST(ThreeMf, EntitiesAndUtf16AreRefused) {
    EXPECT_THAT(error_of([] { formats::parse_3mf(threemf_xml("<!DOCTYPE a [<!ENTITY b \"c\">]><model/>")); }),
                HasSubstr("document type"));
    EXPECT_THAT(error_of([] { formats::parse_3mf(threemf_xml("\xff\xfe<model/>")); }), HasSubstr("UTF-16"));
    EXPECT_THAT(error_of([] { formats::parse_3mf(threemf_xml("<model><object")); }), HasSubstr("cut"));
    EXPECT_THAT(error_of([] {
                    formats::parse_3mf(threemf_xml("<model><object id=\"1\"/><object id=\"1\"/></model>"));
                }),
                HasSubstr("of its own"));
}

TEST(ThreeMf, TagsThatEndTooSoonOrTooLate) {
    // Found by fuzzing: vertices of a mesh whose object has ended.
    const std::string face = "<vertex x=\"0\"/><triangle v1=\"0\" v2=\"1\" v3=\"2\"/>";
    for (const std::string& model :
         {"<object id=\"1\"><mesh></object>" + face, "<object id=\"1\"/><mesh>" + face, "<mesh>" + face,
          "</mesh></object>" + face})
        EXPECT_THAT(error_of([&] { formats::parse_3mf(threemf_xml("<model>" + model + "</model>")); }),
                    HasSubstr("no faces"));
}

TEST(ThreeMf, WhatItIsMadeOfMayNotGoInCircles) {
    EXPECT_THAT(error_of([] {
                    formats::parse_3mf(threemf_xml(
                        "<model><object id=\"1\"><components><component objectid=\"1\"/></components></object>"
                        "<build><item objectid=\"1\"/></build></model>"));
                }),
                HasSubstr("nested"));
}

TEST(ThreeMf, AMillionTagsOfNoUseCostNothing) {
    std::string model = "<model><resources>" + tetrahedron_object;
    for (int i = 0; i < 1000000; ++i) model += "<a b=\"\">";
    for (int i = 10; i < 100000; ++i) model += fmt::format("<object id=\"{}\"/>", i);
    EXPECT_EQ(
        formats::parse_3mf(threemf_xml(model + "</resources><build><item objectid=\"1\"/></build></model>"))
            .mesh.triangles.size(),
        4u);
}

TEST(ThreeMf, RefusesDamage) {
    EXPECT_THAT(error_of([] { formats::parse_3mf("PK\x03\x04 nothing"); }), HasSubstr("cut"));
    EXPECT_THAT(error_of([] { formats::parse_3mf(samples::zip({{"a", "b"}})); }), HasSubstr("not a 3MF file"));
    std::string bomb = samples::threemf(tetrahedron_object, R"(<item objectid="1"/>)");
    const std::size_t entry = bomb.find("PK\1\2");
    bomb.replace(entry + 24, 4, raw(std::uint32_t{4000000000u}));
    EXPECT_THAT(error_of([&] { formats::parse_3mf(bomb); }), HasSubstr("proportion"));
}

}  // namespace
}  // namespace its
