#include "octree/octree.h"

#include <gtest/gtest.h>
#include <bit>
#include <random>
#include <set>

#include "geometry/clip.h"
#include "geometry/vec3.h"
#include "octree/lattice.h"
#include "octree/voxelise.h"
#include "support/zoo.h"

namespace its {
namespace {

TEST(Morton, RoundTripAndOrderOfChildren) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 10000; ++i) {
        const octree::Cell cell = {std::uint32_t(random() & 0x1fffff), std::uint32_t(random() & 0x1fffff),
                                   std::uint32_t(random() & 0x1fffff)};
        EXPECT_EQ(octree::morton_decode(octree::morton_encode(cell)), cell);
        EXPECT_EQ(octree::morton_encode(cell) >> 3,
                  octree::morton_encode({cell[0] >> 1, cell[1] >> 1, cell[2] >> 1}));
    }
    EXPECT_EQ(octree::morton_encode({1, 0, 0}), 1u);
    EXPECT_EQ(octree::morton_encode({0, 1, 0}), 2u);
    EXPECT_EQ(octree::morton_encode({0, 0, 1}), 4u);
}

std::vector<Vec3> lattice_positions(const Mesh& mesh, const octree::Lattice& lattice) {
    std::vector<Vec3> positions;
    for (const Vec3& v : mesh.vertices) positions.push_back(lattice.to_lattice(v));
    return positions;
}

/// Every cell of the bounding boxes of the triangles against the clip: cells that a triangle meets by more than
/// 1e-9 must be there, cells that none comes within 1e-9 of must not.
void compare_with_clipping(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                           int depth) {
    const octree::Voxels voxels = octree::voxelise(positions, triangles, depth, 1e-13, {});
    std::set<std::pair<std::uint64_t, std::uint32_t>> found;
    for (std::size_t c = 0; c < voxels.cell.size(); ++c)
        for (std::uint64_t p = voxels.offset[c]; p < voxels.offset[c + 1]; ++p)
            found.insert({voxels.cell[c], voxels.triangle[p]});
    EXPECT_EQ(found.size(), voxels.triangle.size());
    const std::int64_t side = std::int64_t{2} << depth;
    std::size_t allowed = 0;
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        const Vec3 a = positions[triangles[t][0]], b = positions[triangles[t][1]],
                   c = positions[triangles[t][2]];
        std::int64_t low[3], high[3];
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::max<std::int64_t>(std::int64_t(std::min({a[axis], b[axis], c[axis]})) - 1, 0);
            high[axis] =
                std::min<std::int64_t>(std::int64_t(std::max({a[axis], b[axis], c[axis]})) + 1, side - 1);
        }
        for (std::int64_t z = low[2]; z <= high[2]; ++z)
            for (std::int64_t y = low[1]; y <= high[1]; ++y)
                for (std::int64_t x = low[0]; x <= high[0]; ++x) {
                    const Vec3 corner{double(x), double(y), double(z)};
                    const std::pair key{
                        octree::morton_encode({std::uint32_t(x), std::uint32_t(y), std::uint32_t(z)}), t};
                    const bool is_found = found.count(key) > 0;
                    const bool met = geometry::clip_to_cell(a - corner, b - corner, c - corner, -1e-9).size > 0;
                    ASSERT_TRUE(is_found || !met) << "triangle " << t << " at " << x << ' ' << y << ' ' << z;
                    const bool near = geometry::clip_to_cell(a - corner, b - corner, c - corner, 1e-9).size > 0;
                    ASSERT_TRUE(near || !is_found) << "triangle " << t << " at " << x << ' ' << y << ' ' << z;
                    allowed += is_found;
                }
    }
    EXPECT_EQ(allowed, found.size()) << "no pair outside the triangles' boxes";
}

TEST(Voxelise, AgreesWithClippingOnTheZoo) {
    for (const auto& entry : zoo::all()) {
        if (entry.mesh.triangles.size() > 5000) continue;
        SCOPED_TRACE(entry.name);
        for (const int depth : {0, 2, 5}) {
            const octree::Lattice lattice = octree::make_lattice(octree::bounds(entry.mesh), depth);
            compare_with_clipping(lattice_positions(entry.mesh, lattice), entry.mesh.triangles, lattice.depth);
        }
    }
}

