#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <random>

#include "its/mesh_file.h"
#include "its/query.h"
#include "its/shell_file.h"
#include "shell/access.h"
#include "shell/validate.h"
#include "shell_file/shell_file.h"
#include "support/zoo.h"

namespace its {
namespace {

namespace fs = std::filesystem;

ThinShell build_at(const Mesh& mesh, int depth, int threads = 0) {
    BuildOptions options;
    options.depth = depth;
    options.run.threads = threads;
    return build(mesh, options);
}

class BuiltShell : public testing::Test {
protected:
    fs::path path_ = fs::temp_directory_path() / fmt::format("its-built-{}.its", ::getpid());
    void TearDown() override { fs::remove(path_); }

    void expect_round_trip(const ThinShell& shell, const std::string& name) {
        SCOPED_TRACE(name);
        EXPECT_NO_THROW(shell::validate(shell::Access::data(shell)));
        save(shell, path_);
        const ThinShell loaded = load(path_);
        EXPECT_EQ(shell_file::encode(shell::Access::data(loaded)),
                  shell_file::encode(shell::Access::data(shell)));
        EXPECT_EQ(loaded.info().sign_reason, shell.info().sign_reason);
        EXPECT_EQ(loaded.mesh().triangles, shell.mesh().triangles);
        EXPECT_EQ(loaded.mesh().vertices, shell.mesh().vertices);
        const Box& root = shell.info().root;
        std::mt19937_64 random(20240);
        for (int i = 0; i < 1000; ++i) {
            Vec3 p;
            for (int axis = 0; axis < 3; ++axis) {
                const double t = std::uniform_real_distribution(-0.1, 1.1)(random);
                p[axis] = root.min[axis] + t * (root.max[axis] - root.min[axis]);
            }
            EXPECT_EQ(loaded.value(p), shell.value(p));
        }
    }
};

TEST_F(BuiltShell, RoundTripOfEveryMesh) {
    for (const zoo::Entry& entry : zoo::all())
        for (const int depth : {0, 1, 5}) expect_round_trip(build_at(entry.mesh, depth), entry.name);
}

TEST_F(BuiltShell, RoundTripOfARealMesh) {
    const std::vector<std::string> files = zoo::real_mesh_files();
    if (files.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    for (const std::string& file : files) {
        if (fs::file_size(file) > 300'000) continue;
        expect_round_trip(build_at(read_mesh(file).mesh, 5), file);
    }
}

TEST_F(BuiltShell, SameBytesForAnyNumberOfThreads) {
    for (const Mesh& mesh : {zoo::twisted_knot(60, 12), zoo::soup(300, 7)})
        EXPECT_EQ(encode(build_at(mesh, 6, 1)), encode(build_at(mesh, 6, 2)));
}

/// Damage behind mended checksums that a quick load lets through: queries give some answer and come back.
TEST_F(BuiltShell, QueriesOfQuicklyLoadedDamageComeBack) {
    std::mt19937_64 random(20240);
    const Mesh mesh = zoo::tetrahedron();
    const std::vector<std::byte> good = encode(build_at(mesh, 4));
    int used = 0;
    for (int round = 0; round < 300; ++round) {
        std::vector<std::byte> file = good;
        for (int n = 0; n < 200; ++n) {
            // The last seven eighths of the file are numbers: a quick load reads none of them.
            const std::size_t at = file.size() / 8 + random() % (file.size() - file.size() / 8);
            file[at] = std::byte(random() % 2 ? 0xff : random());
        }
        shell_file::mend_checksums(file);
        try {
            const ThinShell shell = decode(file, {.check = LoadCheck::quick});
            const Query query(shell);
            for (int i = 0; i < 300; ++i) {
                Vec3 p = mesh.vertices[random() % mesh.vertices.size()];
                for (int axis = 0; axis < 3; ++axis)
                    p[axis] += std::uniform_real_distribution(-0.1, 0.1)(random) * double(random() % 2);
                (void)query.classify(p);
                (void)query.classify_shell(p);
                (void)query.value(p);
                (void)query.gradient(p);
                (void)shell.value(p);
            }
            ++used;
        } catch (const InputError&) {
        }
    }
    EXPECT_GT(used, 100);
}

TEST_F(BuiltShell, CutAndFlippedFilesAreRefused) {
    std::vector<std::byte> file = encode(build_at(zoo::tetrahedron(), 3));
    std::mt19937_64 random(20240);
    for (int i = 0; i < 500; ++i) {
        EXPECT_THROW(shell_file::decode(std::span(file).first(random() % file.size())), InputError);
        std::byte& byte = file[random() % file.size()];
        const std::byte flip = std::byte(1 << random() % 8);
        byte ^= flip;
        EXPECT_THROW(shell_file::decode(file), InputError);
        byte ^= flip;
    }
    EXPECT_NO_THROW(shell_file::decode(file));
}

}  // namespace
}  // namespace its
