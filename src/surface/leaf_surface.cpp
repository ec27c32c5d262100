#include "surface/leaf_surface.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/progress.h"
#include "base/rounding.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "surface/leaf_part.h"
#include "surface/level_search.h"
#include "surface/polygonise.h"

namespace its::surface {

namespace {

constexpr std::uint64_t cell_grain = 256;
// A cell that is found has a divided one for every eight, at least, in a set with twice to four times the
// slots.
constexpr std::uint64_t set_bytes_per_cell = 8;
// A cell that the level runs through has a vertex and two triangles: by names (32, 2·24), the vertex twice
// while parts are joined, and in the mesh (24 + 2·12).
constexpr std::uint64_t mesh_bytes_per_cell = 2 * 32 + 2 * 24 + 24 + 2 * 12;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int deepest_numbered = 19;  // a vertex's name has 60 bits of its position and two of its axis

/// A level set, its bounds and its mesh, from cells that are halved where need be.
class Extractor {
public:
    Extractor(const shell::ShellData& shell, const SurfaceFrame& frame, MemoryGuard& guard,
              const Progress& progress)
        : shell_(shell), frame_(frame), guard_(guard), parts_(progress) {}

    double level() const { return frame_.level; }

    /// Cells for the level, none of them with several loops but finest ones.
    /// \param low,  high  levels whose cells are collected as well: where vertices are 32-bit numbers, f on the
    ///              surface may be that of a neighbour
    void collect(double low, double high) {
        for (;;) {
            leaves_ = find_leaf_cells(shell_.octree, shell_.field, std::min(low, frame_.level),
                                      std::max(high, frame_.level), CellSet(halved_), parts_.next(0.1));
            taken_.emplace(guard_, leaves_.cells.size() * (sizeof(LeafCell) + set_bytes_per_cell));
            if (!halve_where([&](CellWorker&, const LeafCell&, const CellPart& part) { return part.to_halve; }))
                return;
        }
    }

    /// Halves the cells where f on the surface is not beyond the bound; false if there are none. Those that are
    /// finest set `stuck`.
    bool halve_near(double bound, bool& stuck) {
        const double error = rounding();
        std::atomic<bool> finest = false;
        const bool outer = frame_.side == SurfaceSide::outer;
        const bool any = halve_where([&](CellWorker& worker, const LeafCell& cell, const CellPart& part) {
            Hull hull(frame_.level, outer ? RangeEnds::lower : RangeEnds::upper);
            include(worker, cell, part, hull);
            const bool near =
                outer ? !(hull.range().lower - error > bound) : !(hull.range().upper + error < bound);
            if ((near && cell.level == 0) || part.folded) finest = true;
            return near && cell.level > 0;
        });
        stuck = finest;
        return any;
    }

    /// Of f on the surface.
    SurfaceRange range(RangeEnds ends) {
        std::vector<Hull> hulls(chunk_count(leaves_.cells.size(), cell_grain), Hull(frame_.level, ends));
        for_cells([&](std::uint64_t chunk, CellWorker& worker, std::uint64_t i, const CellPart& part) {
            include(worker, leaves_.cells[i], part, hulls[chunk]);
        });
        SurfaceRange all{frame_.level, frame_.level};
        for (const Hull& hull : hulls) {
            all.lower = std::min(all.lower, hull.range().lower);
            all.upper = std::max(all.upper, hull.range().upper);
        }
        const double error = rounding();
        return {all.lower - error, all.upper + error};
    }

    bool folded() {
        std::atomic<bool> any = false;
        for_cells([&](std::uint64_t, CellWorker&, std::uint64_t, const CellPart& part) {
            if (part.folded) any = true;
        });
        return any;
    }

    void set_level(double level) { frame_.level = level; }

    std::uint64_t crossed() const {
        return std::uint64_t(
            std::count_if(leaves_.cells.begin(), leaves_.cells.end(),
                          [&](const LeafCell& cell) { return is_crossed(cell, frame_.level); }));
    }

