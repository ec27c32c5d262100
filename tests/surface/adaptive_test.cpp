#include <gtest/gtest.h>

#include <fmt/format.h>
#include <random>

#include "adaptive/refine.h"
#include "cgal/cgal.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/surface.h"
#include "octree/lattice.h"
#include "shell/access.h"
#include "shell/shell_data.h"
#include "support/zoo.h"
#include "surface/leaf_surface.h"

// Level sets on cells of several sizes, judged by CGAL.

namespace its {
namespace {

ThinShell build_to(const Mesh& mesh, double relative) {
    const Box box = octree::bounds(mesh);
    BuildOptions options;
    options.thickness =
        relative * std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
    return build(mesh, options);
}

void expect_sound_surfaces(const std::string& name, const Mesh& mesh, const ThinShell& shell,
                           Coordinates coordinates) {
    SCOPED_TRACE(fmt::format("{}, thickness {}", name, shell.info().thickness_asked));
    SurfaceOptions options;
    options.coordinates = coordinates;
    const Surface outer = extract_surface(shell, options);
    EXPECT_TRUE(outer.report.certified) << outer.report.reason;
    EXPECT_GT(outer.report.lowest, shell.info().epsilon_outer);
    EXPECT_EQ(cgal::surface_defects(outer.mesh), "");
    EXPECT_EQ(cgal::triangles_meeting(mesh, outer.mesh), 0u);
    EXPECT_EQ(cgal::vertices_not_inside(mesh, outer.mesh), 0u);
    options.side = SurfaceSide::inner;
    const Surface inner = extract_surface(shell, options);
    if (inner.report.empty) return;
    EXPECT_TRUE(inner.report.certified) << inner.report.reason;
    EXPECT_EQ(cgal::surface_defects(inner.mesh), "");
    EXPECT_EQ(cgal::triangles_meeting(mesh, inner.mesh), 0u);
    options.side = SurfaceSide::zero;
    EXPECT_EQ(cgal::surface_defects(extract_surface(shell, options).mesh), "");
}

TEST(AdaptiveSurface, EnclosesEveryClosedMesh) {
    for (const zoo::Entry& entry : zoo::all()) {
        if (!entry.closed_oriented) continue;
        for (const double thickness : {0.2, 0.02}) {
            const ThinShell shell = build_to(entry.mesh, thickness);
            expect_sound_surfaces(entry.name, entry.mesh, shell, Coordinates::doubles);
            if (thickness > 0.1) expect_sound_surfaces(entry.name, entry.mesh, shell, Coordinates::single);
        }
    }
}

TEST(AdaptiveSurface, HasFewerTrianglesThanOneOfTheFinestCells) {
    const Mesh mesh = zoo::twisted_knot(60, 20);
    const ThinShell shell = build_to(mesh, 0.01);
    SurfaceOptions options;
    const Surface leaves = extract_surface(shell, options);
    options.resolution = 1 << shell.info().depth;
    const Surface finest = extract_surface(shell, options);
    EXPECT_TRUE(leaves.report.certified);
    EXPECT_TRUE(finest.report.certified);
    EXPECT_LT(1.5 * double(leaves.mesh.triangles.size()), double(finest.mesh.triangles.size()));
}

TEST(AdaptiveSurface, IsTheSameForAnyNumberOfThreads) {
    const ThinShell shell = build_to(zoo::twisted_knot(40, 12), 0.01);
    SurfaceOptions options;
    options.run.threads = 1;
    const Surface one = extract_surface(shell, options);
    options.run.threads = 3;
    const Surface three = extract_surface(shell, options);
    EXPECT_EQ(one.mesh.vertices, three.mesh.vertices);
    EXPECT_EQ(one.mesh.triangles, three.mesh.triangles);
}

/// A shell whose cells are chosen, and whose values are drawn, at random: nothing but the octree's own rules
/// holds.
shell::ShellData random_shell(std::uint64_t seed, bool balanced, bool ties) {
    const Mesh mesh = zoo::sphere({0.1, 0.2, 0.3}, 1, 2);
    shell::ShellData data;
    data.lattice = octree::make_nested_lattice(octree::bounds(mesh), 5, 3);
    std::vector<Vec3> positions;
    for (const Vec3& v : mesh.vertices) positions.push_back(data.lattice.to_lattice(v));
    const double infinity = std::numeric_limits<double>::infinity();
    adaptive::Refined refined = adaptive::refine(
        {.lattice = data.lattice,
         .positions = positions,
         .mesh = mesh,
         .rule = SignRule::winding,
         .lower = -infinity,
         .upper = infinity,
         .least_depth = 1,
         .many_width = infinity,
         .balanced = balanced,
         .also =
             [&](int level, std::uint64_t code) {
                 std::uint64_t h = (code * 64 + std::uint64_t(level) + seed * 977) * 0x9e3779b97f4a7c15;
                 h = (h ^ h >> 29) * 0xbf58476d1ce4e5b9;
                 return level > 0 && (h >> 33) % 5 < 2;
             }},
        {});
    data.lattice = octree::coarser(data.lattice, data.lattice.depth - refined.depth);
    data.octree = refined.octree;
    // From coarse to fine: random values at free points, which those of the level above are at the same place.
    const octree::Octree& octree = data.octree;
    std::vector<std::vector<double>> values = refined.values;
    const auto hash = [&](std::uint64_t x, std::uint64_t y, std::uint64_t z) {
        std::uint64_t h = (x + 1000003 * y + 998244353 * z + seed) * 0x9e3779b97f4a7c15;
        h = (h ^ h >> 29) * 0xbf58476d1ce4e5b9;
        const double v = double((h ^ h >> 32) >> 11) * 0x1p-52 - 1;
        return ties ? std::round(2 * v) / 2 : v;
    };
    const std::uint64_t side = data.lattice.cells();
    for (int k = octree.depth; k >= 0; --k) {
        const octree::Level& level = octree.levels[std::size_t(k)];
        for (std::uint64_t g = 0; g < level.groups(); ++g) {
            const octree::Cell parent = octree::morton_decode(level.parent[g]);
            double corner[8] = {};
            if (k < octree.depth) {
                const std::uint64_t above = octree.find(k + 1, level.parent[g] >> 3);
                for (int c = 0; c < 8; ++c)
                    corner[c] =
                        values[std::size_t(k) + 1]
                              [27 * above + std::uint64_t(octree::group_point(int(level.parent[g] & 7), c))];
            }
            for (std::uint64_t p = 0; p < 27; ++p) {
                const std::uint64_t half[3] = {p % 3, p / 3 % 3, p / 9};
                std::uint64_t at[3];
                bool boundary = false, hangs = false;
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    at[axis] = (2 * parent[axis] + half[axis]) << k;
                    boundary = boundary || at[axis] == 0 || at[axis] == side;
                }
                for (unsigned around = 0; around < 8 && k < octree.depth; ++around) {  // by definition
                    octree::Cell finest;
                    bool in_root = true;
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        const std::uint64_t i = at[axis] - (around >> axis & 1);
                        in_root = in_root && i < side;
                        finest[axis] = std::uint32_t(i);
                    }
                    if (!in_root) continue;
                    std::uint64_t code = octree::morton_encode(finest);
                    int leaf = 0;
                    for (; octree.find(leaf, code >> 3) == octree::no_group; ++leaf) code >>= 3;
                    hangs = hangs ||
                            (leaf > k &&
                             (octree.surface_mask(leaf, octree.find(leaf, code >> 3)) >> (code & 7) & 1) != 0);
                }
                double& value = values[std::size_t(k)][27 * g + p];
                value = boundary ? 1 : hash(at[0], at[1], at[2]);
                if (!hangs) continue;
                const auto mean = [](double a, double b) { return 0.5 * (a + b); };
                double x[4], y[2];
                for (int i = 0; i < 4; ++i)
                    x[i] = half[0] == 1 ? mean(corner[2 * i], corner[2 * i + 1])
                                        : corner[2 * i + int(half[0]) / 2];
                for (int i = 0; i < 2; ++i)
                    y[i] = half[1] == 1 ? mean(x[2 * i], x[2 * i + 1]) : x[2 * i + int(half[1]) / 2];
                value = half[2] == 1 ? mean(y[0], y[1]) : y[half[2] / 2];
            }
        }
    }
    for (auto& level : values) data.field.values.emplace_back(std::move(level));
    return data;
}