TEST(Voxelise, AgreesWithClippingOnRandomTriangles) {
    std::mt19937_64 random(7);
    const int depth = 5;
    std::uniform_real_distribution<double> anywhere(1, 63);
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
    for (std::uint32_t i = 0; i < 300; ++i) {
        for (int corner = 0; corner < 3; ++corner) {
            Vec3 p{anywhere(random), anywhere(random), anywhere(random)};
            if (i % 3 == 1) p = {std::round(p.x), std::round(p.y), std::round(p.z)};  // on the lattice
            if (i % 7 == 2 && corner > 0) p = positions[positions.size() - 1];        // degenerate
            if (i % 5 == 3 && corner == 2) p = 0.5 * (positions[3 * i] + positions[3 * i + 1]);  // collinear
            positions.push_back(p);
        }
        triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    compare_with_clipping(positions, triangles, depth);
}

TEST(Voxelise, AFaceOnALatticePlaneBelongsToBothSides) {
    const std::vector<Vec3> positions = {{1.25, 1.25, 2}, {1.75, 1.25, 2}, {1.25, 1.75, 2}};
    const octree::Voxels voxels = octree::voxelise(positions, std::vector<Triangle>{{0, 1, 2}}, 1, 1e-13, {});
    const std::vector<std::uint64_t> expected = {octree::morton_encode({1, 1, 1}),
                                                 octree::morton_encode({1, 1, 2})};
    EXPECT_EQ(voxels.cell, expected);
}

std::uint64_t brute_force_grid_points(const octree::Octree& octree) {
    std::uint64_t total = 0;
    for (const octree::Level& level : octree.levels) {
        std::set<octree::Cell> points;
        for (const std::uint64_t parent : level.parent) {
            const octree::Cell at = octree::morton_decode(parent);
            for (std::uint32_t p = 0; p < octree::group_points; ++p)
                points.insert({2 * at[0] + p % 3, 2 * at[1] + p / 3 % 3, 2 * at[2] + p / 9});
        }
        total += points.size();
    }
    return total;
}

TEST(Octree, IsTheClosureOfItsSurfaceCells) {
    for (const auto& entry : zoo::all()) {
        const int depth = 5;
        const octree::Lattice lattice = octree::make_lattice(octree::bounds(entry.mesh), depth);
        const octree::Voxels voxels =
            octree::voxelise(lattice_positions(entry.mesh, lattice), entry.mesh.triangles, lattice.depth,
                             lattice.point_error(), {});
        const octree::Octree octree = octree::make_octree(lattice.depth, voxels.cell);
        ASSERT_EQ(octree.levels.size(), std::size_t(depth) + 1);
        EXPECT_EQ(octree.surface_cells(), voxels.cell.size());
        EXPECT_EQ(octree.levels[depth].parent, std::vector<std::uint64_t>{0});
        std::set<std::uint64_t> marked(voxels.cell.begin(), voxels.cell.end());
        for (const octree::Level& level : octree.levels) {
            std::set<std::uint64_t> parents;
            for (const std::uint64_t cell : marked) parents.insert(cell >> 3);
            ASSERT_EQ(std::vector<std::uint64_t>(parents.begin(), parents.end()), level.parent);
            std::uint64_t before = 0;
            for (std::uint64_t g = 0; g < level.groups(); ++g) {
                EXPECT_EQ(level.first[g], before);
                for (std::uint64_t child = 0; child < 8; ++child)
                    EXPECT_EQ(level.mask[g] >> child & 1, int(marked.count(level.parent[g] << 3 | child)));
                before += std::uint64_t(std::popcount(level.mask[g]));
            }
            EXPECT_EQ(level.first.back(), before);
            marked = std::move(parents);
        }
        EXPECT_EQ(octree::count_grid_points(octree), brute_force_grid_points(octree));
        for (std::uint64_t cell = 0; cell < voxels.cell.size(); cell += 7) {
            const octree::CellPlace place = octree.surface_place(cell);
            EXPECT_EQ(octree.levels[0].parent[place.group] << 3 | std::uint64_t(place.child),
                      voxels.cell[cell]);
        }
        EXPECT_EQ(octree.find(depth, 0), 0u);
        EXPECT_EQ(octree.find(depth, 1), octree::no_group);
    }
}

}  // namespace
}  // namespace its
