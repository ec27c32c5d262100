#pragma once

#include <cstdint>
#include <vector>

#include "its/mesh.h"
#include "surface/cell_surface.h"
#include "wrap/distance_proof.h"
#include "wrap/offset_tree.h"

/// A surface between two distances from M, as a mesh, with the proof.
namespace its::wrapper {

struct OffsetSurface {
    Mesh mesh;
    DistanceRange range{0, 0};  ///< proven; of an empty one {0, 0}
    std::uint64_t cells = 0;    ///< that it runs through
    int passes = 0;
    std::uint64_t mesh_components = 0, components = 0;  ///< triangles that share vertices
};

/// What is asked of it. Lengths in mesh units.
struct OffsetDemand {
    const mesh::Arrays& mesh;
    surface::SurfaceFrame frame;  ///< level 0
    bool inner = false;
    DistanceRange limits;  ///< of unsigned distances
};

/// Cells of the tree are halved until every triangle is proven to keep the limits, every part of M is enclosed
/// (inner: every part of the surface), and the surface is on its side of M.
/// \throws OptionError if the finest cells do not do
OffsetSurface make_offset_surface(const OffsetDemand& demand, const OffsetTask& task, OffsetTree& tree,
                                  surface::MemoryGuard& guard, const Progress& progress);

}  // namespace its::wrapper
