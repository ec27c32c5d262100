// Colours, texture coordinates and normals: what readers make of them, and round trips.
#include "mesh/attributes.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "formats/readers.h"
#include "formats/samples.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

namespace its {
namespace {

using samples::raw;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr ReadOptions with_attributes{.attributes = true};

template <class Value>
std::array<Value, 3> corners(const CornerValues<Value>& of, std::size_t t) {
    return {of.at(t, 0), of.at(t, 1), of.at(t, 2)};
}

const Colour red{1, 0, 0, 1}, green{0, 1, 0, 1}, blue{0, 0, 1, 1}, white{1, 1, 1, 1};

TEST(Attributes, AreReadOnlyWhenAskedFor) {
    const std::string text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nvt 0 0\nf 1/1 2/1 3/1\n";
    EXPECT_TRUE(formats::parse_obj(text).attributes.empty());
    EXPECT_FALSE(formats::parse_obj(text, with_attributes).attributes.empty());
}

TEST(Attributes, ObjHasTablesForCorners) {
    const MeshFile file = formats::parse_obj(
        "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1 0\nvn 0 0 1\n"
        "f 1/1/1 2/2/1 3/3/1\nvt 0 .5\nf 1/1 3/-2/1 4/-1\nf 1//1 2 3/9\n",
        with_attributes);
    const auto& texture = file.attributes.texture;
    EXPECT_THAT(corners(texture, 0), ElementsAre(TexturePoint{0, 0}, TexturePoint{1, 0}, TexturePoint{1, 1}));
    EXPECT_THAT(corners(texture, 1), ElementsAre(TexturePoint{0, 0}, TexturePoint{1, 1}, TexturePoint{0, 0.5}));
    EXPECT_THAT(corners(texture, 2), ElementsAre(TexturePoint{0, 0}, TexturePoint{0, 0}, TexturePoint{0, 0}));
    EXPECT_EQ(file.attributes.normals.at(1, 1), (Vec3{0, 0, 1}));
    EXPECT_EQ(file.attributes.normals.at(1, 0), (Vec3{0, 0, 0}));
    EXPECT_TRUE(file.attributes.colours.empty());
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("materials"), HasSubstr("3 texture coordinates"),
                                           HasSubstr("4 normals")));
}

TEST(Attributes, PolygonsKeepTheirCorners) {
    // An L, not convex, with the texture coordinates of its own corners.
    std::string text;
    const int xs[] = {0, 2, 2, 1, 1, 0}, ys[] = {0, 0, 1, 1, 2, 2};
    for (int i = 0; i < 6; ++i) text += fmt::format("v {} {} 0\nvt {} {}\n", xs[i], ys[i], xs[i], ys[i]);
    const MeshFile file = formats::parse_obj(text + "f 1/1 2/2 3/3 4/4 5/5 6/6\n", with_attributes);
    ASSERT_EQ(file.mesh.triangles.size(), 4u);
    for (std::size_t t = 0; t < 4; ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3& v = file.mesh.vertices[file.mesh.triangles[t][k]];
            EXPECT_EQ(file.attributes.texture.at(t, k), (TexturePoint{v.x, v.y}));
        }
}

TEST(Attributes, ObjColoursInBytesOrFractions) {
    const auto read = [](const char* one) {
        return formats::parse_obj(fmt::format("v 0 0 0 {}\nv 1 0 0 0 0 0\nv 0 1 0 0 1 0\nf 1 2 3\n", one),
                                  with_attributes)
            .attributes;
    };
    EXPECT_EQ(read("1 0 0").colours.at(0, 0), red);
    EXPECT_EQ(read("255 0 0").colours.at(0, 0), red);
    EXPECT_TRUE(read("255 0 0").byte_colours);
    EXPECT_EQ(read("nan 0 0").colours.at(0, 0), white);
    EXPECT_EQ(read("1").colours.at(0, 0), white) << "a weight is no colour";
}

