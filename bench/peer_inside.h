#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "its/mesh.h"

/// Peers that say whether points are inside a mesh; each in a source file of its own.
namespace its::bench {

class InsidePeer {
public:
    InsidePeer() = default;
    InsidePeer(const InsidePeer&) = delete;
    InsidePeer& operator=(const InsidePeer&) = delete;
    virtual ~InsidePeer() = default;
    /// One point after the other on the calling thread: −1 inside, 0 on the surface, 1 outside.
    virtual void classify(std::span<const Vec3> points, std::span<std::int8_t> out) const = 0;
};

/// Parity of the hits of a ray from each point, robust mode (single precision, as Embree is).
std::unique_ptr<InsidePeer> embree_parity(const Mesh& mesh);
/// Closest triangle by rtcPointQuery; inside by the side of its plane: wrong where the closest point is on an
/// edge.
std::unique_ptr<InsidePeer> embree_point_query(const Mesh& mesh);
/// Side_of_triangle_mesh with exact predicates: the reference for accuracy.
std::unique_ptr<InsidePeer> cgal_side(const Mesh& mesh);
/// meshToVolume at this voxel size, then the sign of a linear sampler.
std::unique_ptr<InsidePeer> openvdb_sampler(const Mesh& mesh, double voxel);

}  // namespace its::bench
