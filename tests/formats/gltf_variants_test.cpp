// glTF as programs write it: extensions, URIs, instances, compression.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "formats/gltf_data.h"
#include "formats/readers.h"
#include "formats/samples.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/mesh_file.h"

namespace its {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using samples::raw;

std::string error_of(const std::function<void()>& call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

/// The tetrahedron (0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3) of 72 bytes, with more data after it.
const std::string tetrahedron = raw(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3}) +
                                raw(std::vector<std::uint16_t>{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});

struct File {
    std::string node = R"({"mesh":0})", buffer, more_accessors, more_views, top, primitive;
    std::string data = tetrahedron;

    std::string json() const {
        return R"({"asset":{"version":"2.0"},"nodes":[)" + node +
               R"(],"meshes":[{"primitives":[{"attributes":)" + R"({"POSITION":0},"indices":1)" + primitive +
               R"(}]}],"accessors":[)" + R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)" +
               R"({"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"})" + more_accessors +
               R"(],"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24})" +
               more_views + R"(],"buffers":[{"byteLength":)" + std::to_string(data.size()) + buffer + "}]" +
               top + "}";
    }
    MeshFile read(const ReadOptions& options = {}) const {
        return formats::parse_gltf(buffer.empty() ? samples::glb(json(), data) : json(), {}, options);
    }
};

std::string base64(const std::string& bytes) {
    constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += i + k <= bytes.size() + (k < 2 ? 1 : 0) && !(k == 2 && i + 1 >= bytes.size()) &&
                            !(k == 3 && i + 2 >= bytes.size())
                        ? digits[bits >> (18 - 6 * k) & 63]
                        : '=';
    }
    return text;
}

std::string percent(const std::string& bytes) {
    std::string text;
    for (const char c : bytes) text += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    return text;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += by.size())
        text.replace(at, what.size(), by);
    return text;
}

TEST(GltfUris, AnyMediaTypeAndEncoding) {
    const std::string packed = base64(tetrahedron);
    std::string url = replaced(replaced(packed, "+", "-"), "/", "_");
    while (url.ends_with('=')) url.pop_back();
    for (const std::string& uri :
         {"data:application/octet-stream;base64," + packed, "data:application/bin;base64," + packed,
          "data:application/octet-stream;charset=utf-8;base64," + packed, "data:;base64," + packed,
          "DATA:model/x;a=b;BASE64," + packed, "data:;base64," + url,
          "data:;base64," + replaced(replaced(packed, "+", "%2B"), "=", "%3d"),
          "data:application/octet-stream," + percent(tetrahedron), "data:," + percent(tetrahedron)}) {
        File file;
        file.buffer = R"(,"uri":")" + uri + "\"";
        const MeshFile read = file.read();
        EXPECT_EQ(inspect(read.mesh).signed_volume, 1) << uri;
        EXPECT_THAT(read.warnings, IsEmpty());
    }
    for (const std::string& uri :
         {"data:application/octet-stream;base64" + packed, "data:;base64,&&&" + packed,
          "data:;base64," + packed.substr(0, 40), "data:;base64,AAAA" + packed.substr(0, 60),
          "data:" + std::string(100'000, 'x')}) {
        File file;
        file.buffer = R"(,"uri":")" + uri + "\"";
        const std::string error = error_of([&] { file.read(); });
        EXPECT_NE(error, "no error") << uri;
        EXPECT_LT(error.size(), 200u);
    }
}

