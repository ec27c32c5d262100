#include "query/decide.h"

#include "query/crossing.h"

namespace its {

namespace {

/// The end of a monotone walk from a point along x, y and z: the value of f at a corner of the cell.
/// \param up  1: where f does not fall; −1: where it does not rise; up to rounding, see walk_margin
double walk(const double (&value)[8], const Vec3& p, double up) {
    const auto mix = lerp_exact_at_zero;
    double face[4], edge[2];
    const auto on_face = [&](const double* v) {  // across x: bilinear in y and z
        return mix(mix(v[0], v[2], p.y), mix(v[4], v[6], p.y), p.z);
    };
    const int x = up * on_face(value + 1) > up * on_face(value) ? 1 : 0;
    for (int i = 0; i < 4; ++i) face[i] = value[2 * i + x];
    const int y = up * mix(face[1], face[3], p.z) > up * mix(face[0], face[2], p.z) ? 1 : 0;
    for (int i = 0; i < 2; ++i) edge[i] = face[2 * i + y];
    return up * edge[1] > up * edge[0] ? edge[1] : edge[0];
}

/// By f alone: 1, −1, or 0 where only the triangles can tell.
int side_by_field(const QueryIndex& index, const SurfacePoint& at, std::uint64_t cell) {
    const ShellInfo& info = index.shell.info;
    if (info.solver != Solver::direct) return 0;  // corner values are not distances to the last bit
    double value[8];
    const double f = surface_value(index, at, value);
    const float lower = index.shell.surface.lower[cell], upper = index.shell.surface.upper[cell];
    if (info.sign == SignRule::unsigned_rule)  // no inside: off M suffices
        return f > upper + walk_margin || f < lower - walk_margin ? 1 : 0;
    if (const int side = side_by_bounds(f, lower, upper)) return side;
    double end = 0;
    if (f > upper + walk_margin) end = walk(value, at.local, 1);
    if (f < lower - walk_margin) end = walk(value, at.local, -1);
    return detail::sign(end);  // D's sign is exact where D is not 0
}

/// Inside by the sign rule, of a winding number.
bool is_inside(SignRule rule, std::int64_t winding) {
    return rule != SignRule::unsigned_rule && winding >= 1;
}

/// Signed crossings of the segment from the point to the cell's displaced lowest corner: all triangles that it
/// can meet are in the cell's list.
Side side_by_triangles(const QueryIndex& index, const Vec3& p, const SurfacePoint& at, std::uint64_t cell) {
    const ShellData& shell = index.shell;
    const Vec3 corner = shell.lattice.position({at.finest[0], at.finest[1], at.finest[2]});
    std::int64_t winding = shell.sides.winding.empty() ? index.levels[0].inside[at.group] >> at.child & 1
                                                       : shell.sides.winding[cell];
    for (const std::uint32_t number : shell.triangles(at.group, int(at.child))) {
        const Triangle& t = shell.mesh.triangles[number];
        const Vec3 &a = shell.mesh.vertices[t[0]], &b = shell.mesh.vertices[t[1]],
                   &c = shell.mesh.vertices[t[2]];
        if (!boxes_meet(a, b, c, p, corner)) continue;
        const int side = orient3d(a, b, c, p);
        if (side == 0 && triangle_holds(a, b, c, p)) return Side::on_surface;
        winding -= displaced_crossing(a, b, c, p, side, corner);
    }
    return is_inside(shell.info.sign, winding) ? Side::inside : Side::outside;
}

}  // namespace

Side decide(const QueryIndex& index, const Vec3& point, const SurfacePoint& at) {
    const std::uint64_t cell = rank(index.levels[0], at.group, at.child);
    if (const int side = side_by_field(index, at, cell)) return Side(side);
    return side_by_triangles(index, point, at, cell);
}

Decision how_decided(const QueryIndex& index, const SurfacePoint& at) {
    const std::uint64_t cell = rank(index.levels[0], at.group, at.child);
    if (side_by_field(index, at, cell) == 0) return Decision::local;
    double value[8];
    const double f = surface_value(index, at, value);
    const SurfaceCells& surface = index.shell.surface;
    return side_by_bounds(f, surface.lower[cell], surface.upper[cell]) != 0 ? Decision::bounds : Decision::walk;
}

}  // namespace its
