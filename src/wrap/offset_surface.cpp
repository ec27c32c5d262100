#include "wrap/offset_surface.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "geometry/vec3.h"
#include "surface/leaf_part.h"
#include "winding/x_rays.h"

namespace its::wrapper {

using surface::CellPart;
using surface::Point;

namespace {

constexpr std::uint64_t grain = 256;
/// A cell that is crossed has 88 bytes, and of four vertices as its own, one in common and two triangles: 80
/// and 16 for each of the former, 80 and 40 for the latter, twice while parts are joined.
constexpr std::uint64_t bytes_per_cell = 88 + 4 * 96 + 2 * (80 + 2 * 40);
/// Of the slack: how far a vertex may be moved to one side of the middle.
constexpr double aside_of_slack = 0.3;
constexpr std::uint32_t none = ~std::uint32_t{0};

/// A vertex of the surface: on a lattice segment, or in a cell.
struct Placed {
    std::uint64_t name = 0;   ///< of the segment; 0: in the cell
    std::uint32_t level = 0;  ///< of the segment, or the number of the cell
    Vec3 at;
    std::uint32_t nearest = 0;    ///< triangle of M
    double aim = 0;               ///< where it is wanted: the signed distance less the surface's level
    double away = 0;              ///< where it is: how much more than that
    std::uint32_t before = none;  ///< its number in the pass before, where it was the same

    auto order() const { return std::pair(name, level); }
};

struct Piece {
    Triangle corner;
    std::uint32_t cell = 0;
    DistanceRange range{0, 0};  ///< proven, where `proven`
    bool proven = false;
};

/// One pass: the surface of the tree as it is.
struct Pass {
    OffsetTree::Crossed crossed;
    std::vector<Placed> vertex;  ///< in their order
    std::vector<Piece> piece;
    std::vector<std::uint32_t> several;  ///< cells whose curve has several loops
    std::unique_ptr<surface::Taken> taken;
};

class Maker {
public:
    Maker(const OffsetDemand& demand, const OffsetTask& task, OffsetTree& tree, surface::MemoryGuard& guard,
          const Progress& progress)
        : demand_(demand),
          task_(task),
          tree_(tree),
          guard_(guard),
          parts_(progress),
          proof_(demand.mesh, task.field.tree(), task.lattice.reach() * task.lattice.width) {}

    OffsetSurface run() {
        OffsetSurface result;
        for (;; ++result.passes) {
            Pass pass = extract();
            place(pass);
            prove(pass, pieces_to_prove(pass));
            move(pass);
            std::vector<std::uint32_t> halved = to_halve(pass);
            if (halved.empty()) {
                result.mesh = mesh_of(pass);
                halved = wrong_sides(result);
                if (halved.empty()) {
                    finish(pass, result);
                    return result;
                }
            }
            tree_.split(halved, parts_.next(0.2));
            last_ = std::move(pass);
        }
    }

private:
    Pass extract();
    void place(Pass& pass) const;
    void place_on_segment(const Pass& pass, Placed& vertex) const;
    void place_in_cell(const Pass& pass, Placed& vertex) const;
    double measure(const Vec3& p, std::span<const Point> ends, distance::Nearest& nearest) const;
    std::vector<std::uint32_t> pieces_to_prove(Pass& pass) const;
    void prove(Pass& pass, std::span<const std::uint32_t> pieces);
    void move(Pass& pass);
    std::vector<std::uint32_t> to_halve(const Pass& pass) const;
    void blame(const Pass& pass, const Piece& piece, std::vector<std::uint32_t>& halved) const;
    std::vector<std::uint32_t> wrong_sides(OffsetSurface& result) const;
    Mesh mesh_of(const Pass& pass) const;
    void finish(const Pass& pass, OffsetSurface& result) const;
    [[noreturn]] void give_up() const;

