// Files as a whole: round trips, real meshes, and files that are cut, damaged or lie.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdlib>
#include <map>
#include <sstream>

#include "formats/readers.h"
#include "formats/samples.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

namespace its {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// What MeshFile promises.
void expect_usable(const MeshFile& file) {
    ASSERT_FALSE(file.mesh.triangles.empty());
    for (const Vec3& v : file.mesh.vertices) ASSERT_TRUE(finite(v));
    for (const Triangle& t : file.mesh.triangles) {
        for (const std::uint32_t v : t) ASSERT_LT(v, file.mesh.vertices.size());
    }
}

TEST(Files, RoundTripsKeepEveryBitButInStl) {
    const samples::TemporaryFolder folder;
    for (const zoo::Entry& entry : zoo::all()) {
        for (const char* name : {"m.obj", "m.ply", "m.off", "m.PLY"}) {
            write_mesh(entry.mesh, folder / name);
            const MeshFile back = read_mesh(folder / name);
            EXPECT_EQ(back.mesh.vertices, entry.mesh.vertices) << entry.name << name;
            EXPECT_EQ(back.mesh.triangles, entry.mesh.triangles) << entry.name << name;
            EXPECT_THAT(back.warnings, IsEmpty()) << entry.name << name;
        }
        write_mesh(entry.mesh, folder / "m.stl");
        const MeshFile back = read_mesh(folder / "m.stl");
        EXPECT_EQ(back.format, "stl-binary");
        ASSERT_EQ(back.mesh.triangles.size(), entry.mesh.triangles.size());
        for (std::size_t i = 0; i < back.mesh.triangles.size(); ++i) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3 a = entry.mesh.vertices[entry.mesh.triangles[i][k]],
                           b = back.mesh.vertices[back.mesh.triangles[i][k]];
                for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(float(a[axis]), float(b[axis])) << entry.name;
            }
        }
    }
}

std::string text_of(const std::vector<std::byte>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(Files, InMemoryTheyHaveTheSameBytes) {
    const samples::TemporaryFolder folder;
    for (const zoo::Entry& entry : zoo::all())
        for (const std::string extension : {".obj", ".ply", ".off", ".stl", ".glb", ".PLY"}) {
            const auto path = folder / ("mesh" + extension);
            write_mesh(entry.mesh, path);
            const EncodedMesh encoded = encode_mesh(entry.mesh, extension);
            EXPECT_EQ(text_of(encoded.bytes), samples::read_file(path)) << entry.name << extension;
            EXPECT_THAT(encoded.warnings, IsEmpty());
            const MeshFile from_file = read_mesh(path), from_memory = decode_mesh(encoded.bytes, extension);
            EXPECT_EQ(from_memory.mesh.vertices, from_file.mesh.vertices) << entry.name << extension;
            EXPECT_EQ(from_memory.mesh.triangles, from_file.mesh.triangles) << entry.name << extension;
            EXPECT_EQ(from_memory.format, from_file.format);
            EXPECT_EQ(decode_mesh(encoded.bytes).mesh.triangles, from_file.mesh.triangles)
                << "by content alone";
        }
    const Mesh ball = zoo::sphere({1, 2, 3}, 2, 2), box = zoo::tetrahedron();
    const NamedMesh two[] = {{"ball", ball}, {"box", box}};
    write_glb(two, folder / "two.glb");
    EXPECT_EQ(text_of(encode_glb(two)), samples::read_file(folder / "two.glb"));
}

TEST(Files, InMemoryTheyAreRefusedAsOnDisk) {
    Mesh broken = zoo::tetrahedron();
    broken.triangles[0][0] = 99;
    EXPECT_THROW(encode_mesh(broken, ".obj"), InputError);
    EXPECT_THROW(encode_mesh(zoo::tetrahedron(), ".xyz"), OptionError);
    EXPECT_THROW(encode_mesh(zoo::tetrahedron(), ".stl", {.up = UpAxis::z}), OptionError);
    EXPECT_THROW(decode_mesh({}), InputError);
    const std::string gltf = R"({"asset":{"version":"2.0"},"buffers":[{"uri":"a.bin","byteLength":36}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],
        "scenes":[{"nodes":[0]}]})";
    try {
        decode_mesh(std::as_bytes(std::span(gltf)), ".gltf");
        FAIL() << "a.bin is not there";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("a.bin"));
        EXPECT_THAT(error.what(), HasSubstr(".glb"));
    }
}