/// On the coarsest shell of all, cells that meet the boundary of the root cube are finest ones.
TEST(AdaptiveSurface, LevelsThatReachTheRootCubeAreRefused) {
    const Mesh cube = zoo::box({0, 0, 0}, {1, 1, 1});
    const ThinShell shell = build(cube, {.thickness = 1e-6, .deepest = 3});
    bool refused = false;
    for (double level = 0.02; level < 0.9; level += 0.02) {
        SCOPED_TRACE(level);
        try {
            const Surface surface = extract_surface(shell, {.level = level, .measure = false});
            EXPECT_EQ(inspect(surface.mesh).boundary_edges, 0u);
        } catch (const OptionError&) {
            refused = true;
        }
    }
    EXPECT_TRUE(refused);
}

TEST(AdaptiveSurface, RandomLevelSetsOnRandomTreesAreSound) {
    for (std::uint64_t seed = 0; seed < 16; ++seed) {
        SCOPED_TRACE(seed);
        const shell::ShellData data = random_shell(seed, seed % 2 == 0, seed % 3 == 0);
        surface::Grid grid{.origin = data.lattice.position({0, 0, 0}),
                           .step = data.lattice.width,
                           .cells = data.lattice.cells(),
                           .clearance = surface::least_clearance};
        surface::MemoryGuard guard(0);
        const surface::LeafSurface found =
            surface::extract_leaf_surface(data, grid, SurfaceSide::outer, 0.0, 0.0, false, guard, {});
        ASSERT_FALSE(found.mesh.triangles.empty());
        EXPECT_EQ(cgal::surface_defects(found.mesh), "");
    }
}

}  // namespace
}  // namespace its
