#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "adaptive/refine.h"
#include "distance/grid_distance.h"
#include "its/inspect.h"
#include "octree/lattice.h"
#include "octree/voxelise.h"
#include "signs/signs.h"
#include "support/zoo.h"

namespace its {
namespace {

std::vector<Vec3> lattice_positions(const Mesh& mesh, const octree::Lattice& lattice) {
    std::vector<Vec3> positions;
    for (const Vec3& v : mesh.vertices) positions.push_back(lattice.to_lattice(v));
    return positions;
}

/// What refine() makes where all surface cells are to be of one depth, against what a build at that depth
/// makes.
void expect_same(const std::string& name, const Mesh& mesh, SignRule rule, int depth) {
    SCOPED_TRACE(name + ", depth " + std::to_string(depth));
    const octree::Lattice lattice = octree::make_lattice(octree::bounds(mesh), depth);
    const std::vector<Vec3> positions = lattice_positions(mesh, lattice);
    octree::Voxels voxels = octree::voxelise(positions, mesh.triangles, lattice.depth, lattice.dilation(), {});
    const signs::Signs signs(rule, mesh, lattice, voxels, {});
    const octree::Octree octree = octree::make_octree(lattice.depth, voxels.cell);
    std::vector<std::vector<double>> distance = distance::grid_distances(octree, positions, mesh.triangles, {});
    const signs::CellSides sides = signs.apply(octree, distance, {});

    const double infinity = std::numeric_limits<double>::infinity();
    const adaptive::Refined refined = adaptive::refine({.lattice = lattice,
                                                        .positions = positions,
                                                        .mesh = mesh,
                                                        .rule = rule,
                                                        .lower = -infinity,
                                                        .upper = infinity,
                                                        .least_depth = lattice.depth,
                                                        .many_width = infinity},
                                                       {});
    ASSERT_EQ(refined.depth, lattice.depth);
    for (std::size_t k = 0; k < octree.levels.size(); ++k) {
        SCOPED_TRACE(k);
        ASSERT_EQ(refined.octree.levels[k].parent, octree.levels[k].parent);
        EXPECT_EQ(refined.octree.levels[k].mask, octree.levels[k].mask);
        EXPECT_EQ(refined.values[k], distance[k]);
        EXPECT_EQ(refined.sides.inside[k], sides.inside[k]);
    }
    EXPECT_EQ(refined.offset, voxels.offset);
    EXPECT_EQ(refined.triangle, voxels.triangle);
    EXPECT_TRUE(refined.coarse.empty());
    if (!sides.winding.empty()) {
        EXPECT_EQ(refined.sides.winding, sides.winding);
    }
}

TEST(Refine, OnAUniformTreeTheResultIsThatOfABuildAtADepth) {
    for (const zoo::Entry& entry : zoo::all())
        for (const int depth : {2, 4, 5}) {
            expect_same(entry.name, entry.mesh, SignRule::unsigned_rule, depth);
            if (entry.closed_oriented) {
                expect_same(entry.name, entry.mesh, SignRule::winding, depth);
                expect_same(entry.name, entry.mesh, SignRule::even_odd, depth);
            }
        }
}

}  // namespace
}  // namespace its