TEST(Attributes, PlyHasThemByVertexOrTextureByCorner) {
    const std::string head =
        "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\n"
        "property float y\nproperty float z\n";
    const MeshFile file = formats::parse_ply(
        head +
            "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\n"
            "property float ny\nproperty float nz\nproperty float s\nproperty float t\n"
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
            "0 0 0 255 0 0 0 0 1 0 .25\n1 0 0 0 255 0 0 0 1 1 .5\n0 1 0 0 0 255 0 0 1 0 1\n3 2 0 1\n",
        with_attributes);
    EXPECT_THAT(corners(file.attributes.colours, 0), ElementsAre(blue, red, green));
    EXPECT_EQ(file.attributes.texture.at(0, 1), (TexturePoint{0, 0.25}));
    EXPECT_EQ(file.attributes.normals.at(0, 2), (Vec3{0, 0, 1}));
    EXPECT_TRUE(file.attributes.byte_colours);
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("textures")));

    const MeshFile wedges = formats::parse_ply(
        head +
            "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
            "end_header\n0 0 0\n1 0 0\n0 1 0\n3 2 0 1 6 0 1 2 3 4 5\n3 0 1 2 4 0 0 0 0\n",
        with_attributes);
    EXPECT_THAT(corners(wedges.attributes.texture, 0),
                ElementsAre(TexturePoint{0, 1}, TexturePoint{2, 3}, TexturePoint{4, 5}));
    EXPECT_THAT(wedges.warnings.back(), HasSubstr("3 texture coordinates"));
}

TEST(Attributes, OffHasThemInTheOrderOfItsHeader) {
    const MeshFile file = formats::parse_off(
        "STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 0 255 0.5 0.25\n1 0 0 0 0 1 0 255 0 255 0 0\n"
        "0 1 0 0 0 1 0 0 255 255 1 1\n3 0 1 2 9 9 9\n",
        with_attributes);
    EXPECT_THAT(corners(file.attributes.colours, 0), ElementsAre(red, green, blue));
    EXPECT_EQ(file.attributes.texture.at(0, 0), (TexturePoint{0.5, 0.25}));
    EXPECT_EQ(file.attributes.normals.at(0, 1), (Vec3{0, 0, 1}));
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("colours of faces")));
}

/// A triangle with normalised byte colours and texture coordinates, in a node that mirrors x.
std::string coloured_glb(int colours, const std::string& type) {
    const std::string data = raw(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}) +
                             raw(std::vector<std::uint8_t>{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255}) +
                             raw(std::vector<std::uint16_t>{0, 0, 65535, 0, 0, 65535}) +
                             raw(std::vector<float>{1, 0, 0, 1, 0, 0, 0, 0, 1});
    return samples::glb(
        R"({"asset":{"version":"2.0"},"materials":[{}],"nodes":[{"mesh":0,"scale":[-1,1,1]}],"meshes":[{"primitives":[)"
        R"({"attributes":{"POSITION":0,"COLOR_0":1,"TEXCOORD_0":2,"NORMAL":3}}]}],"accessors":[)"
        R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)" +
            fmt::format(R"({{"bufferView":1,"componentType":5121,"normalized":true,"count":{},"type":"{}"}},)",
                        colours, type) +
            R"({"bufferView":2,"componentType":5123,"normalized":true,"count":3,"type":"VEC2"},)"
            R"({"bufferView":3,"componentType":5126,"count":3,"type":"VEC3"}],)"
            R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12},)"
            R"({"buffer":0,"byteOffset":48,"byteLength":12},{"buffer":0,"byteOffset":60,"byteLength":36}],)"
            R"("buffers":[{"byteLength":96}]})",
        data);
}

TEST(Attributes, GltfNumbersMayBeNormalised) {
    const MeshFile file = formats::parse_gltf(coloured_glb(3, "VEC4"), {}, with_attributes);
    EXPECT_THAT(file.mesh.triangles, ElementsAre(Triangle{1, 0, 2}));
    EXPECT_THAT(corners(file.attributes.colours, 0), ElementsAre(green, red, blue));
    EXPECT_TRUE(file.attributes.byte_colours);
    EXPECT_THAT(corners(file.attributes.texture, 0),
                ElementsAre(TexturePoint{1, 1}, TexturePoint{0, 1}, TexturePoint{0, 0}))
        << "v points upwards here";
    EXPECT_EQ(file.attributes.normals.at(0, 0), (Vec3{-1, 0, 0})) << "mirrored with the mesh";
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("materials")));
    for (const auto& [count, type] : {std::pair{2, "VEC4"}, {4, "VEC4"}, {3, "VEC2"}, {1000000, "VEC4"}}) {
        EXPECT_THROW(formats::parse_gltf(coloured_glb(count, type), {}, with_attributes), InputError);
        EXPECT_NO_THROW(formats::parse_gltf(coloured_glb(count, type)));
    }
}

