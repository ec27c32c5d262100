#include <gtest/gtest.h>

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <random>

#include "adaptive/refine.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/shell.h"
#include "its/shell_file.h"
#include "its/surface.h"
#include "its/verify.h"
#include "octree/lattice.h"
#include "support/zoo.h"

// Shells built to a thickness, from outside.

namespace its {
namespace {

double longest_side(const Mesh& mesh) {
    const Box box = octree::bounds(mesh);
    return std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
}

BuildOptions to_thickness(const Mesh& mesh, double relative, std::optional<SignRule> sign = {}) {
    BuildOptions options;
    const double side = longest_side(mesh);
    options.thickness = relative * (side > 0 ? side : 1);
    options.sign = sign;
    return options;
}

void expect_verified(const std::string& name, const Mesh& mesh, const BuildOptions& options) {
    SCOPED_TRACE(fmt::format("{}, thickness {}", name, options.thickness));
    const ThinShell shell = build(mesh, options);
    const ShellInfo& info = shell.info();
    EXPECT_TRUE(info.adaptive);
    EXPECT_EQ(info.coarse_cells == 0, info.thickness() <= options.thickness);
    const bool limited = options.max_cells > 0 || options.max_memory > 0 || options.deepest;
    if (!limited) {
        EXPECT_EQ(info.coarse_cells, 0u);
    }
    VerifyOptions all;
    all.complete = shell.info().surface_cells < 3000;
    const VerifyReport report = verify(shell, mesh, all);
    for (const VerifyCheck& check : report.checks)
        EXPECT_TRUE(check.passed) << check.name << ": " << check.detail;
}

TEST(Adaptive, ThickShellsOfAllKindsOfMeshesPassACompleteCheck) {
    for (const zoo::Entry& entry : zoo::all()) {
        expect_verified(entry.name, entry.mesh, to_thickness(entry.mesh, 0.3));
        if (entry.closed_oriented)
            expect_verified(entry.name, entry.mesh, to_thickness(entry.mesh, 0.3, SignRule::even_odd));
    }
}

TEST(SlowAdaptive, ThinShellsOfAllKindsOfMeshesPassACompleteCheck) {
    for (const zoo::Entry& entry : zoo::all())
        expect_verified(entry.name, entry.mesh, to_thickness(entry.mesh, 0.04));
}

/// A ball without a cap.
Mesh open_ball(int level, double height) {
    Mesh mesh = zoo::sphere({0.1, 0.2, 0.3}, 1, level);
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
            const Vec3& p = mesh.vertices[v];
            return 0.6 * (p.x - 0.1) + 0.8 * (p.z - 0.3) > height;
        });
    });
    return mesh;
}

TEST(Adaptive, HolesAreFilled) {
    for (const double height : {0.5, 0.9}) {
        const Mesh mesh = open_ball(4, height);
        for (const double thickness : {0.05, 0.02})
            expect_verified("open ball", mesh, to_thickness(mesh, thickness, SignRule::generalized));
        const ThinShell shell = build(mesh, to_thickness(mesh, 0.01, SignRule::generalized));
        EXPECT_LT(shell.value({0.1, 0.2, 0.3}), 0);
        EXPECT_GT(shell.value({0.1 + 0.97 * 0.6, 0.2, 0.3 + 0.97 * 0.8}), 0) << "beyond the hole";
    }
}

TEST(Adaptive, TheSameBytesForAnyNumberOfThreads) {
    const Mesh meshes[] = {zoo::twisted_knot(60, 20), zoo::soup(40, 3), open_ball(4, 0.6)};
    for (const Mesh& mesh : meshes) {
        std::vector<std::byte> first;
        for (const int threads : {1, 2, 3}) {
            BuildOptions options = to_thickness(mesh, 0.01);
            options.run.threads = threads;
            const std::vector<std::byte> bytes = encode(build(mesh, options));
            if (first.empty()) first = bytes;
            EXPECT_TRUE(bytes == first) << threads << " threads";
        }
    }
}

TEST(Adaptive, FilesKeepAllOfAShell) {
    const Mesh mesh = zoo::overlapping_spheres(3);
    const ThinShell shell = build(mesh, to_thickness(mesh, 0.01));
    const std::vector<std::byte> bytes = encode(shell);
    const ThinShell again = decode(bytes);
    EXPECT_TRUE(encode(again) == bytes);
    EXPECT_TRUE(again.info().adaptive);
    EXPECT_EQ(again.info().thickness_asked, shell.info().thickness_asked);
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-2, 2);
    for (int i = 0; i < 1000; ++i) {
        const Vec3 p{uniform(random), uniform(random), uniform(random)};
        EXPECT_EQ(again.value(p), shell.value(p));
    }
}