    const OffsetDemand& demand_;
    const OffsetTask& task_;
    OffsetTree& tree_;
    surface::MemoryGuard& guard_;
    Parts parts_;
    DistanceProof proof_;
    Pass last_;
};

Pass Maker::extract() {
    Pass pass;
    pass.crossed = tree_.crossed(parts_.next(0.05));
    const std::vector<surface::LeafCell>& cells = pass.crossed.leaves.cells;
    pass.taken = std::make_unique<surface::Taken>(guard_, cells.size() * bytes_per_cell);
    struct Part {
        std::vector<Placed> vertex;
        std::vector<std::array<std::uint32_t, 3>> corner;  ///< numbers in `vertex`
        std::vector<std::uint32_t> cell, several;
    };
    std::vector<Part> parts(chunk_count(cells.size(), grain));
    Stage stage(parts_.next(0.05), "surface", cells.size());
    for_chunks(cells.size(), grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        surface::CellWorker worker(demand_.frame, task_.lattice.depth, pass.crossed.leaves);
        CellPart cell;
        Part& part = parts[chunk];
        for (std::uint64_t i = begin; i < end; ++i) {
            worker.make(cells[i], cell);
            if (cell.to_halve) {
                part.several.push_back(std::uint32_t(i));
                continue;
            }
            if (cell.folded) surface::refuse_folded();
            const auto first = std::uint32_t(part.vertex.size());
            for (const CellPart::Vertex& v : cell.vertex)
                part.vertex.push_back({.name = v.name,
                                       .level = v.name != 0 ? std::uint32_t(v.level) : std::uint32_t(i),
                                       .at = v.position});
            for (const auto& t : cell.triangle) {
                part.corner.push_back(
                    {first + std::uint32_t(t[0]), first + std::uint32_t(t[1]), first + std::uint32_t(t[2])});
                part.cell.push_back(std::uint32_t(i));
            }
        }
        stage.advance(end - begin);
    });
    std::uint64_t count = 0;
    for (const Part& part : parts) count += part.vertex.size();
    if (count > none) throw OptionError("the surface has more than 4294967295 vertices; choose a larger slack");
    // Vertices on segments once each; those in cells have no name, and each is its own.
    struct Numbered {
        std::uint64_t name;
        std::uint32_t level, number;
    };
    std::vector<Numbered> order;
    std::vector<Placed> all;
    order.reserve(count);
    all.reserve(count);
    for (const Part& part : parts)
        for (const Placed& v : part.vertex) {
            order.push_back({v.name, v.level, std::uint32_t(all.size())});
            all.push_back(v);
        }
    std::sort(order.begin(), order.end(), [](const Numbered& a, const Numbered& b) {
        return std::tie(a.name, a.level, a.number) < std::tie(b.name, b.level, b.number);
    });
    std::vector<std::uint32_t> number(all.size());
    for (const Numbered& n : order) {
        const Placed& v = all[n.number];
        if (v.name == 0 || pass.vertex.empty() || pass.vertex.back().order() != v.order())
            pass.vertex.push_back(v);
        number[n.number] = std::uint32_t(pass.vertex.size() - 1);
    }
    std::uint32_t first = 0;
    for (const Part& part : parts) {
        for (std::size_t i = 0; i < part.corner.size(); ++i) {
            const auto& c = part.corner[i];
            pass.piece.push_back(
                {{number[first + c[0]], number[first + c[1]], number[first + c[2]]}, part.cell[i]});
        }
        first += std::uint32_t(part.vertex.size());
        pass.several.insert(pass.several.end(), part.several.begin(), part.several.end());
    }
    return pass;
}

/// The signed distance less the level.
/// \param ends  lattice points around, whose values may tell the side
double Maker::measure(const Vec3& p, std::span<const Point> ends, distance::Nearest& nearest) const {
    nearest = task_.field.tree().find(p);
    const double distance = std::sqrt(nearest.squared);
    if (!task_.field.has_inside()) return distance - task_.level;
    for (const Point& end : ends) {
        const double* const value = tree_.values().find(PointValues::key(end));
        if (value == nullptr) continue;
        const double known = *value + task_.level;
        const double way = norm(p - task_.lattice.position({end[0], end[1], end[2]}));
        if (tree_.same_side(way, std::max(distance, std::abs(known))))
            return (known < 0 ? -distance : distance) - task_.level;
    }
    return (task_.field.inside(p) ? -distance : distance) - task_.level;
}

/// Newton's steps along the segment: where the vertex is there is free, as long as it is within.
void Maker::place_on_segment(const Pass&, Placed& vertex) const {
    const surface::Grid& grid = demand_.frame.grid;
    const int axis = int(vertex.name & 3);
    const Point start = surface::start_of(vertex.name);
    Point end = start;
    end[std::size_t(axis)] += 1u << vertex.level;
    const double from = grid.position(axis, start[std::size_t(axis)]),
                 to = grid.position(axis, end[std::size_t(axis)]), length = to - from;
    const std::array<Point, 2> ends{start, end};
    const double good = (demand_.limits.upper - demand_.limits.lower) / 64;
    constexpr int steps = 4;
    Vec3 at = vertex.at;
    double least = std::numeric_limits<double>::infinity();
    for (int step = 0; step <= steps; ++step) {
        distance::Nearest nearest;
        const double away = measure(at, ends, nearest) - vertex.aim;
        if (!(std::abs(away) < least)) break;
        vertex.at = at, vertex.nearest = nearest.triangle, vertex.away = away;
        least = std::abs(away);
        if (least <= good) break;
        const double distance = std::sqrt(nearest.squared),
                     sign = away + vertex.aim + task_.level < 0 ? -1.0 : 1.0;
        if (!(distance > 0)) break;
        const double slope = sign * (at[axis] - task_.field.nearest_point(nearest, at)[axis]) / distance;
        if (std::abs(slope) < 0x1p-6) break;
        const double fraction =
            std::clamp((at[axis] - away / slope - from) / length, grid.clearance, 1 - grid.clearance);
        double x = from + fraction * length;
        if (grid.rounding.kind != Rounding::Kind::none)
            x = std::clamp(grid.rounding.nearest(axis, x), grid.rounding.next(from, 1),
                           grid.rounding.next(to, -1));
        at[axis] = x;
    }
}

/// The apex of a cone, which may be anywhere in its cell; of finest cells, where it may not, it stays.
void Maker::place_in_cell(const Pass& pass, Placed& vertex) const {
    const surface::Grid& grid = demand_.frame.grid;
    const surface::LeafCell& cell = pass.crossed.leaves.cells[vertex.level];
    const std::array<Point, 1> ends{
        Point{cell.at[0] << cell.level, cell.at[1] << cell.level, cell.at[2] << cell.level}};
    distance::Nearest nearest;
    vertex.away = measure(vertex.at, ends, nearest);
    vertex.nearest = nearest.triangle;
    const double distance = std::sqrt(nearest.squared);
    if (cell.level == 0 || !(distance > 0)) return;
    constexpr double clearance = 1.0 / 16;
    const double sign = vertex.away + task_.level < 0 ? -1.0 : 1.0;
    const Vec3 q = task_.field.nearest_point(nearest, vertex.at);
    Vec3 at;
    for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t i = ends[0][std::size_t(axis)];
        const double from = grid.position(axis, i), to = grid.position(axis, i + (1u << cell.level));
        const double x = vertex.at[axis] - vertex.away * sign * (vertex.at[axis] - q[axis]) / distance;
        at[axis] = grid.rounding.nearest(
            axis, std::clamp(x, from + clearance * (to - from), to - clearance * (to - from)));
    }
    distance::Nearest then;
    const double away = measure(at, ends, then);
    if (std::abs(away) < std::abs(vertex.away))
        vertex.at = at, vertex.nearest = then.triangle, vertex.away = away;
}

