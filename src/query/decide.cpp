#include "query/decide.h"

#include <limits>

#include "its/inspect.h"
#include "query/crossing.h"
#include "query/open_sides.h"

namespace its::query {

namespace {

/// The end of a monotone walk from a point along x, y and z: a corner of the cell.
/// \param up  1: where f does not fall; −1: where it does not rise; up to rounding, see walk_margin
int walk(const double (&value)[8], const Vec3& p, double up) {
    const auto mix = geometry::lerp_exact_at_zero;
    double face[4], edge[2];
    const auto on_face = [&](const double* v) {  // across x: bilinear in y and z
        return mix(mix(v[0], v[2], p.y), mix(v[4], v[6], p.y), p.z);
    };
    const int x = up * on_face(value + 1) > up * on_face(value) ? 1 : 0;
    for (int i = 0; i < 4; ++i) face[i] = value[2 * i + x];
    const int y = up * mix(face[1], face[3], p.z) > up * mix(face[0], face[2], p.z) ? 1 : 0;
    for (int i = 0; i < 2; ++i) edge[i] = face[2 * i + y];
    const int z = up * edge[1] > up * edge[0] ? 1 : 0;
    return x + 2 * y + 4 * z;
}

/// By f alone: 1, −1, or 0 where only the triangles can tell.
int side_by_field(const QueryIndex& index, const SurfacePoint& at, std::uint64_t cell) {
    const ShellInfo& info = index.shell.info;
    if (info.solver != Solver::direct) return 0;  // corner values are not distances to the last bit
    double value[8];
    const double f = surface_value(index, at, value);
    const float lower = index.shell.surface.lower[cell], upper = index.shell.surface.upper[cell];
    const double margin = index.adaptive ? margin_of(value) : walk_margin;
    if (info.sign == SignRule::unsigned_rule)  // no inside: off M suffices
        return f > upper + margin || f < lower - margin ? 1 : 0;
    if (!index.adaptive)
        if (const int side = side_by_bounds(f, lower, upper)) return side;
    int end = 0;
    if (f > upper + margin)
        end = walk(value, at.local, 1);
    else if (f < lower - margin)
        end = walk(value, at.local, -1);
    else
        return 0;
    if (index.adaptive) return corners_inside(index, at, cell) >> end & 1 ? -1 : 1;
    return geometry::detail::sign(value[end]);  // D's sign is exact where D is not 0
}

/// Inside by the sign rule, of a winding number.
bool is_inside(SignRule rule, std::int64_t winding) {
    if (rule == SignRule::even_odd) return winding % 2 != 0;
    return rule != SignRule::unsigned_rule && winding >= 1;
}

/// Where the segment from a point ends: a corner of its cell, displaced, and its winding number.
struct Goal {
    Vec3 corner;
    std::int64_t winding;
};

/// The lowest corner, whose winding number is stored. Where all numbers are 0 or 1 the nearest one, which fewer
/// triangles part from the point, if the sign of its distance tells the number.
Goal choose_goal(const QueryIndex& index, const SurfacePoint& at, std::uint64_t cell) {
    const shell::ShellData& shell = index.shell;
    std::array<std::int64_t, 3> corner = {at.corner[0], at.corner[1], at.corner[2]};
    if (index.open) return {shell.lattice.position(corner), index.open->numbers(index, at, cell).lowest};
    if (!shell.sides.winding.empty()) return {shell.lattice.position(corner), shell.sides.winding[cell]};
    std::int64_t winding = index.levels[std::size_t(at.level)].inside[at.group] >> at.child & 1;
    if (shell.info.sign == SignRule::unsigned_rule || shell.info.solver != Solver::direct)
        return {shell.lattice.position(corner), winding};
    const unsigned nearest =
        unsigned(at.local.x > 0.5) | unsigned(at.local.y > 0.5) << 1 | unsigned(at.local.z > 0.5) << 2;
    if (index.adaptive) {
        winding = shell.surface.corners_inside[cell] >> nearest & 1;
    } else {
        double value[8];
        corner_values(index.levels[0], at.group, at.child, value);
        if (value[nearest] == 0) return {shell.lattice.position(corner), winding};
        winding = value[nearest] < 0 ? 1 : 0;
    }
    for (unsigned axis = 0; axis < 3; ++axis) corner[axis] += std::int64_t(nearest >> axis & 1) << at.level;
    return {shell.lattice.position(corner), winding};
}

/// Signed crossings of the segment from the point to a displaced corner of the cell: all triangles that it can
/// meet are in the cell's list.
Side side_by_triangles(const QueryIndex& index, const Vec3& p, const SurfacePoint& at, std::uint64_t cell) {
    const shell::ShellData& shell = index.shell;
    const Goal goal = choose_goal(index, at, cell);
    std::int64_t winding = goal.winding;
    for (const std::uint32_t number : triangles_of(index, at.group, at.child, at.level)) {
        const Triangle& t = shell.mesh.triangles[number];
        const Vec3 &a = shell.mesh.vertices[t[0]], &b = shell.mesh.vertices[t[1]],
                   &c = shell.mesh.vertices[t[2]];
        if (!boxes_meet(a, b, c, p, goal.corner)) continue;
        const int side = geometry::orient3d(a, b, c, p);
        if (side == 0 && triangle_holds(a, b, c, p)) return Side::on_surface;
        winding -= displaced_crossing(a, b, c, p, side, goal.corner);
    }
    return is_inside(shell.info.sign, winding) ? Side::inside : Side::outside;
}

}  // namespace

unsigned corners_inside(const QueryIndex& index, const SurfacePoint& at, std::uint64_t cell) {
    if (index.open) return index.open->numbers(index, at, cell).inside;
    return index.shell.surface.corners_inside[cell];
}

bool on_surface(const QueryIndex& index, const Vec3& point) {
    const Vec3 u = index.to_lattice(point);
    if (!index.in_root(u)) return false;
    const shell::ShellData& shell = index.shell;
    const Place at = descend(index.levels.data(), 0, shell.octree.depth, finest_cell(u));
    if (!at.marked) return false;
    for (const std::uint32_t number : triangles_of(index, at.group, at.child, at.level)) {
        const Triangle& t = shell.mesh.triangles[number];
        if (triangle_holds(shell.mesh.vertices[t[0]], shell.mesh.vertices[t[1]], shell.mesh.vertices[t[2]],
                           point))
            return true;
    }
    return false;
}

Side decide(const QueryIndex& index, const Vec3& point, const SurfacePoint& at) {
    const std::uint64_t cell = surface_number(index.levels.data(), at.group, at.child, at.level);
    if (const int side = side_by_field(index, at, cell)) return Side(side);
    return side_by_triangles(index, point, at, cell);
}

WindingNumber winding_off_surface(const QueryIndex& index, const winding::MeshWinding& mesh,
                                  const Vec3& point) {
    if (on_surface(index, point))
        return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
    const winding::WindingEstimate w = mesh.at(point);
    return {w.value, w.error};
}

bool contained(Side side, const std::optional<bool>& when_uncertain) {
    if (side != Side::uncertain) return side != Side::outside;
    if (!when_uncertain)
        throw OptionError(
            "contains: a point's side is uncertain, since its winding number is within its error "
            "of 1/2; say what is to be answered then");
    return *when_uncertain;
}

Side classify_in_root(const QueryIndex& index, const Vec3& point, const Vec3& u) {
    if (index.open) {
        const std::uint32_t node = index.open->resolve(index, u);
        if (!OpenSides::is_steady(node)) return index.open->side(index, node, point, u);
    }
    const octree::Cell finest = finest_cell(u);
    const std::uint32_t entry = index.top[index.top_index(finest)];
    if (!(entry & (QueryIndex::subdivided | QueryIndex::surface)))
        return entry & QueryIndex::inside ? Side::inside : Side::outside;
    const LevelView* const levels = index.levels.data();
    const Place at = entry & QueryIndex::subdivided
                         ? descend(levels, entry & ~QueryIndex::subdivided, index.level - 1, finest)
                         : descend(levels, 0, index.shell.octree.depth, finest);
    if (!at.marked) return inside_bit(levels, at) ? Side::inside : Side::outside;
    return decide(index, point, surface_point(at, finest, u));
}

Decision how_decided(const QueryIndex& index, const SurfacePoint& at) {
    const std::uint64_t cell = surface_number(index.levels.data(), at.group, at.child, at.level);
    if (side_by_field(index, at, cell) == 0) return Decision::local;
    double value[8];
    const double f = surface_value(index, at, value);
    const shell::SurfaceCells& surface = index.shell.surface;
    if (index.adaptive)
        return side_by_corners(f, value, corners_inside(index, at, cell), surface.lower[cell],
                               surface.upper[cell]) != 0
                   ? Decision::bounds
                   : Decision::walk;
    return side_by_bounds(f, surface.lower[cell], surface.upper[cell]) != 0 ? Decision::bounds : Decision::walk;
}

}  // namespace its::query