TEST(Adaptive, WhereCellsDoNotSufficeTheShellSaysSo) {
    const Mesh mesh = zoo::twisted_knot(60, 20);
    BuildOptions options = to_thickness(mesh, 1e-3);
    options.max_cells = 20'000;
    const ThinShell shell = build(mesh, options);
    const ShellInfo& info = shell.info();
    EXPECT_LE(info.cells, 20'000u);
    EXPECT_GT(info.coarse_cells, 0u);
    EXPECT_GT(info.thickness(), options.thickness);
    EXPECT_LT(info.thickness(), 0.1 * longest_side(mesh));
    for (int axis = 0; axis < 3; ++axis) EXPECT_LT(info.coarse.min[axis], info.coarse.max[axis]);
    expect_verified("with too few cells", mesh, options);

    options.max_cells = 0;
    options.max_memory = 20'000'000;
    options.thickness /= 100;
    EXPECT_GT(build(mesh, options).info().coarse_cells, 0u);

    options = to_thickness(mesh, 1e-3);
    options.deepest = 6;
    const ThinShell shallow = build(mesh, options);
    EXPECT_EQ(shallow.info().depth, 6);
    EXPECT_GT(shallow.info().coarse_cells, 0u);
}

/// Off the origin, where a root cube that is not the lattice's would show.
TEST(SlowAdaptive, ShellsAreSoundWhereverTheLimitsStopThem) {
    Mesh mesh = zoo::torus(1, 0.35, 24, 12);
    for (Vec3& v : mesh.vertices) v = v + Vec3{0.37, 5.21, -3.83};
    for (const double thickness : {0.005, 0.1, 2.0})
        for (const std::uint64_t cells : {1, 73, 140, 600, 2000}) {
            BuildOptions options = to_thickness(mesh, thickness);
            options.max_cells = cells;
            SCOPED_TRACE(fmt::format("{} cells", cells));
            expect_verified("torus", mesh, options);
            EXPECT_GE(build(mesh, options).info().depth, least_adaptive_depth);
        }
    for (const int deepest : {3, 4, 5})
        for (const double thickness : {0.01, 0.1, 5.0}) {
            BuildOptions options = to_thickness(mesh, thickness);
            options.deepest = deepest;
            SCOPED_TRACE(fmt::format("depth {}", deepest));
            expect_verified("torus", mesh, options);
            const ThinShell shell = build(mesh, options);
            EXPECT_EQ(encode(decode(encode(shell))), encode(shell));
        }
    std::erase_if(mesh.triangles, [&](const Triangle& t) { return mesh.vertices[t[0]].x > 1.6; });
    for (const std::uint64_t cells : {1, 73, 600, 3000}) {
        BuildOptions options = to_thickness(mesh, 0.005, SignRule::generalized);
        options.max_cells = cells;
        expect_verified("open torus", mesh, options);
    }
}

TEST(Adaptive, TheMeshAloneMayBeTooMuch) {
    BuildOptions options = to_thickness(zoo::sphere({0, 0, 0}, 1, 5), 0.01);
    options.max_memory = 1'000'000;
    EXPECT_THROW((void)build(zoo::sphere({0, 0, 0}, 1, 5), options), MemoryError);
}

TEST(Adaptive, APlateThinnerThanItsShellNeedsSmallCells) {
    const Mesh plate = zoo::plate(0.01);
    BuildOptions options = to_thickness(plate, 0.004);
    options.max_cells = 100'000;
    const ThinShell shell = build(plate, options);
    EXPECT_LE(shell.info().cells, 100'000u);
    expect_verified("plate", plate, options);
}

TEST(Adaptive, WhatCannotBeIsRefused) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1, 2);
    const auto expect_refused = [&](auto&& change) {
        BuildOptions options = to_thickness(mesh, 0.01);
        change(options);
        EXPECT_THROW((void)build(mesh, options), OptionError);
    };
    expect_refused([](BuildOptions& o) { o.thickness = -1; });
    expect_refused([](BuildOptions& o) { o.thickness = std::nan(""); });
    expect_refused([](BuildOptions& o) { o.depth = 5; });
    expect_refused([](BuildOptions& o) { o.solver = Solver::lscg; });
    expect_refused([](BuildOptions& o) { o.extrema = Extrema::candidates; });
    expect_refused([](BuildOptions& o) { o.deepest = 21; });
    expect_refused([](BuildOptions& o) { o.deepest = 2; });
    expect_refused([](BuildOptions& o) { o.thickness = 0, o.depth = 5, o.max_cells = 1000; });
    expect_refused([](BuildOptions& o) { o.thickness = 0, o.depth = 5, o.deepest = 5; });
    expect_refused([](BuildOptions& o) { o.thickness = 1e-13; });
}

