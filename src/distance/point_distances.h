#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "distance/packet.h"

/// Distances to M from points of a small cube, without an octree above it.
namespace its::distance {

/// The triangle tree, and where it has each triangle of the mesh.
struct SearchTree {
    TriangleTree tree;
    std::vector<std::uint32_t> slot;  ///< of each triangle of the mesh
    double size;                      ///< bound on all coordinates

    SearchTree(std::span<const Vec3> positions, std::span<const Triangle> triangles, double coordinates);
};

/// One thread's search. Equal positions get equal bits, those of grid_distances(), whichever cube they are in.
class PointDistances {
public:
    explicit PointDistances(const SearchTree& search);

    /// Begins with a cube of this centre and half side.
    void begin(const Vec3& centre, double half);

    /// Another point of the cube, 27 at most.
    /// \param bound  at least its distance; may be infinite
    void add(const Vec3& point, double bound);

    /// Finds all distances.
    /// \param near  triangles of the mesh that are near the cube; may be empty
    void solve(std::span<const std::uint32_t> near);

    /// Of the point that was added as number i.
    double distance(int i) const;

private:
    void improve_by_nearest_block();
    void open_nodes(std::uint32_t level, std::uint32_t first_block, double farthest);

    struct Near {
        std::uint32_t triangle;
        double distance;
    };

    const SearchTree& search_;
    double slack_;
    Vec3 centre_;
    double half_ = 0;
    Packet packet_;
    Entries entries_;
    std::vector<Near> near_;
    std::array<std::uint32_t, lanes> seed_;
    int seeds_ = 0;
};

}  // namespace its::distance