/// A box whose faces have colours, texture coordinates and normals of their own.
MeshAttributes box_attributes(const Mesh& box) {
    MeshAttributes a;
    for (std::size_t t = 0; t < box.triangles.size(); ++t) {
        const auto n = std::uint32_t(3 * t);
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3& p = box.vertices[box.triangles[t][k]];
            a.texture.values.push_back({0.25 + p.x / 4 + double(t / 2) / 8, 0.5 + p.y / 4 + p.z / 8});
            a.colours.values.push_back({float(t / 2) / 255, float(k) / 255, 1, float(t) / 255});
            a.normals.values.push_back({t / 2 < 3 ? 1.0 : -1.0, 0, 0});
        }
        for (auto* c : {&a.texture.corners, &a.colours.corners, &a.normals.corners})
            c->push_back({n, n + 1, n + 2});
    }
    return a;
}

TEST(Attributes, RoundTripsKeepEveryValueThatTheFormatHolds) {
    const samples::TemporaryFolder folder;
    const Mesh box = zoo::box({0, 0, 0}, {1, 1, 1});
    for (const bool bytes : {false, true})
        for (const char* name : {"m.ply", "m.obj", "m.off", "m.glb", "m.stl"}) {
            SCOPED_TRACE(name);
            MeshAttributes a = box_attributes(box);
            a.byte_colours = bytes;
            const std::vector<std::string> lost = write_mesh(box, a, folder / name);
            const MeshFile back = read_mesh(folder / name, with_attributes);
            EXPECT_THAT(back.warnings, IsEmpty());
            EXPECT_EQ(lost.size(), std::string(name) == "m.stl" ? 3u : std::string(name) == "m.obj" ? 1u : 0u);
            ASSERT_EQ(back.mesh.triangles.size(), box.triangles.size());
            for (std::size_t t = 0; t < box.triangles.size(); ++t)
                for (std::size_t k = 0; k < 3; ++k)
                    EXPECT_EQ(back.mesh.vertices[back.mesh.triangles[t][k]], box.vertices[box.triangles[t][k]]);
            if (std::string(name) == "m.stl") continue;
            for (std::size_t t = 0; t < box.triangles.size(); ++t) {
                EXPECT_EQ(corners(back.attributes.texture, t), corners(a.texture, t));
                EXPECT_EQ(corners(back.attributes.normals, t), corners(a.normals, t));
                for (std::size_t k = 0; k < 3; ++k) {
                    Colour expected = a.colours.at(t, k);
                    if (std::string(name) == "m.obj") expected[3] = 1;
                    const Colour found = back.attributes.colours.at(t, k);
                    if (std::string(name) == "m.glb" && !bytes) {  // to linear light and back, in 32 bits
                        for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(found[i], expected[i], 1e-6);
                    } else {
                        EXPECT_EQ(found, expected);
                    }
                }
            }
        }
}

