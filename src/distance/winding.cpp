#include "distance/winding.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>

#include "base/parallel.h"
#include "geometry/predicates.h"

namespace its {

namespace {

constexpr std::uint64_t cell_grain = 4096;
constexpr std::uint64_t group_grain = 1024;

struct Event {
    std::uint64_t line;
    std::uint32_t x;
    std::int32_t sign;
};

}  // namespace

WindingLines::WindingLines(const Mesh& mesh, const Lattice& lattice, const Voxels& voxels,
                           const Progress& progress) {
    // Lines that can be crossed: the lowest edges of the cells.
    std::int64_t y_end = 0, z_end = 0;
    y_begin_ = z_begin_ = std::numeric_limits<std::int64_t>::max();
    for (const std::uint64_t code : voxels.cell) {
        const Cell at = morton_decode(code);
        y_begin_ = std::min<std::int64_t>(y_begin_, at[1]);
        y_end = std::max<std::int64_t>(y_end, at[1] + 1);
        z_begin_ = std::min<std::int64_t>(z_begin_, at[2]);
        z_end = std::max<std::int64_t>(z_end, at[2] + 1);
    }
    y_count_ = y_end - y_begin_;
    z_count_ = z_end - z_begin_;

    Stage stage(progress, "signs", voxels.cell.size());
    std::vector<std::vector<Event>> found(chunk_count(voxels.cell.size(), cell_grain));
    for_chunks(voxels.cell.size(), cell_grain,
               [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                   for (std::uint64_t c = begin; c < end; ++c) {
                       const Cell at = morton_decode(voxels.cell[c]);
                       const Vec3 from = lattice.position({at[0], at[1], at[2]});
                       const double to_x = lattice.position(0, std::int64_t(at[0]) + 1);
                       int sum = 0;
                       for (std::uint64_t p = voxels.offset[c]; p < voxels.offset[c + 1]; ++p) {
                           const Triangle& t = mesh.triangles[voxels.triangle[p]];
                           sum += x_line_crossing(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]],
                                                  from, to_x);
                       }
                       const auto line = std::uint64_t((at[2] - z_begin_) * y_count_ + (at[1] - y_begin_));
                       if (sum != 0) found[chunk].push_back({line, at[0] + 1, sum});
                   }
                   stage.advance(end - begin);
               });

    first_.assign(std::uint64_t(y_count_ * z_count_) + 1, 0);
    for (const auto& events : found)
        for (const Event& e : events) ++first_[e.line + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    crossing_.resize(first_.back());
    std::vector<std::uint64_t> next(first_.begin(), first_.end() - 1);
    for (const auto& events : found)
        for (const Event& e : events) crossing_[next[e.line]++] = {e.x, e.sign};
    parallel_for(first_.size() - 1, group_grain, [&](std::uint64_t line) {
        const auto begin = crossing_.begin() + std::ptrdiff_t(first_[line]);
        const auto end = crossing_.begin() + std::ptrdiff_t(first_[line + 1]);
        std::sort(begin, end, [](const Crossing& a, const Crossing& b) { return a.x < b.x; });
        std::int32_t winding = 0;
        for (auto it = begin; it != end; ++it) it->winding = winding += it->winding;
    });
}

void WindingLines::winding(std::int64_t x, std::int64_t y, std::int64_t z, std::int64_t step,
                           std::int32_t (&out)[3]) const {
    out[0] = out[1] = out[2] = 0;
    y -= y_begin_;
    z -= z_begin_;
    if (y < 0 || y >= y_count_ || z < 0 || z >= z_count_) return;
    const auto line = std::uint64_t(z * y_count_ + y);
    auto it = crossing_.begin() + std::ptrdiff_t(first_[line]);
    const auto begin = it, end = crossing_.begin() + std::ptrdiff_t(first_[line + 1]);
    it = std::upper_bound(it, end, x, [](std::int64_t value, const Crossing& c) { return value < c.x; });
    for (int i = 0; i < 3; ++i, x += step) {
        while (it != end && it->x <= x) ++it;
        out[i] = it == begin ? 0 : (it - 1)->winding;
    }
}

CellSides apply_signs(const Octree& octree, const WindingLines& lines,
                      std::vector<std::vector<double>>& distance) {
    CellSides sides;
    std::vector<std::int32_t> cell_winding(octree.surface_cells());
    std::atomic<bool> only_bits = true;
    for (int level = 0; level <= octree.depth; ++level) {
        const std::int64_t step = std::int64_t{1} << level;
        std::vector<std::uint8_t> inside(octree.levels[level].groups());
        parallel_for(octree.levels[level].groups(), group_grain, [&](std::uint64_t group) {
            const Cell at = morton_decode(octree.levels[level].parent[group]);
            double* const d = &distance[level][group_points * group];
            std::int32_t corner[8];  // of the children's lowest corners
            bool only_bits_here = true;
            for (int row = 0; row < 9; ++row) {
                std::int32_t winding[3];
                lines.winding(2 * step * at[0], 2 * step * at[1] + step * (row % 3),
                              2 * step * at[2] + step * (row / 3), step, winding);
                for (int i = 0; i < 3; ++i) {
                    if (winding[i] >= 1) d[3 * row + i] = 0.0 - d[3 * row + i];  // +0 stays +0
                    only_bits_here &= winding[i] >= 0 && winding[i] <= 1;
                }
                if (row % 3 < 2 && row / 3 < 2) std::copy_n(winding, 2, corner + 2 * (row % 3) + 4 * (row / 3));
            }
            for (int c = 0; c < 8; ++c)
                if (corner[c] >= 1) inside[group] |= std::uint8_t(1u << c);
            if (level > 0) return;
            if (!only_bits_here) only_bits.store(false, std::memory_order_relaxed);
            const Level& finest = octree.levels[0];
            std::uint64_t cell = finest.first[group];
            for (unsigned left = finest.mask[group]; left != 0; left &= left - 1) {
                cell_winding[cell++] = corner[std::countr_zero(left)];
            }
        });
        sides.inside.emplace_back(std::move(inside));
    }
    if (!only_bits) sides.winding = std::move(cell_winding);
    return sides;
}

}  // namespace its