/// Vertices on segments of the pass before are where they were then.
void Maker::place(Pass& pass) const {
    std::vector<std::uint32_t> fresh;
    std::size_t before = 0;
    for (std::uint32_t i = 0; i < pass.vertex.size(); ++i) {
        Placed& v = pass.vertex[i];
        while (before < last_.vertex.size() && last_.vertex[before].order() < v.order()) ++before;
        if (v.name != 0 && before < last_.vertex.size() && last_.vertex[before].order() == v.order()) {
            v = last_.vertex[before];
            v.before = std::uint32_t(before);
        } else {
            fresh.push_back(i);
        }
    }
    parallel_for(fresh.size(), grain, [&](std::uint64_t i) {
        Placed& v = pass.vertex[fresh[i]];
        v.name != 0 ? place_on_segment(pass, v) : place_in_cell(pass, v);
    });
}

/// The triangles that are to be proven: those with the three vertices of one that was in the pass before are.
std::vector<std::uint32_t> Maker::pieces_to_prove(Pass& pass) const {
    std::vector<std::pair<Triangle, std::uint32_t>> known;
    for (std::uint32_t i = 0; i < last_.piece.size(); ++i)
        if (last_.piece[i].proven) known.emplace_back(last_.piece[i].corner, i);
    std::sort(known.begin(), known.end());
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < pass.piece.size(); ++i) {
        Piece& piece = pass.piece[i];
        Triangle before{};
        bool all = true;
        for (std::size_t k = 0; k < 3; ++k) {
            before[k] = pass.vertex[piece.corner[k]].before;
            all = all && before[k] != none;
        }
        const auto at = all ? std::lower_bound(known.begin(), known.end(), std::pair(before, 0u)) : known.end();
        if (at != known.end() && at->first == before) {
            piece.range = last_.piece[at->second].range;
            piece.proven = true;
        } else {
            open.push_back(i);
        }
    }
    return open;
}