TEST(Attributes, ColoursOfGltfAreLinear) {
    const samples::TemporaryFolder folder;
    Mesh mesh = zoo::tetrahedron();
    MeshAttributes a;
    a.byte_colours = true;
    for (std::uint32_t i = 0; i < 256; ++i) {  // every byte
        a.colours.values.push_back({float(i) / 255, float(255 - i) / 255, 128.0F / 255, float(i) / 255});
        a.colours.corners.push_back({i, i, i});
        if (i >= 4) mesh.triangles.push_back(mesh.triangles[i % 4]);
    }
    write_mesh(mesh, a, folder / "m.glb");
    write_mesh(mesh, a, folder / "m.ply");
    const MeshFile glb = read_mesh(folder / "m.glb", with_attributes);
    EXPECT_TRUE(glb.attributes.byte_colours);
    for (std::uint32_t t = 0; t < 256; ++t) EXPECT_EQ(glb.attributes.colours.at(t, 0), a.colours.at(t, 0));
    // And so the PLY made of the GLB has the bytes of the first.
    write_mesh(glb.mesh, glb.attributes, folder / "again.ply");
    const MeshFile ply = read_mesh(folder / "m.ply", with_attributes),
                   again = read_mesh(folder / "again.ply", with_attributes);
    for (std::uint32_t t = 0; t < 256; ++t)
        EXPECT_EQ(again.attributes.colours.at(t, 0), ply.attributes.colours.at(t, 0));
    // sRGB 128 is 0.21586 of the light: 14146.4 of 65,535.
    const std::string bytes = samples::read_file(folder / "m.glb");
    EXPECT_NE(bytes.find(raw(std::uint16_t{0}) + raw(std::uint16_t{65535}) + raw(std::uint16_t{14146}) +
                         raw(std::uint16_t{0})),
              std::string::npos);
    // Others' linear bytes: 55 / 255 is shown as sRGB 0.5018.
    std::string file = coloured_glb(3, "VEC4");
    file.replace(file.find(std::string("\xff\0\0\xff\0\xff", 6)), 1, std::string(1, char(55)));
    const MeshFile others = formats::parse_gltf(file, {}, with_attributes);
    EXPECT_NEAR(others.attributes.colours.at(0, 1)[0], 0.50177, 5e-6);
    EXPECT_TRUE(others.attributes.byte_colours);
}

TEST(Attributes, WithoutThemTheBytesAreTheSame) {
    const samples::TemporaryFolder folder;
    const Mesh knot = zoo::twisted_knot(20, 8);
    for (const char* name : {"m.ply", "m.obj", "m.off", "m.glb", "m.stl"}) {
        write_mesh(knot, folder / name);
        const std::string plain = samples::read_file(folder / name);
        EXPECT_THAT(write_mesh(knot, MeshAttributes{}, folder / name), IsEmpty());
        EXPECT_EQ(samples::read_file(folder / name), plain);
    }
}

TEST(Attributes, ThatDoNotFitAreRefused) {
    const samples::TemporaryFolder folder;
    const Mesh box = zoo::box({0, 0, 0}, {1, 1, 1});
    const auto refused = [&](auto&& spoil) {
        MeshAttributes a = box_attributes(box);
        spoil(a);
        EXPECT_THROW(write_mesh(box, a, folder / "m.ply"), InputError);
        EXPECT_FALSE(std::filesystem::exists(folder / "m.ply"));
    };
    refused([](MeshAttributes& a) { a.colours.corners.pop_back(); });
    refused([](MeshAttributes& a) { a.texture.corners[3][1] = 99; });
    refused([](MeshAttributes& a) { a.normals.values[5].y = NAN; });
    refused([](MeshAttributes& a) { a.texture.values[0][1] = INFINITY; });
}

/// What MeshFile promises.
void expect_usable(const MeshFile& file) {
    check_attributes(file.mesh, file.attributes);
    for (const Triangle& t : file.mesh.triangles)
        for (const std::uint32_t v : t) ASSERT_LT(v, file.mesh.vertices.size());
}

TEST(Attributes, CutAndDamagedFilesAreReadInPartOrRefused) {
    const samples::TemporaryFolder folder;
    const Mesh box = zoo::box({0, 0, 0}, {1, 1, 1});
    std::uint64_t state = 77;
    const auto random = [&] {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        return state >> 33;
    };
    for (const char* extension : {".ply", ".obj", ".off", ".glb"}) {
        const auto path = folder / (std::string("m") + extension);
        write_mesh(box, box_attributes(box), path);
        const std::string bytes = samples::read_file(path);
        const auto read = [&](std::string_view some) {
            try {
                expect_usable(formats::parse_mesh(some, extension, {}, with_attributes));
            } catch (const InputError& error) {
                EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
            }
        };
        for (std::size_t length = 0; length < bytes.size(); ++length)
            read(std::string_view(bytes).substr(0, length));
        for (int round = 0; round < 3000; ++round) {
            std::string damaged = bytes;
            for (std::uint64_t flips = 1 + random() % 4; flips > 0; --flips)
                damaged[random() % damaged.size()] = char(random() % 3 == 0 ? 0xff : random());
            read(damaged);
        }
    }
    for (const auto& seed : samples::seeds())
        expect_usable(
            formats::parse_mesh(samples::read_file(seed), formats::lower_extension(seed), {}, with_attributes));
}

}  // namespace
}  // namespace its
