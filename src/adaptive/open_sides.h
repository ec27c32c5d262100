#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "its/mesh.h"
#include "mesh/arrays.h"
#include "octree/lattice.h"
#include "octree/morton.h"
#include "octree/octree.h"
#include "signs/hole_points.h"
#include "winding/filling.h"

/// Sides under the sign rule generalized, on an octree that grows. See docs/design/signs.md.
namespace its::adaptive {

/// M and the surface F that closes it, whose winding numbers are whole; and where inside and outside meet in
/// holes, on a lattice that is as fine as they are to be closed.
class OpenSides {
public:
    /// \param flip_level  level of the lattice whose cells close the holes
    /// \param filling     of this mesh, where it is there already
    OpenSides(const mesh::Arrays& mesh, const octree::Lattice& lattice, int flip_level,
              const Progress& progress, std::optional<winding::Filling> filling = {});

    /// M's triangles, then F's.
    const Mesh& closed() const { return closed_; }
    std::uint32_t triangles_of_mesh() const { return triangles_of_mesh_; }
    int flip_level() const { return flip_level_; }

    /// Cells of the flip level, or finer ones, that meet no triangle of M and have corners on both sides.
    bool flips_in(int level, std::uint64_t code) const;

    /// The distance to where inside and outside meet in a hole, at corners of such cells, in finest cells;
    /// infinite at all other points.
    double to_flip(const std::array<std::uint64_t, 3>& point) const;

    /// Bit i: point i is inside.
    /// \param winding  of M and F together, exact
    std::uint32_t inside(std::span<const Vec3> points, std::span<const std::int32_t> winding) const;

private:
    bool decide_exactly(const Vec3& p, std::int32_t winding) const;

    int flip_level_;
    std::uint32_t triangles_of_mesh_;
    Box bounds_;
    winding::Filling filling_;
    Mesh closed_;
    std::vector<std::uint64_t> flips_;  ///< Morton codes of cells of the flip level, ascending
    signs::HolePoints holes_;           ///< on the lattice of the flip level
};

}  // namespace its::adaptive
