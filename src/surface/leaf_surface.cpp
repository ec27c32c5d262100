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
#include "surface/leaf_cells.h"
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

using Point = std::array<std::uint32_t, 3>;  // of the finest lattice

/// A vertex of a cell's surface.
struct Vertex {
    std::uint64_t name = 0;  ///< of the lattice segment that it is on; 0: it is in the cell
    Vec3 position;           ///< mesh units
    unsigned faces = 0;      ///< bit f: it is on face f of the cell
};

/// A piece of the surface's curve on a face, from one vertex to the next.
struct Segment {
    int from, to, face;
};

/// One cell's part of a surface.
struct CellPart {
    std::vector<Vertex> vertex;
    std::vector<std::array<int, 3>> triangle;
    bool to_halve = false;  ///< its curve has several loops, which are told apart in its halves
    bool folded = false;    ///< 32-bit numbers let a finest cell's triangles meet

    void clear() {
        vertex.clear();
        triangle.clear();
        to_halve = folded = false;
    }
};

std::uint64_t name_of(const Point& start, int axis) {
    return octree::morton_encode({start[0], start[1], start[2]}) << 2 | unsigned(axis);
}

/// One thread's work on cells.
class CellWorker {
public:
    CellWorker(const SurfaceFrame& frame, int depth, const LeafCells& leaves)
        : frame_(frame), depth_(depth), leaves_(leaves) {}

    /// The part of a cell that the level runs through.
    void make(const LeafCell& cell, CellPart& part) {
        part.clear();
        cell_ = &cell;
        part_ = &part;
        segments_.clear();
        width_ = std::uint32_t{1} << cell.level;
        for (std::size_t axis = 0; axis < 3; ++axis) low_[axis] = cell.at[axis] << cell.level;
        unsigned corners = 0;
        for (unsigned c = 0; c < 8; ++c) corners |= unsigned(below(cell.value[c])) << c;
        if (reaches_boundary(cell.at, corners, std::uint32_t{2} << (depth_ - cell.level))) refuse_open_level();
        if (cell.level == 0) return finest_cell();
        for (int face = 0; face < 6; ++face) add_face(face);
        fill();
    }

    /// Local coordinates of a position, each wrong by at most local_roundings·u.
    Vec3 local(const Vec3& p) const {
        Vec3 result;
        for (int axis = 0; axis < 3; ++axis) {
            const std::uint32_t i = low_[std::size_t(axis)];
            const double from = frame_.grid.position(axis, i), to = frame_.grid.position(axis, i + width_);
            result[axis] = (p[axis] - from) / (to - from);
        }
        return result;
    }

private:
    bool below(double v) const { return v < frame_.level; }

    /// Whether a cell with these coordinates on a level is divided.
    bool divided(int level, std::int64_t x, std::int64_t y, std::int64_t z) const {
        const std::int64_t side = std::int64_t{2} << (depth_ - level);
        if (level == 0 || std::min({x, y, z}) < 0 || std::max({x, y, z}) >= side) return false;
        return leaves_.divided.has(CellSet::key(
            depth_, level, octree::morton_encode({std::uint32_t(x), std::uint32_t(y), std::uint32_t(z)})));
    }

    /// As in make_cell_surface(): the faces of a finest cell are whole.
    void finest_cell() {
        CellSurface surface;
        const LevelCell cell{cell_->at, cell_->value};
        make_cell_surface(frame_, cell, surface);
        part_->folded = frame_.grid.unit > 0 && surface.crossing.star && !star_is_embedded(frame_, cell);
        std::array<int, patch_vertices> number{};
        for (int v = 0; v < patch_vertices; ++v) {
            if (!surface.crossing.has(v)) continue;
            Vertex vertex;
            vertex.position =
                vertex_position(frame_.grid, cell.at, surface.value, surface.crossing, frame_.side, v);
            if (v < first_inner) {
                Point start = low_;
                for (unsigned axis = 0; axis < 3; ++axis) start[axis] += unsigned(edge_start(v)) >> axis & 1;
                vertex.name = name_of(start, v / 4);
            }
            number[std::size_t(v)] = int(part_->vertex.size());
            part_->vertex.push_back(vertex);
        }
        for (int t = 0; t < surface.patch.size; ++t) {
            const auto& corner = surface.patch.triangle[std::size_t(t)];
            part_->triangle.push_back({number[corner[0]], number[corner[1]], number[corner[2]]});
        }
    }

