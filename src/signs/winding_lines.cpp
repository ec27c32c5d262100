#include "signs/winding_lines.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "mesh/arrays.h"

namespace its::signs {

namespace {

constexpr std::uint64_t cell_grain = 4096;
constexpr std::uint64_t group_grain = 1024;
constexpr std::uint64_t triangle_grain = 16;

}  // namespace

WindingLines::WindingLines(const mesh::Arrays& mesh, const octree::Lattice& lattice,
                           const octree::Voxels& voxels, const Progress& progress) {
    // Lines that can be crossed: the lowest edges of the cells.
    std::int64_t y_end = 0, z_end = 0;
    y_begin_ = z_begin_ = std::numeric_limits<std::int64_t>::max();
    for (const std::uint64_t code : voxels.cell) {
        const octree::Cell at = octree::morton_decode(code);
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
                       const octree::Cell at = octree::morton_decode(voxels.cell[c]);
                       const Vec3 from = lattice.position({at[0], at[1], at[2]});
                       const double to_x = lattice.position(0, std::int64_t(at[0]) + 1);
                       int sum = 0;
                       for (std::uint64_t p = voxels.offset[c]; p < voxels.offset[c + 1]; ++p) {
                           const Triangle& t = mesh.triangles[voxels.triangle[p]];
                           sum += geometry::x_line_crossing(mesh.vertices[t[0]], mesh.vertices[t[1]],
                                                            mesh.vertices[t[2]], from, to_x);
                       }
                       const auto line = std::uint64_t((at[2] - z_begin_) * y_count_ + (at[1] - y_begin_));
                       if (sum != 0) found[chunk].push_back({line, at[0] + 1, sum});
                   }
                   stage.advance(end - begin);
               });

    gather(found);
}

WindingLines::WindingLines(const mesh::Arrays& surface, const octree::Lattice& lattice,
                           const WindingLines& like, const Progress& progress)
    : y_begin_(like.y_begin_), y_count_(like.y_count_), z_begin_(like.z_begin_), z_count_(like.z_count_) {
    Stage stage(progress, "signs", surface.triangles.size());
    std::vector<std::vector<Event>> found(chunk_count(surface.triangles.size(), triangle_grain));
    for_chunks(surface.triangles.size(), triangle_grain,
               [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                   for (std::uint64_t t = begin; t < end; ++t)
                       draw(surface, surface.triangles[t], lattice, found[chunk]);
                   stage.advance(end - begin);
               });
    gather(found);
}

/// Where the lattice lines through the triangle's box cross it: each by exact predicates, from a computed
/// guess.
void WindingLines::draw(const mesh::Arrays& surface, const Triangle& t, const octree::Lattice& lattice,
                        std::vector<Event>& found) const {
    const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
    const Vec3 u = lattice.to_lattice(a), v = lattice.to_lattice(b), w = lattice.to_lattice(c);
    // One line more on each side: to_lattice() errs by far less than a cell.
    const auto low = [](double p, double q, double r) {
        return std::int64_t(std::floor(std::min({p, q, r}))) - 1;
    };
    const auto high = [](double p, double q, double r) {
        return std::int64_t(std::ceil(std::max({p, q, r}))) + 1;
    };
    const std::int64_t x_low = low(u.x, v.x, w.x), x_high = high(u.x, v.x, w.x);
    const std::int64_t y_low = std::max(low(u.y, v.y, w.y), y_begin_),
                       y_high = std::min(high(u.y, v.y, w.y), y_begin_ + y_count_ - 1);
    const std::int64_t z_low = std::max(low(u.z, v.z, w.z), z_begin_),
                       z_high = std::min(high(u.z, v.z, w.z), z_begin_ + z_count_ - 1);
    const Vec3 n = cross(v - u, w - u);
    for (std::int64_t z = z_low; z <= z_high; ++z)
        for (std::int64_t y = y_low; y <= y_high; ++y) {
            // What the winding number gains from lattice point `from` to `to`, both on this line.
            const auto gain = [&](std::int64_t from, std::int64_t to) {
                return geometry::x_line_crossing(a, b, c, lattice.position({from, y, z}),
                                                 lattice.position(0, to));
            };
            const int sign = gain(x_low, x_high);
            if (sign == 0) continue;
            const double x = u.x - (n.y * (double(y) - u.y) + n.z * (double(z) - u.z)) / n.x;
            std::int64_t before = x_low, after = x_high;  // the crossing lies between these
            const auto narrow = [&](std::int64_t middle) {
                if (middle <= before || middle >= after) return;
                (gain(before, middle) != 0 ? after : before) = middle;
            };
            if (std::isfinite(x)) {
                const double guess = std::clamp(std::floor(x), double(x_low), double(x_high));
                narrow(std::int64_t(guess));
                narrow(std::int64_t(guess) + 1);
            }
            while (after - before > 1) narrow(before + (after - before) / 2);
            const auto line = std::uint64_t((z - z_begin_) * y_count_ + (y - y_begin_));
            found.push_back({line, std::uint32_t(after), sign});
        }
}

/// Sorts the crossings by line and along it, and adds them up.
void WindingLines::gather(const std::vector<std::vector<Event>>& found) {
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

CellSides apply_signs(const octree::Octree& octree, const WindingLines& lines, SignRule rule,
                      std::vector<std::vector<double>>& distance) {
    CellSides sides;
    std::vector<std::int32_t> cell_winding(octree.surface_cells());
    std::atomic<bool> only_bits = true;
    const bool parity = rule == SignRule::even_odd;
    for (int level = 0; level <= octree.depth; ++level) {
        const std::int64_t step = std::int64_t{1} << level;
        std::vector<std::uint8_t> inside(octree.levels[level].groups());
        parallel_for(octree.levels[level].groups(), group_grain, [&](std::uint64_t group) {
            const octree::Cell at = octree::morton_decode(octree.levels[level].parent[group]);
            double* const d = &distance[level][octree::group_points * group];
            std::int32_t corner[8];  // of the children's lowest corners
            bool only_bits_here = true;
            for (int row = 0; row < 9; ++row) {
                std::int32_t winding[3];
                lines.winding(2 * step * at[0], 2 * step * at[1] + step * (row % 3),
                              2 * step * at[2] + step * (row / 3), step, winding);
                for (int i = 0; i < 3; ++i) {
                    if (parity) winding[i] &= 1;
                    if (winding[i] >= 1) d[3 * row + i] = 0.0 - d[3 * row + i];  // +0 stays +0
                    only_bits_here &= winding[i] >= 0 && winding[i] <= 1;
                }
                if (row % 3 < 2 && row / 3 < 2) std::copy_n(winding, 2, corner + 2 * (row % 3) + 4 * (row / 3));
            }
            for (int c = 0; c < 8; ++c)
                if (corner[c] >= 1) inside[group] |= std::uint8_t(1u << c);
            if (level > 0) return;
            if (!only_bits_here) only_bits.store(false, std::memory_order_relaxed);
            const octree::Level& finest = octree.levels[0];
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

}  // namespace its::signs