TEST(GltfUris, NamesOfFilesMayBePercentEncoded) {
    const samples::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "a folder");
    for (const auto& [name, uri] : {std::pair{"a folder/the data.bin", "a%20folder/the%20data.bin"},
                                    {"the data.bin", "the data.bin"},
                                    {"\xc3\xa4.bin", "%C3%A4.bin"},
                                    {"100%.bin", "100%.bin"},
                                    {"50%zz.bin", "50%zz.bin"}}) {
        samples::write_file(folder / name, tetrahedron);
        File file;
        file.buffer = std::string(R"(,"uri":")") + uri + "\"";
        samples::write_file(folder / "m.gltf", file.json());
        EXPECT_EQ(inspect(read_mesh(folder / "m.gltf").mesh).signed_volume, 1) << uri;
    }
    std::filesystem::create_directory(folder / "inner");
    samples::write_file(folder / "data.bin", tetrahedron);
    for (const char* uri :
         {"%2e%2e/data.bin", "..%2fdata.bin", "%2Ftmp/data.bin", "a%00b", "x/../../data.bin", ""}) {
        File file;
        file.buffer = std::string(R"(,"uri":")") + uri + "\"";
        samples::write_file(folder / "inner" / "m.gltf", file.json());
        EXPECT_THAT(error_of([&] { read_mesh(folder / "inner" / "m.gltf"); }),
                    HasSubstr("not at or below the folder"))
            << uri;
    }
    File file;
    file.buffer = R"(,"uri":")" + std::string(5000, 'n') + "\"";
    samples::write_file(folder / "m.gltf", file.json());
    EXPECT_LT(error_of([&] { read_mesh(folder / "m.gltf"); }).size(), 300u);
}

TEST(GltfExtensions, RequiredOnesMustBeKnown) {
    const auto read = [](const std::string& name, bool required) {
        File file;
        file.top = fmt::format(R"(,"extensionsUsed":["{0}"])", name);
        if (required) file.top += fmt::format(R"(,"extensionsRequired":["{0}"])", name);
        return file.read().mesh.triangles.size();
    };
    for (const char* known :
         {"KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "KHR_materials_unlit", "KHR_texture_transform",
          "KHR_texture_basisu", "EXT_texture_webp", "KHR_lights_punctual"})
        EXPECT_EQ(read(known, true), 4u) << known;
    for (const std::string& unknown : {std::string("XYZ_geometry"), std::string("KHR_node_visibility"),
                                       std::string("MSFT_lod"), std::string(5000, 'x')}) {
        EXPECT_EQ(read(unknown, false), 4u);
        const std::string error = error_of([&, name = unknown] { read(name, true); });
        EXPECT_THAT(error, HasSubstr(unknown.substr(0, 40)));
        EXPECT_LT(error.size(), 180u);
    }
}

/// Instances: accessors 2, 3 and 4 are translations, rotations and scales, as far as `json` names them.
MeshFile instanced(const std::string& json, const std::string& accessors, const std::string& data,
                   bool required, const std::string& transform = "") {
    File file;
    file.node = R"({"mesh":0)" + transform + R"(,"extensions":{"EXT_mesh_gpu_instancing":)" + json + "}}";
    file.data += data;
    file.more_views = fmt::format(R"(,{{"buffer":0,"byteOffset":72,"byteLength":{}}})", data.size());
    file.more_accessors = accessors;
    file.top = R"(,"extensionsUsed":["EXT_mesh_gpu_instancing"])";
    if (required) file.top += R"(,"extensionsRequired":["EXT_mesh_gpu_instancing"])";
    return file.read();
}

TEST(GltfInstancing, TranslationsRotationsAndScales) {
    const float half = float(std::sqrt(0.5));
    const std::string places = raw(std::vector<float>{0, 0, 0, 10, 0, 0}),
                      turns = raw(std::vector<float>{0, 0, 0, 1, 0, 0, half, half}),
                      sizes = raw(std::vector<float>{1, 1, 1, 2, 2, -2});
    const std::string accessors =
        R"(,{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"})"
        R"(,{"bufferView":2,"byteOffset":24,"componentType":5126,"count":2,"type":"VEC4"})"
        R"(,{"bufferView":2,"byteOffset":56,"componentType":5126,"count":2,"type":"VEC3"})";
    for (const bool required : {false, true}) {
        const MeshFile file =
            instanced(R"({"attributes":{"TRANSLATION":2,"ROTATION":3,"SCALE":4,"_ID":9}})", accessors,
                      places + turns + sizes, required, R"(,"translation":[0,0,100])");
        EXPECT_THAT(file.warnings, IsEmpty());
        ASSERT_EQ(file.mesh.vertices.size(), 8u);
        EXPECT_EQ(file.mesh.vertices[3], (Vec3{0, 0, 103}));
        EXPECT_NEAR(norm(file.mesh.vertices[5] - Vec3{10, 2, 100}), 0, 1e-6) << "x turns to y, twice as long";
        EXPECT_NEAR(norm(file.mesh.vertices[6] - Vec3{6, 0, 100}), 0, 1e-6);
        EXPECT_NEAR(norm(file.mesh.vertices[7] - Vec3{10, 0, 94}), 0, 1e-6);
        EXPECT_NEAR(inspect(file.mesh).signed_volume, 9, 1e-5) << "a mirrored instance is turned over";
    }
}