void Maker::prove(Pass& pass, std::span<const std::uint32_t> pieces) {
    Stage stage(parts_.next(0.1), "proof", pieces.size());
    for_chunks(pieces.size(), grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) {
            Piece& piece = pass.piece[pieces[i]];
            std::array<Located, 3> corner;
            for (std::size_t k = 0; k < 3; ++k) {
                const Placed& v = pass.vertex[piece.corner[k]];
                corner[k] = {v.at, v.nearest};
            }
            piece.range = proof_.range(corner, demand_.limits);
            piece.proven =
                piece.range.lower >= demand_.limits.lower && piece.range.upper <= demand_.limits.upper;
        }
        stage.advance(end - begin);
    });
}

/// Where triangles bend towards M their vertices may as well be farther away, and nearer where they bend off:
/// vertices of triangles that fail are moved once, if all that fail around one do so at the same limit.
void Maker::move(Pass& pass) {
    const double aside = aside_of_slack * (demand_.limits.upper - demand_.limits.lower);
    constexpr std::uint8_t too_near = 1, too_far = 2;
    std::vector<std::uint8_t> fails(pass.vertex.size(), 0);
    for (const Piece& piece : pass.piece)
        if (!piece.proven)
            for (const std::uint32_t v : piece.corner)
                fails[v] |= piece.range.lower >= demand_.limits.lower ? too_far : too_near;
    std::vector<std::uint32_t> moved;
    for (std::uint32_t i = 0; i < pass.vertex.size(); ++i) {
        Placed& v = pass.vertex[i];
        if (v.name == 0 || v.aim != 0 || (fails[i] != too_near && fails[i] != too_far)) continue;
        v.aim = (fails[i] == too_near) != demand_.inner ? aside : -aside;
        moved.push_back(i);
    }
    parallel_for(moved.size(), grain, [&](std::uint64_t i) { place_on_segment(pass, pass.vertex[moved[i]]); });
    std::vector<std::uint8_t> is_moved(pass.vertex.size(), 0);
    for (const std::uint32_t i : moved) is_moved[i] = 1;
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < pass.piece.size(); ++i)
        for (const std::uint32_t v : pass.piece[i].corner)
            if (is_moved[v] && (open.empty() || open.back() != i)) open.push_back(i);
    prove(pass, open);
}

/// What is to be halved for a triangle that is not proven: where a vertex is not where the level is, and a
/// larger cell around it prescribes the values there, that; else its own cell.
void Maker::blame(const Pass& pass, const Piece& piece, std::vector<std::uint32_t>& halved) const {
    const double misplaced = (demand_.limits.upper - demand_.limits.lower) / 4;
    const std::uint32_t own = pass.crossed.node[piece.cell];
    const int level = tree_.node(own).level;
    const std::size_t before = halved.size();
    for (const std::uint32_t number : piece.corner) {
        const Placed& v = pass.vertex[number];
        if (v.name == 0 || std::abs(v.away) <= misplaced) continue;
        Point p = surface::start_of(v.name);
        tree_.leaves_around(p, level + 1, halved);
        p[v.name & 3] += 1u << v.level;
        tree_.leaves_around(p, level + 1, halved);
    }
    if (halved.size() == before && level > 0) halved.push_back(own);
}