    Mesh mesh();

private:
    /// fn(chunk, worker, cell number, part) for each cell that the level runs through.
    template <class F>
    void for_cells(const F& fn) {
        Stage stage(parts_.next(0.1), "surface", leaves_.cells.size());
        for_chunks(leaves_.cells.size(), cell_grain,
                   [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                       CellWorker worker(frame_, shell_.lattice.depth, leaves_);
                       CellPart part;
                       for (std::uint64_t i = begin; i < end; ++i) {
                           if (!is_crossed(leaves_.cells[i], frame_.level)) continue;
                           worker.make(leaves_.cells[i], part);
                           fn(chunk, worker, i, part);
                       }
                       stage.advance(end - begin);
                   });
    }

    template <class F>
    bool halve_where(const F& wanted) {
        std::vector<std::vector<std::uint64_t>> found(chunk_count(leaves_.cells.size(), cell_grain));
        for_cells([&](std::uint64_t chunk, CellWorker& worker, std::uint64_t i, const CellPart& part) {
            const LeafCell& cell = leaves_.cells[i];
            if (wanted(worker, cell, part))
                found[chunk].push_back(
                    CellSet::key(shell_.lattice.depth, cell.level, octree::morton_encode(cell.at)));
        });
        const std::size_t before = halved_.size();
        for (const auto& part : found) halved_.insert(halved_.end(), part.begin(), part.end());
        return halved_.size() > before;
    }

    static void include(const CellWorker& worker, const LeafCell& cell, const CellPart& part, Hull& hull) {
        std::vector<geometry::Sample> samples;
        samples.reserve(part.vertex.size());
        for (const CellPart::Vertex& v : part.vertex)
            samples.push_back(geometry::sample(cell.value.data(), worker.local(v.position)));
        for (const auto& t : part.triangle)
            hull.include(cell.value.data(), samples[std::size_t(t[0])], samples[std::size_t(t[1])],
                         samples[std::size_t(t[2])]);
    }

    /// As of FinestSource: slopes are per finest cell, V is the largest value, whatever the cell's size.
    double rounding() const {
        const double local = 3 * 2 * (local_roundings + Hull::max_halvings);
        double value = 0, slope = 0;
        for (const LeafCell& cell : leaves_.cells) {
            for (const double v : cell.value) value = std::max(value, std::abs(v));
            slope = std::max(slope, std::ldexp(steepest(cell.value.data()), -cell.level));
        }
        const int depth = shell_.lattice.depth;
        return unit_roundoff * ((geometry::control_roundings + local) * value +
                                value_roundings(depth) * std::ldexp(4.0, depth)) +
               3 * (0.5 * frame_.grid.unit) * (1 + 8 * unit_roundoff) * slope;
    }