TEST(GltfInstancing, RotationsMayBeQuantised) {
    const std::string bytes = raw(std::vector<std::int8_t>{0, 0, 90, 90}),
                      shorts = raw(std::vector<std::int16_t>{0, 0, 23170, 23170});
    for (const auto& [data, type] : {std::pair{bytes, 5120}, {shorts, 5122}}) {
        const MeshFile file = instanced(
            R"({"attributes":{"ROTATION":2}})",
            fmt::format(R"(,{{"bufferView":2,"componentType":{},"normalized":true,"count":1,"type":"VEC4"}})",
                        type),
            data, true);
        EXPECT_NEAR(norm(file.mesh.vertices[1] - Vec3{0, 1, 0}), 0, 1e-12) << type;
        EXPECT_NEAR(norm(file.mesh.vertices[2] - Vec3{-2, 0, 0}), 0, 1e-12) << type;
    }
}

TEST(GltfInstancing, MalformedIsAnErrorOnlyWhereRequired) {
    const std::string places = raw(std::vector<float>{0, 0, 0, 10, 0, 0});
    const std::string two = R"(,{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"})";
    const std::string one = two + R"(,{"bufferView":2,"componentType":5126,"count":1,"type":"VEC3"})";
    const std::string zero =
        R"(,{"bufferView":2,"componentType":5120,"normalized":true,"count":1,"type":"VEC4"})";
    for (const auto& [json, accessors] :
         {std::pair{std::string(R"({"attributes":{"TRANSLATION":7}})"), two},
          {R"({"attributes":{"TRANSLATION":"x"}})", two},
          {R"({"attributes":[]})", two},
          {R"({})", two},
          {R"([1])", two},
          {R"({"attributes":{"ROTATION":2}})", two},
          {R"({"attributes":{"ROTATION":2}})", zero},
          {R"({"attributes":{"TRANSLATION":2,"SCALE":3}})", one},
          {R"({"attributes":{"TRANSLATION":2}})", replaced(two, "\"count\":2", "\"count\":3")}}) {
        const MeshFile file = instanced(json, accessors, places, false);
        EXPECT_EQ(file.mesh.triangles.size(), 4u) << json;
        EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("EXT_mesh_gpu_instancing"))) << json;
        EXPECT_THAT(error_of([&, j = json, a = accessors] { instanced(j, a, places, true); }),
                    HasSubstr("EXT_mesh_gpu_instancing"))
            << json;
    }
}

TEST(GltfInstancing, MayNotMultiplyWithoutBound) {
    // Zeros without data: as many instances as one likes.
    EXPECT_THAT(error_of([] {
                    instanced(
                        R"({"attributes":{"TRANSLATION":2}})",
                        R"(,{"componentType":5126,"count":5000000,"type":"VEC3","sparse":{"count":1,"indices":)"
                        R"({"bufferView":2,"componentType":5121},"values":{"bufferView":2}}})",
                        std::string(12, '\0'), true);
                }),
                HasSubstr("repeated parts"));
}

TEST(GltfQuantization, PositionsOfBytesAndShorts) {
    File file;
    file.data = raw(std::vector<std::uint16_t>{0, 0, 0, 0, 65535, 0, 0, 0, 0, 65535, 0, 0, 0, 0, 65535, 0}) +
                std::string(16, '\0') + tetrahedron.substr(48);
    file.node = R"({"mesh":0,"scale":[1,2,3]})";
    std::string json = replaced(file.json(), R"("bufferView":0,"componentType":5126)",
                                R"("bufferView":0,"componentType":5123,"normalized":true)");
    json = replaced(json, R"({"buffer":0,"byteLength":48})", R"({"buffer":0,"byteLength":32,"byteStride":8})");
    EXPECT_EQ(inspect(formats::parse_gltf(samples::glb(json, file.data)).mesh).signed_volume, 1);
}

std::filesystem::path data(const std::string& name) {
    return std::filesystem::path(ITS_SOURCE_DIR) / "tests" / "data" / name;
}

