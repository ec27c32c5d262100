#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "shell/shell_data.h"

/// The parts of an .its file, for its writer and its reader; docs/design/file-format.md has the layout.
namespace its::shell_file {

static_assert(std::endian::native == std::endian::little, "the .its format is little-endian");
static_assert(sizeof(Vec3) == 24 && sizeof(Triangle) == 12, "meshes are written as they lie in memory");

// A byte with bit 7 and both line ends, as in PNG: files mangled by text-mode copies do not pass.
inline constexpr std::array<unsigned char, 8> magic = {0x89, 'I', 'T', 'S', '\r', '\n', 0x1a, '\n'};
inline constexpr std::uint32_t version = 3;  // what is written; 1 and 2 are read too
inline constexpr std::uint32_t byte_order = 0x01020304;
inline constexpr std::uint64_t alignment = 64;  // a cache line, and any element's own alignment

struct Header {
    std::array<unsigned char, 8> magic;
    std::uint32_t version;
    std::uint32_t byte_order;
    std::uint64_t file_bytes;
    std::uint32_t header_bytes;  // this struct and the section table
    std::uint32_t sections;
    std::array<std::uint64_t, 3> reserved;
    std::uint64_t checksum;  // XXH3-64 of the header's other bytes and the section table
};
static_assert(sizeof(Header) == 64 && std::has_unique_object_representations_v<Header>);

struct Section {
    std::uint32_t kind;
    std::uint32_t level;
    std::uint64_t offset;  // from the start of the file, a multiple of 64
    std::uint64_t bytes;
    std::uint64_t count;
    std::uint64_t element_bytes;
    std::uint64_t checksum;  // XXH3-64 of the section's bytes
};
static_assert(sizeof(Section) == 48 && std::has_unique_object_representations_v<Section>);

enum Kind : std::uint32_t {
    facts = 1,
    sign_reason,
    vertices,
    triangles,
    level_parent,
    level_mask,
    level_first,  // version 1 only
    level_values,
    cell_lower,
    cell_upper,
    cell_offset,    // version 1 only
    cell_triangle,  // version 1 only
    list_offset,
    list_bytes,
    level_inside,
    cell_winding,
    level_leaf,    // since version 3
    cell_corners,  // since version 3
};

/// Sections that nothing else in the file is reached through. LoadCheck::quick does not read them.
inline bool is_payload(std::uint32_t kind) {
    return kind == level_values || kind == cell_lower || kind == cell_upper || kind == list_offset ||
           kind == list_bytes || kind == cell_winding || kind == cell_corners;
}

/// The arrays that only version 1 has.
struct OldArrays {
    std::vector<Array<std::uint64_t>> first;  // of each level
    Array<std::uint64_t> offset;
    Array<std::uint32_t> triangle;
};

/// Calls visit(kind, level, array) for every array of the shell, in the order of the file: what a quick load
/// reads comes first. The octree's levels and the field's are as many as depth + 1. From version 2 on.
template <class Shell, class Visit>
void visit_arrays(Shell& shell, std::uint32_t file_version, Visit&& visit) {
    visit(sign_reason, 0, shell.info.sign_reason);
    visit(vertices, 0, shell.mesh.vertices);
    visit(triangles, 0, shell.mesh.triangles);
    const auto levels = static_cast<std::uint32_t>(shell.octree.levels.size());
    for (std::uint32_t k = 0; k < levels; ++k) {
        visit(level_parent, k, shell.octree.levels[k].parent);
        visit(level_mask, k, shell.octree.levels[k].mask);
        visit(level_inside, k, shell.sides.inside[k]);
        if (file_version > 2) visit(level_leaf, k, shell.octree.levels[k].leaf);
    }
    visit(cell_lower, 0, shell.surface.lower);
    visit(cell_upper, 0, shell.surface.upper);
    visit(list_offset, 0, shell.surface.lists.offset);
    visit(list_bytes, 0, shell.surface.lists.bytes);
    visit(cell_winding, 0, shell.sides.winding);
    if (file_version > 2) visit(cell_corners, 0, shell.surface.corners_inside);
    for (std::uint32_t k = 0; k < levels; ++k) visit(level_values, k, shell.field.values[k]);
}

template <class Visit>
void visit_arrays_of_version_1(shell::ShellData& shell, OldArrays& old, Visit&& visit) {
    visit(sign_reason, 0, shell.info.sign_reason);
    visit(vertices, 0, shell.mesh.vertices);
    visit(triangles, 0, shell.mesh.triangles);
    const auto levels = static_cast<std::uint32_t>(shell.octree.levels.size());
    for (std::uint32_t k = 0; k < levels; ++k) {
        visit(level_parent, k, shell.octree.levels[k].parent);
        visit(level_mask, k, shell.octree.levels[k].mask);
        visit(level_first, k, old.first[k]);
        visit(level_values, k, shell.field.values[k]);
    }
    visit(cell_lower, 0, shell.surface.lower);
    visit(cell_upper, 0, shell.surface.upper);
    visit(cell_offset, 0, old.offset);
    visit(cell_triangle, 0, old.triangle);
}

/// Numbers that are not arrays, eight bytes each; the order is the format. What is not used is zero.
inline constexpr std::size_t fact_words = 64, fact_words_of_version_1 = 32;

/// Calls visit(index, member) for every such number.
template <class Shell, class Visit>
void visit_facts(Shell& shell, std::uint32_t file_version, Visit&& visit) {
    auto& lattice = shell.lattice;
    auto& info = shell.info;
    std::size_t i = 0;
    const auto all = [&](auto&... members) { (visit(i++, members), ...); };
    all(lattice.depth, lattice.width, lattice.base[0], lattice.base[1], lattice.base[2]);
    all(shell.epsilon_inner, shell.epsilon_outer);
    all(info.depth, info.sign, info.extrema, info.solver, info.mesh_closed, info.mesh_vertices,
        info.mesh_triangles);
    all(info.scale, info.cell_width, info.root.min.x, info.root.min.y, info.root.min.z, info.root.max.x,
        info.root.max.y, info.root.max.z);
    all(info.epsilon_inner, info.epsilon_outer, info.rounding);
    all(info.surface_cells, info.cells, info.memory_bytes);
    if (file_version == 1) return;
    all(shell.grid_points, info.input_hash[0], info.input_hash[1], info.weld);
    all(info.up);  // 0 where it is not known, as in all files before there was such a number
    if (file_version == 2) return;
    all(info.adaptive, info.thickness_asked, info.max_cells, info.deepest, info.coarse_cells);
    all(info.coarse.min.x, info.coarse.min.y, info.coarse.min.z, info.coarse.max.x, info.coarse.max.y,
        info.coarse.max.z);
}

inline std::uint64_t to_word(double v) {
    return std::bit_cast<std::uint64_t>(v);
}
template <class T>
requires(std::is_integral_v<T> || std::is_enum_v<T>) std::uint64_t to_word(T v) {
    return static_cast<std::uint64_t>(v);
}

/// False if the word is no value of T.
inline bool from_word(std::uint64_t word, double& v) {
    v = std::bit_cast<double>(word);
    return true;
}
inline bool from_word(std::uint64_t word, bool& v) {
    v = word != 0;
    return word <= 1;
}
template <class T>
requires(std::is_integral_v<T> || std::is_enum_v<T>) bool from_word(std::uint64_t word, T& v) {
    v = static_cast<T>(word);
    return to_word(v) == word;
}

constexpr std::uint64_t aligned(std::uint64_t offset) {
    return (offset + alignment - 1) / alignment * alignment;
}

std::uint64_t checksum(std::span<const std::byte> bytes);

/// Of the header without its own checksum, then the table.
std::uint64_t header_checksum(std::span<const std::byte> header_and_table);

}  // namespace its::shell_file
