#include "surface/polygonise.h"

#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <limits>
#include <vector>

#include "base/parallel.h"

namespace its::surface {

bool reaches_boundary(const octree::Cell& at, unsigned below, std::uint32_t side) {
    for (int axis = 0; axis < 3; ++axis) {
        const unsigned high = axis == 0 ? 0xaa : axis == 1 ? 0xcc : 0xf0;
        if (at[std::size_t(axis)] == 0 && (below & ~high & 0xff)) return true;
        if (at[std::size_t(axis)] + 1 == side && (below & high)) return true;
    }
    return false;
}

namespace {

constexpr std::uint64_t cell_grain = 1024;

/// Cells that share a lattice point have the same value there, unless the shell is not what build() made.
[[noreturn]] void refuse_damaged() {
    throw InputError("damaged shell: the values of a grid point differ between the cells around it");
}

/// Position of each cell in the list: open addressing, at most half full.
class CellIndex {
public:
    explicit CellIndex(std::span<const LevelCell> cells)
        : shift_(64 - std::bit_width(2 * cells.size() + 1)),
          slots_(std::size_t{1} << (64 - shift_), empty),
          cells_(cells) {
        for (std::size_t i = 0; i < cells.size(); ++i) {
            std::uint64_t slot = first_slot(cells[i].at);
            while (slots_[slot] != empty) slot = next(slot);
            slots_[slot] = std::uint32_t(i);
        }
    }

    /// Precondition: the cell is in the list.
    std::uint32_t find(const octree::Cell& at) const {
        std::uint64_t slot = first_slot(at);
        while (slots_[slot] != empty && !same(cells_[slots_[slot]].at, at)) slot = next(slot);
        if (slots_[slot] == empty) refuse_damaged();
        return slots_[slot];
    }

private:
    static constexpr std::uint32_t empty = ~std::uint32_t{0};

    /// As ==, without a call of memcmp().
    static bool same(const octree::Cell& a, const octree::Cell& b) {
        return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
    }

    std::uint64_t first_slot(const octree::Cell& at) const {
        const std::uint64_t key = at[0] | std::uint64_t{at[1]} << 21 | std::uint64_t{at[2]} << 42;
        return key * 0x9e3779b97f4a7c15 >> shift_;  // Fibonacci hashing
    }
    std::uint64_t next(std::uint64_t slot) const { return (slot + 1) & (slots_.size() - 1); }

    int shift_;
    std::vector<std::uint32_t> slots_;
    std::span<const LevelCell> cells_;
};

/// Each vertex belongs to one cell: that on a lattice edge to the cell that it starts from at corner 0.
struct Numbering {
    std::vector<std::uint32_t> first;  ///< of each cell, in order; one more at the end: the total
    std::vector<Crossing> crossing;
};

Numbering number_vertices(const SurfaceFrame& frame, std::span<const LevelCell> cells) {
    Numbering numbering;
    numbering.crossing.resize(cells.size());
    parallel_for(cells.size(), cell_grain, [&](std::uint64_t i) {
        std::array<double, 8> value;
        numbering.crossing[i] = crossing_of(cells[i], frame.level, value);
        const unsigned below = numbering.crossing[i].below;
        if (below != 0 && reaches_boundary(cells[i].at, below, frame.grid.cells)) refuse_open_level();
    });
    numbering.first.resize(cells.size() + 1);
    std::uint64_t total = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        numbering.first[i] = std::uint32_t(total);
        const Crossing& c = numbering.crossing[i];
        total += std::uint64_t(own_edges(c.below) + std::popcount(c.inner()));
        if (total > std::numeric_limits<std::uint32_t>::max())
            throw OptionError(
                "the surface has more than 4294967295 vertices; choose a smaller resolution or depth");
    }
    numbering.first.back() = std::uint32_t(total);
    return numbering;
}

/// The vertices of a cell come in the order of its own edges 0, 4, 8, then its inner ones.
std::uint32_t rank_of(const Crossing& crossing, int vertex) {
    if (vertex >= first_inner) {
        const unsigned before = crossing.inner() & ((1u << (vertex - first_inner)) - 1);
        return std::uint32_t(own_edges(crossing.below) + std::popcount(before));
    }
    std::uint32_t rank = 0;
    for (int edge = 0; edge < vertex; edge += 4) rank += crossing.crossed(edge);
    return rank;
}

class Polygoniser {
public:
    Polygoniser(const SurfaceFrame& frame, std::span<const LevelCell> cells)
        : frame_(frame), cells_(cells), index_(cells), numbering_(number_vertices(frame, cells)) {}

    std::uint64_t vertices() const { return numbering_.first.back(); }