TEST(Files, WritingReplacesOnlyWithACompleteFile) {
    const samples::TemporaryFolder folder;
    const auto path = folder / "m.obj";
    samples::write_file(path, "old");
    Mesh broken = zoo::tetrahedron();
    broken.triangles[0][0] = 99;
    EXPECT_THROW(write_mesh(broken, path), InputError);
    EXPECT_THROW(write_mesh(zoo::tetrahedron(), folder / "m.xyz"), OptionError);
    EXPECT_THROW(write_mesh(zoo::tetrahedron(), folder / "none/m.obj"), FileError);
    EXPECT_THROW(write_mesh(zoo::tetrahedron(), "/dev/null/m.obj"), FileError);
    EXPECT_EQ(samples::read_file(path), "old");
    std::filesystem::create_directory(folder / "dir.obj");
    EXPECT_THROW(write_mesh(zoo::tetrahedron(), folder / "dir.obj"), FileError);
    Mesh far = zoo::tetrahedron();
    far.vertices[1].x = 1e39;
    EXPECT_THROW(write_mesh(far, folder / "far.stl"), InputError) << "beyond 32-bit numbers";
    std::filesystem::create_symlink(path, folder / "link.obj");
    write_mesh(zoo::tetrahedron(), folder / "link.obj");
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.obj"));
    EXPECT_EQ(read_mesh(path).mesh.triangles.size(), 4u);
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++count;
    EXPECT_EQ(count, 3u) << "a temporary file was left behind";
}

TEST(Files, AFullDiskLeavesTheOldFileAlone) {
    // As good as a full disk: files may not grow beyond 4 KiB.
    const samples::TemporaryFolder folder;
    const auto path = folder / "m.ply";
    samples::write_file(path, "old");
    const auto write = [&] {
        signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{4096, 4096};
        setrlimit(RLIMIT_FSIZE, &limit);
        try {
            write_mesh(zoo::sphere({0, 0, 0}, 1, 3), path);
        } catch (const FileError&) {
            _exit(7);
        }
        _exit(0);
    };
    EXPECT_EXIT(write(), testing::ExitedWithCode(7), "");
    EXPECT_EQ(samples::read_file(path), "old");
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++count;
    EXPECT_EQ(count, 1u);
}

TEST(Files, ContentDecidesWhereTheExtensionIsWrong) {
    const samples::TemporaryFolder folder;
    for (const auto& seed : samples::seeds()) {
        const std::string expected = read_mesh(seed).format;
        for (const char* name : {"a.obj", "a.off", "a.stl", "a.ply", "a.glb", "a.3mf", "a.txt", "a"}) {
            // Statements of OBJ are no mark: only an extension that promises a mark gives them away.
            if (expected == "obj" && std::string(name) == "a.stl") continue;
            samples::write_file(folder / name, samples::read_file(seed));
            EXPECT_EQ(read_mesh(folder / name).format, expected) << seed << " as " << name;
        }
    }
}

TEST(Files, ErrorsNameTheFile) {
    const samples::TemporaryFolder folder;
    EXPECT_THROW(read_mesh(folder / "none.obj"), FileError);
    EXPECT_THROW(read_mesh(folder.path()), FileError);
    samples::write_file(folder / "empty.obj", "");
    samples::write_file(folder / "odd.xyz", "1 2 3\n");
    for (const char* name : {"empty.obj", "odd.xyz"}) {
        try {
            read_mesh(folder / name);
            ADD_FAILURE() << name;
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr(name));
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        }
    }
}

TEST(Damage, FilesCutAtEveryByteAreReadInPartOrRefused) {
    for (const auto& seed : samples::seeds()) {
        const std::string bytes = samples::read_file(seed), extension = formats::lower_extension(seed);
        for (std::size_t length = 0; length < bytes.size(); ++length) {
            SCOPED_TRACE(seed.string() + " cut to " + std::to_string(length));
            try {
                expect_usable(formats::parse_mesh(std::string_view(bytes).substr(0, length), extension));
            } catch (const InputError& error) {
                EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
            }
        }
    }
}

TEST(Damage, CutBinaryFilesAlwaysSaySo) {
    for (const auto& seed : samples::seeds()) {
        const std::string extension = formats::lower_extension(seed), bytes = samples::read_file(seed);
        if (seed.filename() != "binary.stl" && seed.filename().string().find("binary_") != 0) continue;
        const std::string_view view(bytes);
        const MeshFile cut = formats::parse_mesh(view.substr(0, bytes.size() - 1), extension);
        EXPECT_EQ(cut.mesh.triangles.size(), 3u) << seed;
        EXPECT_FALSE(cut.warnings.empty()) << seed;
    }
}

TEST(Damage, FlippedBytesNeverCrash) {
    std::uint64_t state = 20240607;
    const auto random = [&] {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        return state >> 33;
    };
    for (const auto& seed : samples::seeds()) {
        const std::string original = samples::read_file(seed), extension = formats::lower_extension(seed);
        for (int round = 0; round < 1500; ++round) {
            std::string bytes = original;
            for (std::uint64_t flips = 1 + random() % 4; flips > 0; --flips) {
                bytes[random() % bytes.size()] = char(random() % 3 == 0 ? 0xff : random());
            }
            SCOPED_TRACE(seed.string() + " round " + std::to_string(round));
            try {
                expect_usable(formats::parse_mesh(bytes, extension));
            } catch (const InputError&) {
            }
        }
    }
}