/// Two spheres of two primitives, written by glTF-Transform 4.
void expect_spheres(const MeshFile& file, double error, const std::string& what) {
    const MeshReport report = inspect(file.mesh);
    EXPECT_EQ(report.triangles, 160u) << what;
    EXPECT_TRUE(report.closed) << what;
    EXPECT_EQ(report.components, 2u) << what;
    EXPECT_NEAR(report.signed_volume, 7.03722, 5 * error) << what;
    EXPECT_NEAR(norm(report.bounds.min - Vec3{-1, -1, 9}), 0, error) << what;
    EXPECT_NEAR(norm(report.bounds.max - Vec3{4, 1, 11}), 0, error) << what;
    EXPECT_THAT(file.warnings, IsEmpty()) << what;
}

TEST(GltfCompression, DracoAndMeshoptAreUnpackedOrNamed) {
    struct Case {
        const char *name, *extension;
        bool readable;
    };
    for (const auto& [name, extension, readable] :
         {Case{"draco_edgebreaker.glb", "KHR_draco_mesh_compression", formats::gltf::can_decode_draco()},
          Case{"draco_sequential.glb", "KHR_draco_mesh_compression", formats::gltf::can_decode_draco()},
          Case{"meshopt_quantize.glb", "EXT_meshopt_compression", formats::gltf::can_decode_meshopt()},
          Case{"meshopt_high.glb", "EXT_meshopt_compression", formats::gltf::can_decode_meshopt()}}) {
        if (!readable) {
            EXPECT_THAT(error_of([file = name] { read_mesh(data(file)); }), HasSubstr(extension));
            continue;
        }
        expect_spheres(read_mesh(data(name)), 1e-3, name);
        const MeshFile coloured = read_mesh(data(name), {.attributes = true});
        expect_spheres(coloured, 1e-3, name);
        ASSERT_FALSE(coloured.attributes.colours.empty()) << name;
        double sum = 0;  // 0 to 255 in every channel
        for (const Colour& c : coloured.attributes.colours.values) sum += c[0];
        EXPECT_NEAR(sum / double(coloured.attributes.colours.values.size()), 0.65, 0.1) << name;
    }
}

TEST(GltfCompression, NewerMeshoptDataAreRefusedByName) {
    if (!formats::gltf::can_decode_meshopt()) GTEST_SKIP() << "built without meshoptimizer";
    std::string khr = replaced(samples::read_file(data("meshopt_quantize.glb")), "EXT_meshopt", "KHR_meshopt");
    expect_spheres(formats::parse_gltf(khr), 1e-3, "KHR");
    const std::size_t vertices = khr.find('\xa0', khr.find(std::string("BIN\0", 4)));
    khr[vertices] = char(0xa7);  // of a version that nobody has yet
    EXPECT_THAT(error_of([&] { formats::parse_gltf(khr); }), HasSubstr("KHR_meshopt_compression"));
    for (const auto& [from, to] : {std::pair{R"("mode":"TRIANGLES")", R"("mode":"TRIANGLEZ")"},
                                   {R"("mode":"TRIANGLES")", R"("mode":"ATTRIBUTE")"}}) {
        const std::string text = replaced(samples::read_file(data("meshopt_quantize.glb")), from, to);
        EXPECT_THAT(error_of([&] { formats::parse_gltf(text); }), HasSubstr("EXT_meshopt_compression"));
    }
}

TEST(GltfCompression, CutAndDamagedDataNeverCrash) {
    for (const char* name :
         {"draco_edgebreaker.glb", "draco_sequential.glb", "meshopt_quantize.glb", "meshopt_high.glb"}) {
        const std::string whole = samples::read_file(data(name));
        const std::size_t begin = whole.find(std::string("BIN\0", 4)) + 4;
        std::uint32_t state = 7;
        for (int i = 0; i < 400; ++i) {
            std::string bytes = whole;
            for (int k = 0; k < 1 + i % 3; ++k) {
                state = state * 1664525u + 1013904223u;
                bytes[begin + (state >> 8) % (whole.size() - begin)] = char(state >> 3);
            }
            error_of([&] { formats::parse_gltf(bytes, {}, {.attributes = true}); });
        }
    }
}

}  // namespace
}  // namespace its