/// Many sheets across all of the box: under `unsigned` cells are as small as in a shell of one depth.
TEST(Adaptive, TheDefaultHasALimitOfCells) {
    Mesh soup;
    for (std::uint32_t i = 0; i < 60; ++i) {
        const double z = i / 60.0;
        for (const Vec3& v : {Vec3{0, 0, z}, Vec3{1, 0, z + 0.003}, Vec3{1, 1, z + 0.004}, Vec3{0, 1, z}})
            soup.vertices.push_back(v);
        soup.triangles.push_back({4 * i, 4 * i + 1, 4 * i + 2});
        soup.triangles.push_back({4 * i, 4 * i + 2, 4 * i + 3});
    }
    BuildOptions options;
    options.sign = SignRule::unsigned_rule;
    const ShellInfo info = build(soup, options).info();
    const std::uint64_t limit = default_max_cells + default_cells_per_triangle * soup.triangles.size();
    EXPECT_EQ(info.max_cells, limit);
    EXPECT_LE(info.cells, limit);
    EXPECT_GT(info.coarse_cells, 0u);
    EXPECT_GT(info.thickness(), info.thickness_asked);
    EXPECT_LT(info.thickness(), 8 * info.thickness_asked) << "cells were left unused";
}

TEST(Adaptive, SurfacesAreCertified) {
    for (const Mesh& mesh :
         {zoo::twisted_knot(40, 12), zoo::box({0, 0, 0}, {1, 2, 0.5}), zoo::overlapping_spheres(3)}) {
        const ThinShell shell = build(mesh, to_thickness(mesh, 0.02));
        for (const SurfaceSide side : {SurfaceSide::outer, SurfaceSide::inner}) {
            SurfaceOptions options;
            options.side = side;
            const Surface surface = extract_surface(shell, options);
            EXPECT_FALSE(surface.mesh.triangles.empty());
            EXPECT_EQ(inspect(surface.mesh).open_edges, 0u);
        }
    }
}

/// f and the trees of refine() for a criterion that has nothing to do with f.
TEST(Refine, RandomTreesAreSound) {
    const Mesh mesh = zoo::torus(1.0, 0.35, 24, 12);
    const octree::Lattice lattice = octree::make_nested_lattice(octree::bounds(mesh), 8, 3);
    std::vector<Vec3> positions;
    for (const Vec3& v : mesh.vertices) positions.push_back(lattice.to_lattice(v));
    const double infinity = std::numeric_limits<double>::infinity();
    for (const bool balanced : {true, false})
        for (std::uint64_t seed = 0; seed < 4; ++seed) {
            const adaptive::Refined refined =
                adaptive::refine({.lattice = lattice,
                                  .positions = positions,
                                  .mesh = mesh,
                                  .rule = SignRule::winding,
                                  .lower = -infinity,
                                  .upper = infinity,
                                  .least_depth = 2,
                                  .many_width = infinity,
                                  .balanced = balanced,
                                  .also =
                                      [&](int level, std::uint64_t code) {
                                          std::mt19937_64 random(code * 64 + std::uint64_t(level) + seed * 977);
                                          return level > 0 && random() % 3 == 0;
                                      }},
                                 {});
            const octree::Octree& octree = refined.octree;
            EXPECT_TRUE(octree.adaptive());
            std::uint64_t cells = 0;
            for (int k = 0; k <= octree.depth; ++k)
                for (std::uint64_t g = 0; g < octree.levels[std::size_t(k)].groups(); ++g) {
                    EXPECT_EQ(octree.surface_mask(k, g) & octree.subdivided_mask(k, g), 0u);
                    cells += std::uint64_t(std::popcount(octree.surface_mask(k, g)));
                }
            EXPECT_EQ(cells, octree.surface_cells());
            EXPECT_EQ(refined.offset.size(), cells + 1);
            EXPECT_EQ(refined.corners_inside.size(), cells);
            for (std::uint64_t c = 0; c < cells; ++c) {
                const octree::CellPlace place = octree.surface_place(c);
                EXPECT_TRUE(octree.surface_mask(place.level, place.group) >> place.child & 1);
                EXPECT_LT(refined.offset[c], refined.offset[c + 1]);
            }
        }
}

}  // namespace
}  // namespace its
