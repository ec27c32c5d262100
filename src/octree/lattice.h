#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "base/rounding.h"
#include "mesh/arrays.h"

/// The lattice of finest cells. Lattice coordinates count cell widths from the root cube's lower corner.
namespace its::octree {

/// A root cube of side 2s is 2ᴷ⁻¹ cells off M all around, and that is what f is there at least. Outer surfaces
/// have levels of up to √3/2 cells (f on M is a mean of distances to the corners of a cell), and a move that
/// is bounded by what f can bend in a cell: at K = 0 and 1 the root cube has the side 8w, 3 cells or more
/// around M.
inline constexpr int least_levels = 2;

/// Every lattice position is an exact double: the index and the width together have at most 53 bits.
struct Lattice {
    int depth = 0;                          ///< levels between the finest and the root
    int room = 0;                           ///< of these, how many more than K; see least_levels
    double width = 0;                       ///< w, the finest cell, mesh units
    std::array<std::int64_t, 3> base = {};  ///< the root cube's lower corner, in quarters of w from (0, 0, 0)

    int resolution_depth() const { return depth - room; }                                 ///< K
    std::uint32_t scale_cells() const { return std::uint32_t{1} << resolution_depth(); }  ///< along s
    double scale() const { return width * double(scale_cells()); }                        ///< s = 2ᴷw
    std::uint32_t cells() const { return std::uint32_t{2} << depth; }  ///< per side of the root

    /// The exact position of lattice point i, 0 ≤ i ≤ cells().
    double position(int axis, std::int64_t i) const { return double(base[axis] + 4 * i) * (0.25 * width); }
    Vec3 position(const std::array<std::int64_t, 3>& i) const {
        return {position(0, i[0]), position(1, i[1]), position(2, i[2])};
    }

    /// Lattice coordinates of a point: one subtraction and one division. For a point of the root cube each
    /// is wrong by at most mapping_error().
    Vec3 to_lattice(const Vec3& p) const {
        return {(p.x - position(0, 0)) / width, (p.y - position(1, 0)) / width, (p.z - position(2, 0)) / width};
    }

    /// 2u·2ᴷ⁺¹ cell widths: two roundings, each of relative error u, of a number of at most 2ᴷ⁺¹.
    double mapping_error() const { return 2 * unit_roundoff * cells(); }

    /// Values of f in the root cube, distances there and their bounds are smaller, in cell widths: M lies in
    /// the cube, the diagonal of which is √3·cells(). The rest, 0.26·cells(), is more than roundings and a
    /// solver's residual can add.
    double largest_value() const { return 2.0 * cells(); }

    /// The largest coordinate in the root cube, in cell widths.
    double reach() const {
        double largest = 0;
        for (const std::int64_t b : base)
            largest = std::max({largest, std::abs(double(b)), std::abs(double(b) + 4.0 * cells())});
        return 0.25 * largest;
    }

    /// How far, in cell widths per axis, a point of M and the lattice coordinates of the same point as a
    /// caller gives it may differ: 4u·reach() for the caller's rounding of the point (a point of a triangle is
    /// seldom a double), and one mapping each for the query and for the mesh's vertices.
    double point_error() const { return 4 * unit_roundoff * reach() + 2 * mapping_error(); }

    /// Surface cells list the triangles that meet them dilated by this, and local bounds hold there: the
    /// points' errors, and as much again as others lose, such as the verifier, who cut M at the cell's faces
    /// with roundings of their own. M can graze a face and be this near to it far beyond the cell.
    double dilation() const { return point_error() + 128 * unit_roundoff * cells(); }
};

/// Bounds of the triangles' vertices. Precondition: at least one triangle, indices in range.
Box bounds(const mesh::Arrays& mesh);

/// \throws InputError unless a lattice can have this size: [1e-75, 1e75], outside which exact predicates could
/// overflow.
void require_size(const Box& bounds);

/// The lattice of a mesh at depth K. Its scale is at least the longest side of the mesh's bounds, and larger
/// by less than 2⁻⁷ of it (2⁻²³ unless the mesh is far from the origin for its size).
/// \throws InputError as require_size(), or if the mesh is so far from the origin that lattice positions cannot
/// be exact
Lattice make_lattice(const Box& bounds, int depth);

/// The same for an octree whose levels below `coarsest` may be left out: lattice points of all depths from
/// `coarsest` to `depth` are o + i·s·2⁻ᴷ, with the same o and s. Precondition: 2 ≤ coarsest ≤ depth.
Lattice make_nested_lattice(const Box& bounds, int depth, int coarsest);

/// The lattice of the same root cube with `levels` levels fewer. Precondition: made by make_nested_lattice(),
/// not coarser than it was made for.
Lattice coarser(const Lattice& lattice, int levels);

/// The largest K up to `most` that make_lattice() takes, but for the size; 0 if none.
int deepest_lattice(const Box& bounds, int most);

}  // namespace its::octree
