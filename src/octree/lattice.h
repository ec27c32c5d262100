#pragma once

#include <array>
#include <cstdint>

#include "its/mesh.h"

/// The lattice of finest cells. Lattice coordinates count cell widths from the root cube's lower corner.
namespace its {

/// Every lattice position (base + i)·width is an exact double: base + i and width share 53 bits.
struct Lattice {
    int depth = 0;                           ///< K
    double width = 0;                        ///< w, the finest cell, mesh units
    std::array<std::int64_t, 3> base = {};   ///< root cube's lower corner, in cell widths from (0, 0, 0)

    double scale() const { return width * double(std::uint64_t{1} << depth); }     ///< s
    std::uint32_t cells() const { return std::uint32_t{2} << depth; }              ///< per side of the root

    /// The exact position of lattice point i, 0 ≤ i ≤ cells().
    double position(int axis, std::int64_t i) const { return double(base[axis] + i) * width; }
    Vec3 position(const std::array<std::int64_t, 3>& i) const {
        return {position(0, i[0]), position(1, i[1]), position(2, i[2])};
    }

    /// Lattice coordinates of a point: one subtraction and one division, both rounded.
    Vec3 to_lattice(const Vec3& p) const {
        return {(p.x - position(0, 0)) / width, (p.y - position(1, 0)) / width, (p.z - position(2, 0)) / width};
    }
};

/// The lattice of a mesh at depth K. Its scale is at least the longest side of the mesh's bounds, and larger
/// by less than 2⁻⁷ of it (2⁻²³ unless the mesh is far from the origin for its size).
/// \throws InputError if the mesh is so far from the origin that lattice positions cannot be exact.
Lattice make_lattice(const Mesh& mesh, int depth);

}  // namespace its
