#pragma once

#include <array>
#include <cstdint>

/// Morton codes: the bits of x, y, z interleaved, x lowest. A cell's eight children follow it as
/// (code << 3) | child, child = x + 2y + 4z.
namespace its::octree {

using Cell = std::array<std::uint32_t, 3>;  ///< integer coordinates of a cell within its level

inline constexpr std::uint64_t spread_bits(std::uint64_t v) {  // 21 bits, two zeros between any two
    v &= 0x1fffff;
    v = (v | v << 32) & 0x1f00000000ffff;
    v = (v | v << 16) & 0x1f0000ff0000ff;
    v = (v | v << 8) & 0x100f00f00f00f00f;
    v = (v | v << 4) & 0x10c30c30c30c30c3;
    v = (v | v << 2) & 0x1249249249249249;
    return v;
}

inline constexpr std::uint32_t gather_bits(std::uint64_t v) {
    v &= 0x1249249249249249;
    v = (v | v >> 2) & 0x10c30c30c30c30c3;
    v = (v | v >> 4) & 0x100f00f00f00f00f;
    v = (v | v >> 8) & 0x1f0000ff0000ff;
    v = (v | v >> 16) & 0x1f00000000ffff;
    v = (v | v >> 32) & 0x1fffff;
    return static_cast<std::uint32_t>(v);
}

inline constexpr std::uint64_t morton_encode(const Cell& cell) {
    return spread_bits(cell[0]) | spread_bits(cell[1]) << 1 | spread_bits(cell[2]) << 2;
}

inline constexpr Cell morton_decode(std::uint64_t code) {
    return {gather_bits(code), gather_bits(code >> 1), gather_bits(code >> 2)};
}

}  // namespace its::octree