    const shell::ShellData& shell_;
    SurfaceFrame frame_;
    MemoryGuard& guard_;
    Parts parts_;
    LeafCells leaves_;
    std::optional<Taken> taken_;         ///< by the cells
    std::vector<std::uint64_t> halved_;  ///< keys of cells
};

/// Vertices on lattice segments in the order of their names, then those in cells.
Mesh Extractor::mesh() {
    const Taken taken(guard_, crossed() * mesh_bytes_per_cell);
    struct Named {
        std::uint64_t name;
        Vec3 position;
    };
    struct Part {
        std::vector<Named> named;
        std::vector<Vec3> inner;
        std::vector<std::array<std::uint64_t, 3>>
            triangle;  ///< names; or number of an inner one, and inner_bit
    };
    constexpr std::uint64_t inner_bit = std::uint64_t{1} << 63;
    std::vector<Part> parts(chunk_count(leaves_.cells.size(), cell_grain));
    for_cells([&](std::uint64_t chunk, CellWorker&, std::uint64_t, const CellPart& part) {
        Part& to = parts[chunk];
        std::vector<std::uint64_t> name;
        for (const CellPart::Vertex& v : part.vertex) {
            name.push_back(v.name != 0 ? v.name : inner_bit | to.inner.size());
            if (v.name != 0)
                to.named.push_back({v.name, v.position});
            else
                to.inner.push_back(v.position);
        }
        for (const auto& t : part.triangle)
            to.triangle.push_back({name[std::size_t(t[0])], name[std::size_t(t[1])], name[std::size_t(t[2])]});
    });
    std::vector<Named> named;
    std::uint64_t inner = 0, triangles = 0;
    for (Part& part : parts) {
        named.insert(named.end(), part.named.begin(), part.named.end());
        std::vector<Named>().swap(part.named);
        inner += part.inner.size();
        triangles += part.triangle.size();
    }
    std::sort(named.begin(), named.end(), [](const Named& a, const Named& b) { return a.name < b.name; });
    named.erase(std::unique(named.begin(), named.end(),
                            [](const Named& a, const Named& b) { return a.name == b.name; }),
                named.end());
    if (named.size() + inner > std::numeric_limits<std::uint32_t>::max())
        throw OptionError("the surface has more than 4294967295 vertices; choose a larger thickness");
    Mesh mesh;
    mesh.vertices.reserve(named.size() + inner);
    for (const Named& v : named) mesh.vertices.push_back(v.position);
    mesh.triangles.reserve(triangles);
    for (const Part& part : parts) {
        const std::uint64_t first = mesh.vertices.size();
        mesh.vertices.insert(mesh.vertices.end(), part.inner.begin(), part.inner.end());
        const auto number = [&](std::uint64_t name) {
            if (name & inner_bit) return std::uint32_t(first + (name & ~inner_bit));
            const auto at = std::lower_bound(named.begin(), named.end(), name,
                                             [](const Named& a, std::uint64_t b) { return a.name < b; });
            return std::uint32_t(at - named.begin());
        };
        for (const auto& t : part.triangle)
            mesh.triangles.push_back({number(t[0]), number(t[1]), number(t[2])});
    }
    return mesh;
}

constexpr double first_move =
    0.4;  // of the bound's own distance from 0; a level of 1.4 ε₂ is met by most cells

}  // namespace

LeafSurface extract_leaf_surface(const shell::ShellData& shell, const Grid& grid, SurfaceSide side,
                                 std::optional<double> given, double bound, bool with_range, MemoryGuard& guard,
                                 const Progress& progress) {
    if (shell.lattice.depth > deepest_numbered)
        throw OptionError("surfaces of shells deeper than 19 levels are not made; choose a larger thickness");
    Extractor extractor(shell, {grid, side, given.value_or(bound)}, guard, progress);
    const double away = side == SurfaceSide::outer ? 1 : -1;
    if (given) {
        extractor.collect(*given, *given);
    } else {
        const double most = most_level(shell, side) - away * bound;
        double move = std::max(first_move * std::abs(bound), level_precision);
        for (;; move *= 1.5) {
            if (!(move <= most)) refuse_open_level();
            extractor.set_level(bound + away * move);
            bool stuck = false;
            do {
                extractor.collect(bound, bound + away * 2 * move);
            } while (extractor.halve_near(bound, stuck) && !stuck);
            if (!stuck) break;
        }
    }
    if (given && grid.unit > 0 && extractor.folded()) refuse_folded();
    LeafSurface result;
    result.level = extractor.level();
    result.range = {result.level, result.level};
    if (with_range) result.range = extractor.range(RangeEnds::both);
    // With 32-bit numbers slopes of neighbours count, as far as f on the surface is from the level.
    constexpr int attempts = 8;
    for (int i = 0; with_range && grid.unit > 0; ++i) {
        if (i == attempts) {  // nothing is proven
            result.range = {-infinity, infinity};
            break;
        }
        const SurfaceRange covered = {2 * result.range.lower - result.level,
                                      2 * result.range.upper - result.level};
        extractor.collect(covered.lower, covered.upper);
        result.range = extractor.range(RangeEnds::both);
        if (result.range.lower >= covered.lower && result.range.upper <= covered.upper) break;
    }
    result.cells = extractor.crossed();
    result.mesh = extractor.mesh();
    return result;
}

}  // namespace its::surface
