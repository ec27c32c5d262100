#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "its/inspect.h"
#include "mesh/arrays.h"
#include "octree/lattice.h"
#include "octree/octree.h"
#include "octree/voxelise.h"
#include "signs/cell_sides.h"

/// Integer winding numbers of lattice points.
namespace its::signs {

/// The signed crossings of M with all lattice lines parallel to x, as running sums along each line.
///
/// A lattice point is displaced by an infinitesimal vector, the same for all, so that no line meets a vertex or
/// edge; exact predicates then count every crossing once (geometry/predicates.h). Where M is a cycle, the
/// winding number of a point off M is the sum of the crossings before it. Where every edge is used an even
/// number of times, its parity is that of the number of triangles between the point and infinity.
class WindingLines {
public:
    /// \param voxels  of the same mesh and lattice: a lattice edge is tested against the triangles of the one
    ///                finest cell that has it as its lowest x edge, which include all that can cross it
    WindingLines(const mesh::Arrays& mesh, const octree::Lattice& lattice, const octree::Voxels& voxels,
                 const Progress& progress);

    /// The same for a mesh whose triangles are in no cells: each is drawn onto the lines that it meets.
    /// \param like  lines of the same lattice: only those that it covers are kept
    WindingLines(const mesh::Arrays& surface, const octree::Lattice& lattice, const WindingLines& like,
                 const Progress& progress);

    /// Winding numbers of the three points (x, y, z), (x + step, y, z), (x + 2·step, y, z).
    void winding(std::int64_t x, std::int64_t y, std::int64_t z, std::int64_t step,
                 std::int32_t (&out)[3]) const;

    std::uint64_t crossings() const { return crossing_.size(); }

    /// Bytes that the lines of a lattice region take before any crossing is stored.
    static std::uint64_t table_bytes(std::uint64_t rows, std::uint64_t columns) {
        return 8 * (rows * columns + 1);
    }

private:
    struct Event {
        std::uint64_t line;
        std::uint32_t x;
        std::int32_t sign;
    };
    struct Crossing {
        std::uint32_t x;       ///< the first lattice point beyond it
        std::int32_t winding;  ///< from here on
    };
    void gather(const std::vector<std::vector<Event>>& found);
    void draw(const mesh::Arrays& surface, const Triangle& t, const octree::Lattice& lattice,
              std::vector<Event>& found) const;

    std::int64_t y_begin_ = 0, y_count_ = 0, z_begin_ = 0, z_count_ = 0;
    std::vector<std::uint64_t> first_;  ///< per line (y fastest), and the total
    std::vector<Crossing> crossing_;    ///< by line, then by x
};

/// Gives distances their sign, and says which cells are inside. winding: negative where the winding number is
/// at least 1; even_odd: where it is odd, as is then the number of crossings, whatever their directions. Of
/// even_odd, CellSides keeps numbers modulo 2.
CellSides apply_signs(const octree::Octree& octree, const WindingLines& lines, SignRule rule,
                      std::vector<std::vector<double>>& distance);

}  // namespace its::signs
