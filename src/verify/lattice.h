#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "its/base.h"
#include "octree/lattice.h"

/// The verifier's own arithmetic of lattice positions, cells and their codes.
namespace its::verifier {

inline constexpr double roundoff = 0x1p-53;  ///< u

/// Integer coordinates of a cell within its level.
using Cell = std::array<std::uint32_t, 3>;

inline constexpr std::uint64_t no_group = ~std::uint64_t{0};

/// Grid points of a sibling group: index x + 3y + 9z, each in {0, 1, 2}.
inline constexpr int points_of_group = 27;

/// Of the 27 points, corner `corner` of child `child`, both numbered x + 2y + 4z.
inline int group_point(int child, int corner) {
    int index = 0;
    for (int axis = 2; axis >= 0; --axis) index = 3 * index + (child >> axis & 1) + (corner >> axis & 1);
    return index;
}

namespace detail {
/// Each byte with its bits three apart.
inline constexpr std::array<std::uint32_t, 256> spread = [] {
    std::array<std::uint32_t, 256> table = {};
    for (std::uint32_t byte = 0; byte < 256; ++byte)
        for (std::uint32_t bit = 0; bit < 8; ++bit) table[byte] |= (byte >> bit & 1) << (3 * bit);
    return table;
}();
}  // namespace detail

/// The bits of x, y and z in turn, x lowest: 21 of each.
inline std::uint64_t interleave(const Cell& cell) {
    std::uint64_t code = 0;
    for (unsigned axis = 0; axis < 3; ++axis)
        for (unsigned byte = 0; byte < 3; ++byte)
            code |= std::uint64_t{detail::spread[cell[axis] >> (8 * byte) & 255]} << (24 * byte + axis);
    return code & ((std::uint64_t{1} << 63) - 1);
}

inline Cell separate(std::uint64_t code) {
    Cell cell = {};
    for (unsigned bit = 0; code != 0; ++bit, code >>= 3)
        for (unsigned axis = 0; axis < 3; ++axis) cell[axis] |= std::uint32_t(code >> axis & 1) << bit;
    return cell;
}

/// The lattice of finest cells as the file gives it: depth, width, and the lower corner in quarters of the
/// width.
class Lattice {
public:
    explicit Lattice(const octree::Lattice& given)
        : depth(given.depth),
          room(given.room),
          width(given.width),
          base_(given.base),
          origin_(position({0, 0, 0})) {}

    int depth;  ///< levels between the finest and the root
    int room;   ///< of these, how many more than K: the root is 2^(1 + room) times the scale
    double width;

    std::int64_t cells() const { return std::int64_t{2} << depth; }
    double scale() const { return std::ldexp(width, depth - room); }
    double side() const { return std::ldexp(width, depth + 1); }

    /// Exact: index and width together have at most 53 bits.
    double position(int axis, std::int64_t i) const {
        return double(base_[std::size_t(axis)] + 4 * i) * (0.25 * width);
    }
    Vec3 position(const std::array<std::int64_t, 3>& i) const {
        return {position(0, i[0]), position(1, i[1]), position(2, i[2])};
    }

    /// In cells from the lower corner: two roundings.
    Vec3 to_lattice(const Vec3& p) const {
        return {(p.x - origin_.x) / width, (p.y - origin_.y) / width, (p.z - origin_.z) / width};
    }
    Vec3 from_lattice(const Vec3& p) const {
        return {origin_.x + width * p.x, origin_.y + width * p.y, origin_.z + width * p.z};
    }

    /// The largest coordinate in the root cube, in cell widths.
    double reach() const {
        double largest = 0;
        for (const std::int64_t b : base_)
            largest = std::max({largest, std::abs(double(b)), std::abs(double(b) + 4.0 * double(cells()))});
        return 0.25 * largest;
    }

    /// One unit in the last place of a coordinate in the upper half of the root, in cell widths: 2^(K − 52),
    /// which is u times the root's side.
    double ulp() const { return std::ldexp(1.0, depth - 52); }

    /// The file's promise: cells are marked, and list the triangles, where M meets them dilated by this; local
    /// bounds hold there. In cell widths.
    double dilation() const { return 4 * roundoff * reach() + (4 + 128) * ulp(); }

private:
    std::array<std::int64_t, 3> base_;
    Vec3 origin_;
};

}  // namespace its::verifier
