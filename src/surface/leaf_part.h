#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "surface/cell_surface.h"
#include "surface/leaf_cells.h"
#include "surface/polygonise.h"

/// The part of a level set in one cell of any size: docs/design/adaptive.md has the proofs.
namespace its::surface {

/// A point of the finest lattice.
using Point = std::array<std::uint32_t, 3>;

/// One cell's part of a surface.
struct CellPart {
    /// A vertex of a cell's surface.
    struct Vertex {
        std::uint64_t name = 0;  ///< of the lattice segment that it is on; 0: it is in the cell
        Vec3 position;           ///< mesh units
        unsigned faces = 0;      ///< bit f: it is on face f of the cell
        int level = 0;           ///< of the segment, which is 2^level long
    };
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

/// The name of the lattice segment that starts at a point, of whatever length, and of its start again.
inline std::uint64_t name_of(const Point& start, int axis) {
    return octree::morton_encode({start[0], start[1], start[2]}) << 2 | unsigned(axis);
}
inline Point start_of(std::uint64_t name) {
    const octree::Cell at = octree::morton_decode(name >> 2);
    return {at[0], at[1], at[2]};
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
    /// A piece of the surface's curve on a face, from one vertex to the next.
    struct Segment {
        int from, to, face;
    };

    using Vertex = CellPart::Vertex;

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
        vertex.level = level;
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
        double least = std::numeric_limits<double>::infinity();
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
            double worst = -std::numeric_limits<double>::infinity();
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

/// Whether the level runs through a cell.
inline bool is_crossed(const LeafCell& cell, double level) {
    bool below = false, above = false;
    for (const double v : cell.value) (v < level ? below : above) = true;
    return below && above;
}

}  // namespace its::surface