TEST(Damage, HugeCountsInTinyFilesCostNothing) {
    const std::string ply =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
        "property float z\nelement face 9000000000000000000\nproperty list uint int "
        "vertex_indices\nend_header\n";
    const std::string off = "OFF\n4294967294 99999999999999 0\n0 0 0\n";
    std::string stl(84, '\xff');
    const std::string list =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\n"
        "property uchar z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n"
        "123456789\xff\xff\xff\xff";
    for (const std::string& bytes : {ply, off, stl, list}) {
        EXPECT_THROW(formats::parse_mesh(bytes, bytes[0] == '\xff' ? ".stl" : ""), InputError);
    }
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    EXPECT_LT(usage.ru_maxrss, 2 << 20) << "KiB";
}

TEST(Speed, RepeatedNewlinesAndDeepNestingAreLinear) {
    EXPECT_THROW(formats::parse_obj(std::string(20000000, '\n')), InputError);
    EXPECT_THROW(formats::parse_off("OFF" + std::string(20000000, '\n')), InputError);
    EXPECT_THROW(formats::parse_stl("solid" + std::string(20000000, ' ')), InputError);
    EXPECT_THROW(formats::parse_ply("ply\n" + std::string(5000000, '\n')), InputError);
    std::string backslashes;
    for (int i = 0; i < 5000000; ++i) backslashes += "\\\n";
    EXPECT_THROW(formats::parse_obj(backslashes), InputError);
}

/// The manifest of ITS_TEST_MESHES, a map from column to value for each file.
std::vector<std::map<std::string, std::string>> manifest(std::filesystem::path& folder) {
    std::vector<std::map<std::string, std::string>> rows;
    const char* name = std::getenv("ITS_TEST_MESHES");
    if (name == nullptr) return rows;
    folder = name;
    std::ifstream file(folder / "MANIFEST.tsv");
    std::vector<std::string> columns;
    for (std::string line; std::getline(file, line);) {
        std::vector<std::string> fields;
        std::istringstream stream(line);
        for (std::string field; std::getline(stream, field, '\t');) fields.push_back(field);
        if (columns.empty()) {
            columns = fields;
            continue;
        }
        std::map<std::string, std::string> row;
        for (std::size_t i = 0; i < std::min(columns.size(), fields.size()); ++i) row[columns[i]] = fields[i];
        rows.push_back(std::move(row));
    }
    return rows;
}

TEST(RealMeshes, AreAsTheManifestSays) {
    std::filesystem::path folder;
    const auto rows = manifest(folder);
    if (rows.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    for (auto row : rows) {
        const std::string name = row["file"];
        SCOPED_TRACE(name);
        if (row["status"].starts_with("NOFACES")) {
            EXPECT_THROW(read_mesh(folder / name), InputError);
            continue;
        }
        const MeshFile file = read_mesh(folder / name);
        expect_usable(file);
        const MeshReport report = inspect(file.mesh);
        EXPECT_EQ(row["status"] == "ok", file.warnings.empty());
        // docs/design/mesh.md: two vertex counts include unused vertices, and one "oriented" is by another
        // rule.
        if (name != "stanford-bunny.obj" && name != "nan_inf_coordinates.obj") {
            EXPECT_EQ(std::to_string(report.vertices), row["vertices_merged"]);
        }
        if (name != "modelnet_chair.off") {
            EXPECT_EQ(report.oriented ? "yes" : "no", row["oriented"]);
        }
        EXPECT_EQ(file.format, row["format"]);
        EXPECT_EQ(std::to_string(report.triangles), row["triangles"]);
        EXPECT_EQ(std::to_string(report.degenerate), row["degenerate"]);
        EXPECT_EQ(std::to_string(report.duplicate), row["duplicate"]);
        EXPECT_EQ(std::to_string(report.boundary_edges), row["boundary_edges"]);
        EXPECT_EQ(std::to_string(report.nonmanifold_edges), row["nonmanifold_edges"]);
        EXPECT_EQ(std::to_string(report.inconsistent_edges), row["inconsistent_edges"]);
        EXPECT_EQ(std::to_string(report.components), row["components_vertex"]);
        EXPECT_EQ(std::to_string(report.euler), row["euler"]);
        EXPECT_EQ(report.closed ? "yes" : "no", row["closed"]);
        if (row["closed"] == "yes" && row["manifold"] == "yes" && row["oriented"] == "yes") {
            EXPECT_EQ(report.sign, SignRule::winding);
        }
        // Winding numbers exist where M is a cycle, as it is or once triangles are turned around.
        EXPECT_EQ(report.sign == SignRule::winding, inspect(oriented(file.mesh)).unbalanced_edges == 0);
    }
}

}  // namespace
}  // namespace its
