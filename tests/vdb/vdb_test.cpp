#include "its/vdb.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include "support/zoo.h"

namespace its {
namespace {

ThinShell build_at(const Mesh& mesh, int depth) {
    BuildOptions options;
    options.depth = depth;
    return build(mesh, options);
}

class Vdb : public testing::Test {
protected:
    Vdb() {
        std::string pattern = (std::filesystem::temp_directory_path() / "its_vdb_XXXXXX").string();
        folder = mkdtemp(pattern.data());
    }
    ~Vdb() override { std::filesystem::remove_all(folder); }

    std::filesystem::path folder;
};

/// OpenVDB refuses narrower cells by an error of its own; it would write infinite values without a word.
TEST_F(Vdb, RefusesSizesThatGridsCannotHave) {
    for (const double size : {1e-3, 1e-70, 1e50}) {
        const ThinShell shell = build_at(zoo::box({0, 0, 0}, {size, size, size}), 7);
        EXPECT_THROW(write_vdb(shell, folder / "f.vdb"), InputError) << size;
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder));
    for (const double size : {2e-3, 1e30}) {
        write_vdb(build_at(zoo::box({0, 0, 0}, {size, size, size}), 6), folder / "f.vdb");
        openvdb::initialize();
        openvdb::io::File file((folder / "f.vdb").string());
        file.open();
        const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("f"));
        EXPECT_NEAR(
            grid->indexToWorld(openvdb::Coord(1, 0, 0)).x() - grid->indexToWorld(openvdb::Coord(0, 0, 0)).x(),
            size / 64, 1e-6 * size);
    }
}

TEST_F(Vdb, OpenVdbReadsTheFunction) {
    const ThinShell shell = build_at(zoo::twisted_knot(60, 12), 5);
    write_vdb(shell, folder / "f.vdb");
    openvdb::initialize();
    openvdb::io::File file((folder / "f.vdb").string());
    file.open();
    const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("f"));
    ASSERT_TRUE(grid);
    EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
    EXPECT_EQ(grid->metaValue<double>("epsilon_outer"), shell.info().epsilon_outer);
    const double width = shell.info().cell_width;
    EXPECT_FLOAT_EQ(grid->background(), float(3 * width));
    EXPECT_GT(grid->activeVoxelCount(), 10000);
    for (auto it = grid->cbeginValueOn(); it; ++it) {
        const openvdb::Vec3d p = grid->indexToWorld(it.getCoord());
        EXPECT_NEAR(*it, shell.value({p.x(), p.y(), p.z()}), 1e-6 * width);
    }
    // Every point of the lattice near M is active, and signs are right everywhere else.
    const auto sampler = grid->getConstAccessor();
    const Box root = shell.info().root;
    const int side = int(std::lround((root.max.x - root.min.x) / width));
    for (int z = 0; z <= side; z += 3)
        for (int y = 0; y <= side; ++y)
            for (int x = 0; x <= side; ++x) {
                const double f =
                    shell.value({root.min.x + x * width, root.min.y + y * width, root.min.z + z * width});
                const float v = sampler.getValue({x, y, z});
                EXPECT_NEAR(v, std::clamp(f, -3 * width, 3 * width), 1e-6 * width);
            }
}

TEST_F(Vdb, WithoutInsideItIsNoLevelSet) {
    const ThinShell shell = build_at(zoo::sheet(4), 4);
    write_vdb(shell, folder / "f.vdb", {.half_width = 1.5, .run = {.threads = 1}});
    openvdb::initialize();
    openvdb::io::File file((folder / "f.vdb").string());
    file.open();
    const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("f"));
    EXPECT_EQ(grid->getGridClass(), openvdb::GRID_UNKNOWN);
    for (auto it = grid->cbeginValueAll(); it; ++it) EXPECT_GE(*it, 0);
}

TEST_F(Vdb, BadPathsAndOptionsLeaveNothing) {
    const ThinShell shell = build_at(zoo::tetrahedron(), 3);
    EXPECT_THROW(write_vdb(shell, folder / "missing" / "f.vdb"), FileError);
    EXPECT_THROW(write_vdb(shell, folder / "f.vdb", {.half_width = 0}), OptionError);
    EXPECT_THROW(write_vdb(shell, folder / "f.vdb", {.half_width = 1e9}), OptionError);
    EXPECT_THROW(write_vdb(shell, folder / "f.vdb", {.run = {.threads = -1}}), OptionError);
    EXPECT_THROW(write_vdb(shell, folder / "f.vdb",
                           {.run = {.progress = [](std::string_view, double) { return false; }}}),
                 Cancelled);
    EXPECT_TRUE(std::filesystem::is_empty(folder));
}

}  // namespace
}  // namespace its
