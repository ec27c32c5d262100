#pragma once

#include <optional>
#include <vector>

#include "its/inspect.h"
#include "mesh/arrays.h"
#include "signs/generalized.h"
#include "signs/winding_lines.h"

namespace its::signs {

/// The sign of distances by any rule, in two steps: before the octree is made from the cells, and when the
/// distances are there.
class Signs {
public:
    /// \param voxels  receives further finest cells, without triangles: where inside and outside meet in a hole
    /// \param filling  of this mesh, where it is there already
    Signs(SignRule rule, const mesh::Arrays& mesh, const octree::Lattice& lattice, octree::Voxels& voxels,
          const Progress& progress, std::optional<winding::Filling> filling = {});

    /// Makes distances inside negative. The sides of cells are left out for the rules that have no whole
    /// winding numbers.
    CellSides apply(const octree::Octree& octree, std::vector<std::vector<double>>& distance,
                    const Progress& progress) const;

private:
    SignRule rule_;
    std::optional<WindingLines> lines_;            ///< winding, even_odd
    std::optional<GeneralizedSigns> generalized_;  ///< generalized
};

}  // namespace its::signs