    /// A square of a face, of side 2^level; values at its corners u + 2v.
    struct Square {
        int face, level;
        Point low;
        std::array<double, 4> value;
    };

    void add_face(int face) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        Square square{face, cell_->level, low_, {}};
        if (face % 2 == 1) square.low[std::size_t(axis)] += width_;
        for (int i = 0; i < 4; ++i)
            square.value[std::size_t(i)] =
                cell_->value[std::size_t((face % 2) << axis | (i & 1) << u | (i >> 1) << v)];
        add_square(square);
    }

    /// Down to the squares that the face shares with one cell each.
    void add_square(const Square& s) {
        int count = 0;
        for (const double v : s.value) count += below(v);
        if (count == 0 || count == 4) return;
        const int axis = s.face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        std::int64_t at[3];
        for (std::size_t i = 0; i < 3; ++i) at[i] = std::int64_t(s.low[i] >> s.level);
        if (s.face % 2 == 0) --at[axis];
        if (!divided(s.level, at[0], at[1], at[2])) return add_segments(s);
        const auto mean = [](double a, double b) { return 0.5 * (a + b); };
        const auto& w = s.value;
        const double low_u = mean(w[0], w[1]), high_u = mean(w[2], w[3]), low_v = mean(w[0], w[2]),
                     high_v = mean(w[1], w[3]);
        const double middle = u < v ? mean(low_u, high_u) : mean(low_v, high_v);  // x before y before z
        const double point[9] = {w[0], low_u, w[1], low_v, middle, high_v, w[2], high_u, w[3]};
        for (int i = 0; i < 4; ++i) {
            Square quarter{s.face, s.level - 1, s.low, {}};
            if (i & 1) quarter.low[std::size_t(u)] += 1u << quarter.level;
            if (i & 2) quarter.low[std::size_t(v)] += 1u << quarter.level;
            for (int c = 0; c < 4; ++c)
                quarter.value[std::size_t(c)] = point[(i & 1) + (c & 1) + 3 * ((i >> 1) + (c >> 1))];
            add_square(quarter);
        }
    }

    /// Counter-clockwise seen from outside: the curve leaves what is above on its left.
    void add_segments(const Square& s) {
        static constexpr int round[2][4] = {{0, 2, 3, 1}, {0, 1, 3, 2}};
        const auto& order = round[s.face % 2];
        bool in[4];  // below
        int vertex[4] = {-1, -1, -1, -1};
        for (int i = 0; i < 4; ++i) in[i] = below(s.value[std::size_t(order[i])]);
        for (int i = 0; i < 4; ++i)
            if (in[i] != in[(i + 1) % 4]) vertex[i] = vertex_between(s, order[i], order[(i + 1) % 4]);
        const auto add = [&](int from, int to) { segments_.push_back({vertex[from], vertex[to], s.face}); };
        if (in[0] == in[2] && in[1] == in[3]) {
            // As in make_crossing(): the asymptotic decider, from values minus the level.
            std::array<double, 4> w = s.value;
            for (double& value : w) value -= frame_.level;
            const bool joins_0_and_3 = w[0] * w[3] - w[1] * w[2] > 0;
            const bool zero_below = below(s.value[0]);
            const bool below_joined = joins_0_and_3 == zero_below;
            for (int i = 0; i < 4; ++i) {
                if (below_joined && !in[i]) add(i, (i + 3) % 4);
                if (!below_joined && in[i]) add((i + 3) % 4, i);
            }
            return;
        }
        int enters = -1, leaves = -1;
        for (int i = 0; i < 4; ++i) {
            if (!in[i] && in[(i + 1) % 4]) enters = i;
            if (in[i] && !in[(i + 1) % 4]) leaves = i;
        }
        add(enters, leaves);
    }

    /// The vertex between two corners of a square, on the shortest lattice segment there.
    int vertex_between(const Square& s, int p, int q) {
        if (p > q) std::swap(p, q);
        const int normal = s.face / 2, u = (normal + 1) % 3, v = (normal + 2) % 3;
        const int axis = q - p == 1 ? u : v;
        Point start = s.low;
        if (p & 1) start[std::size_t(u)] += 1u << s.level;
        if (p & 2) start[std::size_t(v)] += 1u << s.level;
        double from = s.value[std::size_t(p)], to = s.value[std::size_t(q)];
        int level = s.level;
        while (level > 0 && edge_is_divided(level, start, axis)) {
            const double middle = 0.5 * (from + to);
            --level;
            if (below(from) != below(middle)) {
                to = middle;
            } else {
                from = middle;
                start[std::size_t(axis)] += 1u << level;
            }
        }
        const std::uint64_t name = name_of(start, axis);
        for (std::size_t i = 0; i < part_->vertex.size(); ++i)
            if (part_->vertex[i].name == name) return int(i);
        Vertex vertex;
        vertex.name = name;
        for (int a = 0; a < 3; ++a) {
            const std::uint32_t at = start[std::size_t(a)], begin = low_[std::size_t(a)];
            vertex.position[a] = frame_.grid.position(a, at);
            if (a == axis) continue;
            if (at == begin) vertex.faces |= 1u << (2 * a);
            if (at == begin + width_) vertex.faces |= 1u << (2 * a + 1);
        }
        vertex.position[axis] =
            between(axis, start[std::size_t(axis)], start[std::size_t(axis)] + (1u << level),
                    crossing_fraction(from - frame_.level, to - frame_.level, frame_.grid.clearance));
        part_->vertex.push_back(vertex);
        return int(part_->vertex.size()) - 1;
    }

    /// As Grid::between(), of lattice points that need not be neighbours.
    double between(int axis, std::uint32_t i, std::uint32_t j, double fraction) const {
        const Grid& grid = frame_.grid;
        const double from = grid.position(axis, i), to = grid.position(axis, j);
        const double x = from + fraction * (to - from);
        if (grid.rounding.kind == Rounding::Kind::none) return x;
        return std::clamp(grid.rounding.nearest(axis, x), grid.rounding.next(from, 1),
                          grid.rounding.next(to, -1));
    }

    bool edge_is_divided(int level, const Point& start, int axis) const {
        for (int around = 0; around < 4; ++around) {
            std::int64_t at[3];
            for (std::size_t i = 0; i < 3; ++i) at[i] = std::int64_t(start[i] >> level);
            at[(axis + 1) % 3] -= around & 1;
            at[(axis + 2) % 3] -= around >> 1;
            if (divided(level, at[0], at[1], at[2])) return true;
        }
        return false;
    }

    /// Triangles in a cell with one loop: a fan, where the loop is seen from a vertex through the inside, else
    /// a cone.
    void fill() {
        const std::size_t n = segments_.size();
        if (n == 0) return;
        next_.assign(part_->vertex.size(), -1);
        for (const Segment& s : segments_) next_[std::size_t(s.from)] = s.to;
        loop_.clear();
        for (int at = segments_[0].from;;) {
            loop_.push_back(at);
            at = next_[std::size_t(at)];
            if (at < 0 || loop_.size() > n) throw InputError(damaged);
            if (at == loop_[0]) break;
        }
        if (loop_.size() != n) {
            part_->to_halve = true;
            return;
        }
        const int apex = best_apex();
        if (apex < 0) return add_cone();
        for (std::size_t i = 2; i < n; ++i)
            part_->triangle.push_back({loop_[std::size_t(apex)], loop_[(std::size_t(apex) + i - 1) % n],
                                       loop_[(std::size_t(apex) + i) % n]});
    }

    /// How bad a value on a diagonal is, relative to the level.
    double cost(double value) const {
        if (frame_.side == SurfaceSide::zero) return std::abs(value - frame_.level);
        return frame_.side == SurfaceSide::outer ? -value : value;
    }

    /// Of the vertices whose faces have none of the loop but the segments at the vertex, that whose fan is
    /// worst off the least; −1 if there is none.
    int best_apex() const {
        const std::size_t n = loop_.size();
        constexpr std::size_t long_loop = 16;
        int on_face[6] = {};
        for (const Segment& s : segments_) ++on_face[s.face];
        std::array<Vec3, long_loop> at;
        for (std::size_t i = 0; i < std::min(n, long_loop); ++i)
            at[i] = local(part_->vertex[std::size_t(loop_[i])].position);
        int best = -1;
        double least = infinity;
        for (std::size_t i = 0; i < n; ++i) {
            int own[6] = {};
            for (const Segment& s : segments_)
                if (s.from == loop_[i] || s.to == loop_[i]) ++own[s.face];
            bool clear = true;
            for (int face = 0; face < 6; ++face)
                if (part_->vertex[std::size_t(loop_[i])].faces >> face & 1)
                    clear = clear && own[face] == on_face[face];
            if (!clear) continue;
            if (n > long_loop) return int(i);
            double worst = -infinity;
            for (std::size_t k = 2; k + 1 < n; ++k)
                worst = std::max(
                    worst, cost(geometry::trilinear(cell_->value.data(), 0.5 * (at[i] + at[(i + k) % n]))));
            if (worst < least) {
                least = worst;
                best = int(i);
            }
        }
        return best;
    }

    /// Around a point in the cell that is near the level: the loop's mean, moved along the gradient.
    void add_cone() {
        constexpr int steps = 4;
        constexpr double clearance = 1.0 / 16;
        Vec3 z;
        for (const int v : loop_) z = z + local(part_->vertex[std::size_t(v)].position);
        z = (1.0 / double(loop_.size())) * z;
        for (int i = 0; i < steps; ++i) {
            Vec3 gradient;
            const double value =
                geometry::trilinear_with_gradient(cell_->value.data(), z, gradient) - frame_.level;
            const double squared = dot(gradient, gradient);
            if (squared > 0) z = z - (value / squared) * gradient;
            for (int axis = 0; axis < 3; ++axis) z[axis] = std::clamp(z[axis], clearance, 1 - clearance);
        }
        Vertex centre;
        for (int axis = 0; axis < 3; ++axis)
            centre.position[axis] =
                between(axis, low_[std::size_t(axis)], low_[std::size_t(axis)] + width_, z[axis]);
        const int number = int(part_->vertex.size());
        part_->vertex.push_back(centre);
        for (std::size_t i = 0; i < loop_.size(); ++i)
            part_->triangle.push_back({number, loop_[i], loop_[(i + 1) % loop_.size()]});
    }

    static constexpr const char* damaged =
        "damaged shell: the values of a grid point differ between the cells around it";

    const SurfaceFrame& frame_;
    int depth_;
    const LeafCells& leaves_;
    const LeafCell* cell_ = nullptr;
    CellPart* part_ = nullptr;
    Point low_{};
    std::uint32_t width_ = 1;
    std::vector<Segment> segments_;
    std::vector<int> next_, loop_;
};

bool is_crossed(const LeafCell& cell, double level) {
    bool below = false, above = false;
    for (const double v : cell.value) (v < level ? below : above) = true;
    return below && above;
}

/// A level set, its bounds and its mesh, from cells that are halved where need be.
class Extractor {
public:
    Extractor(const shell::ShellData& shell, const SurfaceFrame& frame, MemoryGuard& guard,
              const Progress& progress)
        : shell_(shell), frame_(frame), guard_(guard), parts_(progress) {}

    double level() const { return frame_.level; }

    /// Cells for the level, none of them with several loops but finest ones. \param low, high  levels whose
    /// cells are collected as well: where vertices are 32-bit numbers, f on the surface may be that of a
    /// neighbour
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
        for (const Vertex& v : part.vertex)
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
        for (const Vertex& v : part.vertex) {
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