std::vector<std::uint32_t> Maker::to_halve(const Pass& pass) const {
    std::vector<std::uint32_t> halved;
    bool failed = false;
    for (const std::uint32_t i : pass.several) halved.push_back(pass.crossed.node[i]);
    for (const Piece& piece : pass.piece) {
        if (piece.proven) continue;
        failed = true;
        blame(pass, piece, halved);
    }
    std::sort(halved.begin(), halved.end());
    halved.erase(std::unique(halved.begin(), halved.end()), halved.end());
    if (failed && halved.empty()) give_up();
    return halved;
}

void Maker::give_up() const {
    throw OptionError(fmt::format(
        "distances between {:.6g} and {:.6g} cannot be proven with the finest cells there are, {:.3g} "
        "wide; choose a slack larger than {:.3g}, or move the mesh nearer to the origin",
        demand_.limits.lower, demand_.limits.upper, task_.lattice.width,
        demand_.limits.upper - demand_.limits.lower));
}

Mesh Maker::mesh_of(const Pass& pass) const {
    Mesh mesh;
    mesh.vertices.reserve(pass.vertex.size());
    mesh.triangles.reserve(pass.piece.size());
    for (const Placed& v : pass.vertex) mesh.vertices.push_back(v.at);
    for (const Piece& piece : pass.piece) mesh.triangles.push_back(piece.corner);
    return mesh;
}

/// A vertex of each set of triangles that share vertices, the lowest.
std::vector<Vec3> one_vertex_each(const mesh::Arrays& mesh) {
    DisjointSets sets(mesh.vertices.size());
    std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
    for (const Triangle& t : mesh.triangles) {
        sets.join(t[0], t[1]);
        sets.join(t[0], t[2]);
        used[t[0]] = 1;
    }
    std::vector<std::uint8_t> seen(mesh.vertices.size(), 0);
    std::vector<Vec3> result;
    for (std::uint32_t v = 0; v < used.size(); ++v) {
        if (!used[v]) continue;
        const std::uint32_t set = sets.find(v);
        if (!seen[set]) result.push_back(mesh.vertices[v]);
        seen[set] = 1;
    }
    return result;
}

/// Leaves to halve where a part of M is not enclosed, or a part of the surface is on the other side of M; and
/// where nothing is deep enough for an inner surface, as far as is known.
std::vector<std::uint32_t> Maker::wrong_sides(OffsetSurface& result) const {
    const Mesh& mesh = result.mesh;
    if (demand_.inner && mesh.triangles.empty())
        return tree_.wide_leaves((demand_.limits.upper - demand_.limits.lower) / 2);
    std::vector<std::uint32_t> halved;
    const auto blame_leaf = [&](const Vec3& p) {
        const std::uint32_t leaf = tree_.leaf_of(p);
        if (tree_.node(leaf).level == 0) give_up();
        halved.push_back(leaf);
    };
    const std::vector<Vec3> of_mesh = one_vertex_each(demand_.mesh), own = one_vertex_each(mesh);
    result.mesh_components = of_mesh.size();
    result.components = own.size();
    if (!demand_.inner) {
        const winding::XRays rays(mesh.vertices, mesh.triangles);
        for (const Vec3& p : of_mesh)
            if (rays.crossings(p) != 1) blame_leaf(p);
    }
    for (const Vec3& p : own)
        if (task_.field.has_inside() && task_.field.inside(p) != demand_.inner) blame_leaf(p);
    std::sort(halved.begin(), halved.end());
    halved.erase(std::unique(halved.begin(), halved.end()), halved.end());
    return halved;
}

void Maker::finish(const Pass& pass, OffsetSurface& result) const {
    result.cells = pass.crossed.leaves.cells.size();
    if (pass.piece.empty()) return;
    result.range = pass.piece[0].range;
    for (const Piece& piece : pass.piece) {
        result.range.lower = std::min(result.range.lower, piece.range.lower);
        result.range.upper = std::max(result.range.upper, piece.range.upper);
    }
}

}  // namespace

OffsetSurface make_offset_surface(const OffsetDemand& demand, const OffsetTask& task, OffsetTree& tree,
                                  surface::MemoryGuard& guard, const Progress& progress) {
    return Maker(demand, task, tree, guard, progress).run();
}

}  // namespace its::wrapper
