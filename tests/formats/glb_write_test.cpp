#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "its/mesh.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

/// GLB files that we write, as our reader reads them.
namespace its {
namespace {

class GlbWriter : public testing::Test {
protected:
    GlbWriter() {
        std::string pattern = (std::filesystem::temp_directory_path() / "its_glb_XXXXXX").string();
        folder = mkdtemp(pattern.data());
    }
    ~GlbWriter() override { std::filesystem::remove_all(folder); }

    std::filesystem::path folder;
};

void expect_rounded(const Mesh& read, const Mesh& written, const Vec3& centre) {
    ASSERT_EQ(read.triangles.size(), written.triangles.size());
    for (std::size_t i = 0; i < read.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            for (int axis = 0; axis < 3; ++axis) {
                const double wanted =
                    centre[axis] + float(written.vertices[written.triangles[i][k]][axis] - centre[axis]);
                EXPECT_NEAR(read.vertices[read.triangles[i][k]][axis], wanted, 1e-15 * (1 + std::abs(wanted)));
            }
}

TEST_F(GlbWriter, KeepsTrianglesAndRoundsCoordinates) {
    const Mesh torus = zoo::torus(1, 0.3, 20, 10);
    write_mesh(torus, folder / "torus.glb");
    const MeshFile file = read_mesh(folder / "torus.glb");
    EXPECT_EQ(file.format, "glb");
    EXPECT_TRUE(file.warnings.empty());
    expect_rounded(file.mesh, torus, {});
    // The lengths in the headers are those of the file.
    std::ifstream stream(folder / "torus.glb", std::ios::binary);
    std::string bytes(std::istreambuf_iterator<char>(stream), {});
    std::uint32_t total;
    std::memcpy(&total, bytes.data() + 8, 4);
    EXPECT_EQ(total, bytes.size());
    EXPECT_EQ(total % 4, 0);
}

TEST_F(GlbWriter, FarFromTheOriginKeepsTheShape) {
    const double turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const Mesh far = zoo::transformed(zoo::sphere({0, 0, 0}, 1, 2), turn, {1e6, -2e6, 3e6}, 1);
    write_mesh(far, folder / "far.glb");
    const Mesh read = read_mesh(folder / "far.glb").mesh;
    ASSERT_EQ(read.triangles.size(), far.triangles.size());
    for (std::size_t i = 0; i < read.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_NEAR(read.vertices[read.triangles[i][k]][axis], far.vertices[far.triangles[i][k]][axis],
                            2e-7);
}

TEST_F(GlbWriter, HasSeveralMeshes) {
    const Mesh a = zoo::sphere({0, 0, 0}, 1, 1), b = zoo::box({3, 3, 3}, {4, 5, 6});
    const NamedMesh meshes[] = {{"outer", a}, {"in\"ner", b}};
    write_glb(meshes, folder / "both.glb");
    expect_rounded(read_mesh(folder / "both.glb").mesh, zoo::joined(a, b), {});
}

TEST_F(GlbWriter, RefusesWhatTheFormatCannotHold) {
    EXPECT_THROW(write_glb({}, folder / "none.glb"), InputError);
    EXPECT_THROW(write_mesh(Mesh{}, folder / "none.glb"), InputError);
    Mesh huge = zoo::tetrahedron();
    huge.vertices[0].x = 1e300;
    EXPECT_THROW(write_mesh(huge, folder / "huge.glb"), InputError);
    EXPECT_THROW(write_mesh(zoo::tetrahedron(), folder / "missing" / "a.glb"), FileError);
    EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(GlbWriter, IsRelativeToTheOriginThatItIsGiven) {
    const Mesh ball = zoo::sphere({100, 0, 0}, 1, 2);
    const Vec3 origin{128, 0.5, -0.25};
    write_mesh(ball, folder / "ball.glb", {.origin = origin});
    expect_rounded(read_mesh(folder / "ball.glb").mesh, ball, origin);
}

std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

nlohmann::json json_of(const std::string& glb) {
    std::uint32_t length;
    std::memcpy(&length, glb.data() + 12, 4);
    return nlohmann::json::parse(glb.substr(20, length));
}

/// What an axis that is up becomes, and the two others with it.
Vec3 turned(const Vec3& v, UpAxis up) {
    return up == UpAxis::z ? Vec3{v.x, v.z, -v.y} : up == UpAxis::x ? Vec3{-v.y, v.x, v.z} : v;
}

TEST_F(GlbWriter, TurnsTheAxisThatIsUpToY) {
    const double still[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (const Vec3& place : {Vec3{0, 0, 0}, Vec3{1e6, -2e6, 3e6}}) {
        const Mesh mesh = zoo::transformed(zoo::torus(1, 0.3, 12, 8), still, place, 1);
        write_mesh(mesh, folder / "as_is.glb");
        const std::string as_is = bytes_of(folder / "as_is.glb");
        const Mesh read = read_mesh(folder / "as_is.glb").mesh;
        for (const UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z}) {
            write_mesh(mesh, folder / "up.glb", {.up = up});
            const std::string file = bytes_of(folder / "up.glb");
            const auto node = json_of(file)["nodes"][0];
            EXPECT_EQ(node.contains("matrix"), up != UpAxis::y);
            EXPECT_FALSE(node.contains("matrix") && node.contains("translation")) << "glTF 2.0 forbids both";
            for (int i = 0; node.contains("matrix") && i < 12; ++i)
                EXPECT_TRUE(node["matrix"][i] == 0 || node["matrix"][i] == 1 || node["matrix"][i] == -1);
            // The coordinates are those of the mesh: the same bytes.
            const std::size_t data = 12 * (mesh.vertices.size() + mesh.triangles.size());
            EXPECT_EQ(file.substr(file.size() - data), as_is.substr(as_is.size() - data));
            const Mesh again = read_mesh(folder / "up.glb").mesh;
            ASSERT_EQ(again.vertices.size(), read.vertices.size());
            EXPECT_EQ(again.triangles, read.triangles) << "a rotation: nothing is turned over";
            for (std::size_t i = 0; i < read.vertices.size(); ++i)
                EXPECT_EQ(again.vertices[i], turned(read.vertices[i], up));
        }
    }
    EXPECT_EQ(turned({0, 0, 1}, UpAxis::z), (Vec3{0, 1, 0}));
    EXPECT_EQ(turned({1, 0, 0}, UpAxis::x), (Vec3{0, 1, 0}));
}

TEST_F(GlbWriter, OnlyItHasAnAxisThatIsUp) {
    for (const char* name : {"a.ply", "a.obj", "a.off", "a.stl"})
        EXPECT_THROW(write_mesh(zoo::tetrahedron(), folder / name, {.up = UpAxis::z}), OptionError) << name;
    EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(GlbWriter, SaysWhereItsOriginIs) {
    const Mesh far = zoo::box({100, 0, 0}, {101, 1, 1});
    write_mesh(far, folder / "far.glb");
    EXPECT_EQ(json_of(bytes_of(folder / "far.glb"))["nodes"][0]["translation"],
              (nlohmann::json{100.5, 0.5, 0.5}));
}

TEST_F(GlbWriter, SinglePrecisionOfOtherFormatsIsThatOf32Bits) {
    const Mesh ball = zoo::sphere({1, 2, 3}, 0.7, 3);
    for (const char* name : {"ball.ply", "ball.obj", "ball.off"}) {
        write_mesh(ball, folder / name, {.single = true});
        const Mesh read = read_mesh(folder / name).mesh;
        ASSERT_EQ(read.vertices.size(), ball.vertices.size());
        EXPECT_EQ(read.triangles, ball.triangles);
        for (std::size_t i = 0; i < read.vertices.size(); ++i)
            for (int axis = 0; axis < 3; ++axis)
                ASSERT_EQ(read.vertices[i][axis], double(float(ball.vertices[i][axis]))) << name;
    }
    std::ifstream stream(folder / "ball.ply", std::ios::binary);
    std::string bytes(std::istreambuf_iterator<char>(stream), {});
    EXPECT_NE(bytes.find("property float x"), std::string::npos);
    EXPECT_EQ(bytes.find("double"), std::string::npos);
}

TEST_F(GlbWriter, SeveralFilesAreWrittenAllOrNone) {
    const Mesh ball = zoo::sphere({1, 2, 3}, 0.7, 2), box = zoo::box({0, 0, 0}, {1, 1, 1});
    write_mesh(box, folder / "a.ply");
    std::filesystem::create_directory(folder / "b.ply");
    const MeshOutput outputs[] = {{ball, folder / "a.ply"}, {ball, folder / "b.ply"}};
    EXPECT_THROW(write_meshes(outputs), FileError);
    EXPECT_EQ(read_mesh(folder / "a.ply").mesh.triangles, box.triangles);
    std::filesystem::remove(folder / "b.ply");
    write_meshes(outputs);
    for (const MeshOutput& output : outputs) EXPECT_EQ(read_mesh(output.path).mesh.triangles, ball.triangles);
}

}  // namespace
}  // namespace its
