#include "shell/budget.h"

#include <gtest/gtest.h>

#include "its/shell.h"
#include "octree/lattice.h"
#include "octree/octree.h"
#include "octree/voxelise.h"
#include "support/zoo.h"

namespace its {
namespace {

/// Some triangles that are points, far apart.
Mesh points() {
    Mesh mesh;
    for (std::uint32_t i = 0; i < 4; ++i) {
        mesh.vertices.push_back({i * 0.37, i * i * 0.21, 1.0 / (i + 1)});
        mesh.triangles.push_back({i, i, i});
    }
    return mesh;
}

/// A square in a lattice plane: it meets two layers of cells at every depth.
Mesh aligned_square() {
    return {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
}

struct Level {
    int level;
    std::uint64_t cells, pairs;
};

/// What voxelise() reports before each level, and the size of the finished build.
shell::BuildSize size_by_level(const Mesh& mesh, int depth, std::vector<Level>& levels) {
    const octree::Lattice lattice = octree::make_lattice(octree::bounds(mesh), depth);
    std::vector<Vec3> positions;
    for (const Vec3& v : mesh.vertices) positions.push_back(lattice.to_lattice(v));
    const octree::Voxels voxels =
        octree::voxelise(positions, mesh.triangles, lattice.depth, lattice.point_error(), {},
                         [&](int level, std::uint64_t cells, std::uint64_t pairs) {
                             levels.push_back({level, cells, pairs});
                         });
    const octree::Octree octree = octree::make_octree(lattice.depth, voxels.cell);
    std::uint64_t groups = 0;
    for (const auto& level : octree.levels) groups += level.groups();
    return {mesh.triangles.size(), groups, voxels.cell.size(), voxels.triangle.size()};
}

TEST(Budget, NoLevelRefusesABuildThatFits) {
    std::vector<std::pair<std::string, Mesh>> meshes = {{"points", points()}, {"square", aligned_square()}};
    for (const auto& entry : zoo::all()) meshes.emplace_back(entry.name, entry.mesh);
    for (const auto& [name, mesh] : meshes)
        for (const int depth : {1, 4, 7}) {
            std::vector<Level> levels;
            const shell::BuildSize size = size_by_level(mesh, depth, levels);
            const shell::MemoryBudget budget(mesh, depth, shell::build_bytes(size));
            for (const Level& l : levels)
                EXPECT_NO_THROW(budget.check_level(l.level, l.cells, l.pairs))
                    << name << " depth " << depth << " level " << l.level;
        }
}

TEST(Budget, ALevelRefusesLongBeforeTheFinestIsTaken) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1, 4);
    std::vector<Level> levels;
    const int depth = 8;
    const shell::BuildSize size = size_by_level(mesh, depth, levels);
    const shell::MemoryBudget budget(mesh, depth, shell::build_bytes(size) / 16);
    int refused = -1;
    for (const Level& l : levels) {
        try {
            budget.check_level(l.level, l.cells, l.pairs);
        } catch (const MemoryError&) {
            refused = l.level;
            break;
        }
    }
    EXPECT_GE(refused, 2) << "the finest level has 4² times the cells";
}

TEST(Budget, PointsTakeLittleAtAnyDepth) {
    BuildOptions options;
    options.depth = 14;
    options.max_memory = 1'000'000;
    const ThinShell shell = build(points(), options);
    EXPECT_LE(shell.info().surface_cells, 4u * 8u);
    EXPECT_LT(shell.info().memory_bytes, options.max_memory);
}

TEST(Budget, TheMeasureDoesNotDependOnScale) {
    const Mesh mesh = zoo::torus(1, 0.4, 24, 12);
    Mesh large = mesh;
    for (Vec3& v : large.vertices) v = {1024 * v.x, 1024 * v.y, 1024 * v.z};
    const shell::MeshMeasure a = shell::measure(mesh), b = shell::measure(large);
    EXPECT_EQ(a.area, b.area);
    EXPECT_EQ(a.extent, b.extent);
    EXPECT_GT(a.area, 1);
}

/// A square of needles side by side, and as many in a wire.
Mesh needle_sheet(std::uint32_t needles) {
    Mesh mesh;
    for (std::uint32_t i = 0; i <= needles; ++i) {
        const double x = double(i) / needles;
        mesh.vertices.push_back({x, 0, 0.2 * x});
        mesh.vertices.push_back({x, 1, 0.3 * x});
        if (i == needles) break;
        mesh.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 3});
        mesh.triangles.push_back({2 * i, 2 * i + 3, 2 * i + 1});
    }
    return mesh;
}

Mesh wire() {
    Mesh mesh{{{0, 0, 0}, {1, 0.3, 0.2}, {0, 1e-4, 0}}, {}};
    for (std::uint32_t i = 0; i < 20; ++i) mesh.triangles.push_back({0, 1, 2});
    return mesh;
}

TEST(Budget, NeedlesSideBySideShareCells) {
    for (const auto& [name, mesh] : {std::pair{"sheet", needle_sheet(4000)}, std::pair{"wire", wire()}})
        for (const int depth : {6, 7, 9}) {
            std::vector<Level> levels;
            const shell::BuildSize real = size_by_level(mesh, depth, levels),
                                   guess = shell::estimate_size(mesh, depth);
            EXPECT_LT(double(guess.surface_cells), 2.2 * double(real.surface_cells)) << name << ' ' << depth;
            EXPECT_GT(double(guess.surface_cells), 0.6 * double(real.surface_cells)) << name << ' ' << depth;
        }
}

/// A shell is recognised by what it was built to, whoever chose that.
TEST(Budget, TheHashIsThatOfTheThicknessWhoeverChoseIt) {
    const Mesh mesh = zoo::torus(1, 0.4, 24, 12);
    const auto chosen = input_hash(mesh);
    const BuildOptions given{
        .thickness = default_thickness * 2.8,
        .max_cells = default_max_cells + default_cells_per_triangle * mesh.triangles.size()};
    EXPECT_EQ(chosen, input_hash(mesh, given)) << "2 (1 + 0.4) long";
    EXPECT_EQ(chosen, input_hash(mesh, {.max_memory = 1'000'000})) << "memory is no part of it";
    EXPECT_NE(chosen, input_hash(mesh, {.thickness = 0.01}));
    EXPECT_NE(chosen, input_hash(mesh, {.max_cells = 100'000}));
    EXPECT_NE(chosen, input_hash(mesh, {.deepest = 5}));
    EXPECT_NE(chosen, input_hash(mesh, {.depth = 6}));
    const Mesh knot = zoo::twisted_knot(40, 10);
    EXPECT_EQ(build(knot, {.weld = 1e-3}).info().input_hash, input_hash(knot, {.weld = 1e-3}));
    EXPECT_THROW(input_hash(Mesh{}), InputError);
    EXPECT_NO_THROW(input_hash(Mesh{}, {.depth = 4}));
}

TEST(Budget, FarFromTheOriginCellsAreAsSmallAsDoublesAllow) {
    Mesh far = zoo::single_triangle();
    for (Vec3& v : far.vertices) v.x += 0x1p38;
    const ShellInfo info = build(far).info();
    EXPECT_LT(info.depth, 6);
    EXPECT_GT(info.thickness_asked, default_thickness) << "roundings allow no less";
    EXPECT_EQ(info.input_hash, input_hash(far));
}

TEST(Budget, AMeshThatAloneIsTooMuchIsRefused) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1, 4);
    BuildOptions options;
    options.max_memory = 100 * mesh.triangles.size();
    EXPECT_THROW((void)build(mesh, options), MemoryError);
}

}  // namespace
}  // namespace its