    void place_vertices(std::uint64_t i, std::vector<Vec3>& vertices) const {
        const Crossing& crossing = numbering_.crossing[i];
        if (numbering_.first[i] == numbering_.first[i + 1]) return;
        std::array<double, 8> value;
        crossing_of(cells_[i], frame_.level, value);
        std::uint32_t next = numbering_.first[i];
        const auto place = [&](int v) {
            vertices[next++] = vertex_position(frame_.grid, cells_[i].at, value, crossing, frame_.side, v);
        };
        for (int edge = 0; edge < first_inner; edge += 4)
            if (crossing.crossed(edge)) place(edge);
        for (unsigned inner = crossing.inner(); inner != 0; inner &= inner - 1)
            place(first_inner + std::countr_zero(inner));
    }

    void add_triangles(std::uint64_t i, std::vector<Triangle>& triangles) const {
        const Crossing& crossing = numbering_.crossing[i];
        if (crossing.below == 0 || crossing.below == 0xff) return;
        CellSurface surface;
        make_cell_surface(frame_, cells_[i], surface);
        std::array<std::uint32_t, patch_vertices> number;
        for (int edge = 0; edge < first_inner; ++edge)
            if (crossing.crossed(edge)) number[std::size_t(edge)] = number_of_edge(i, edge);
        for (unsigned inner = crossing.inner(); inner != 0; inner &= inner - 1) {
            const int v = first_inner + std::countr_zero(inner);
            number[std::size_t(v)] = numbering_.first[i] + rank_of(crossing, v);
        }
        for (int t = 0; t < surface.patch.size; ++t) {
            const auto& corner = surface.patch.triangle[std::size_t(t)];
            triangles.push_back({number[corner[0]], number[corner[1]], number[corner[2]]});
        }
    }

private:
    std::uint32_t number_of_edge(std::uint64_t i, int edge) const {
        const int start = edge_start(edge);
        std::uint64_t owner = i;
        if (start != 0) {
            const octree::Cell& at = cells_[i].at;
            owner =
                index_.find({at[0] + (start & 1), at[1] + (start >> 1 & 1), at[2] + std::uint32_t(start >> 2)});
        }
        if (!numbering_.crossing[owner].crossed(edge / 4 * 4)) refuse_damaged();
        return numbering_.first[owner] + rank_of(numbering_.crossing[owner], edge / 4 * 4);
    }

    const SurfaceFrame& frame_;
    std::span<const LevelCell> cells_;
    CellIndex index_;
    Numbering numbering_;
};

}  // namespace

void refuse_open_level() {
    throw OptionError(
        "the level set leaves the shell's root cube; choose a level nearer to 0 or a larger depth");
}

void refuse_folded() {
    throw OptionError(
        "with 32-bit numbers the surface would meet itself at this distance from the origin; write .ply, .obj "
        "or .off, which keep doubles, or lower the depth or resolution");
}

bool stars_are_embedded(const SurfaceFrame& frame, std::span<const LevelCell> cells) {
    std::vector<std::uint8_t> good(chunk_count(cells.size(), cell_grain), 1);
    for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        std::array<double, 8> value;
        for (std::uint64_t i = begin; i < end && good[chunk]; ++i)
            if (crossing_of(cells[i], frame.level, value).star) good[chunk] = star_is_embedded(frame, cells[i]);
    });
    return std::find(good.begin(), good.end(), 0) == good.end();
}

Mesh polygonise(const SurfaceFrame& frame, std::span<const LevelCell> cells, const Progress& progress) {
    if (cells.size() >= std::numeric_limits<std::uint32_t>::max())
        throw OptionError(
            "the surface runs through more than 4294967294 cells; choose a smaller resolution or depth");
    const Polygoniser polygoniser(frame, cells);
    Mesh mesh;
    mesh.vertices.resize(polygoniser.vertices());
    Stage stage(progress, "surface mesh", cells.size());
    std::vector<std::vector<Triangle>> parts(chunk_count(cells.size(), cell_grain));
    for_chunks(cells.size(), cell_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) {
            polygoniser.place_vertices(i, mesh.vertices);
            polygoniser.add_triangles(i, parts[chunk]);
        }
        stage.advance(end - begin);
    });
    std::vector<std::uint64_t> begin(parts.size() + 1, 0);
    for (std::size_t i = 0; i < parts.size(); ++i) begin[i + 1] = begin[i] + parts[i].size();
    mesh.triangles.resize(begin.back());
    parallel_for(parts.size(), 1, [&](std::uint64_t i) {
        std::copy(parts[i].begin(), parts[i].end(), mesh.triangles.begin() + std::ptrdiff_t(begin[i]));
    });
    return mesh;
}

}  // namespace its::surface
