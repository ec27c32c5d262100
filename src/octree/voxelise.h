#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "its/mesh.h"

/// Conservative voxelisation by hierarchical descent.
namespace its::octree {

/// The finest cells that meet M, and the triangles that meet each.
struct Voxels {
    std::vector<std::uint64_t> cell;      ///< Morton codes, strictly ascending
    std::vector<std::uint64_t> offset;    ///< triangle[offset[i] … offset[i+1]) meet cell[i]; cell.size() + 1
    std::vector<std::uint32_t> triangle;  ///< ascending within a cell
};

/// All cells of level 0 whose closed box, dilated by `dilation` cell widths, meets a triangle.
///
/// Nothing that meets is missed: the separating-axis test dilates the box further by its own rounding error.
/// A cell may be reported though it is apart by no more than that.
/// \param positions  vertices in lattice coordinates, all in the root cube of 2^(depth+1) cells a side
/// \param before_level  called with (level, cells, pairs) before each level's arrays are taken: the numbers of
/// the
///                      level above; may throw to refuse
Voxels voxelise(
    std::span<const Vec3> positions, std::span<const Triangle> triangles, int depth, double dilation,
    const Progress& progress,
    const std::function<void(int level, std::uint64_t cells, std::uint64_t pairs)>& before_level = {});

/// One step of it: the cells of `level` that triangles meet, of those in which some cells of level + 1 are
/// halved. Cells and lists of `above` may be any; of depth `depth`.
Voxels halve(const Voxels& above, std::span<const Vec3> positions, std::span<const Triangle> triangles,
             int level, int depth, double dilation);

/// Bit c is set if the triangle meets child c of the cell with this centre; children are cubes of half width
/// `half`, each dilated by `dilation`, which must contain 8u·2ᴷ⁺¹ for rounding. Exposed for tests.
unsigned children_met(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& centre, double half,
                      double dilation, double size);

}  // namespace its::octree
