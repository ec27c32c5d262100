#include "signs/signs.h"

#include <utility>

#include "base/progress.h"
#include "its/inspect.h"
#include "mesh/arrays.h"

namespace its::signs {

Signs::Signs(SignRule rule, const mesh::Arrays& mesh, const octree::Lattice& lattice, octree::Voxels& voxels,
             const Progress& progress, std::optional<winding::Filling> filling)
    : rule_(rule) {
    if (rule == SignRule::unsigned_rule) return;
    if (rule != SignRule::generalized) {
        lines_.emplace(mesh, lattice, voxels, progress);
        return;
    }
    Parts parts(progress);
    generalized_.emplace(mesh, lattice, voxels, parts.until(0.2), std::move(filling));
    generalized_->add_flip_cells(voxels, parts.until(1));
}

CellSides Signs::apply(const octree::Octree& octree, std::vector<std::vector<double>>& distance,
                       const Progress& progress) const {
    if (lines_) return apply_signs(octree, *lines_, rule_, distance);
    if (generalized_) generalized_->apply(octree, distance, progress);
    return no_inside(octree);
}

}  // namespace its::signs
