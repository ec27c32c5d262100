#include "query/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/far.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "its/inspect.h"

namespace its::query {

namespace {

/// A point, where it is in the root cube, and the patch there.
struct Located {
    Vec3 u, in, local;
    Patch patch;
    double width;  ///< of the patch
};

Located locate(const QueryIndex& index, const Vec3& point) {
    Located at;
    at.u = index.to_lattice(point);
    for (int axis = 0; axis < 3; ++axis) at.in[axis] = std::clamp(at.u[axis], 0.0, index.cells);
    at.patch = find_patch(index, clamped_cell(index, at.in));
    at.width = double(std::uint64_t{1} << at.patch.level);
    const Vec3 corner{double(at.patch.cell[0]), double(at.patch.cell[1]), double(at.patch.cell[2])};
    at.local = (1.0 / at.width) * at.in - corner;
    return at;
}

}  // namespace

double field_value(const QueryIndex& index, const Vec3& point) {
    if (!finite(point)) return std::numeric_limits<double>::quiet_NaN();
    const Located at = locate(index, point);
    const double inner = geometry::trilinear(at.patch.value, at.local);
    if (!geometry::far_beyond(at.u)) return index.width * (inner + norm(at.u - at.in));
    return index.width * inner + geometry::norm_at_any_size(geometry::beyond(point, index.shell.info.root));
}

Vec3 field_gradient(const QueryIndex& index, const Vec3& point) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (!finite(point)) return {nan, nan, nan};
    const Located at = locate(index, point);
    Vec3 gradient;
    geometry::trilinear_with_gradient(at.patch.value, at.local, gradient);
    gradient = (1.0 / at.width) * gradient;
    geometry::set_beyond(
        gradient, geometry::far_beyond(at.u) ? geometry::beyond(point, index.shell.info.root) : at.u - at.in);
    return gradient;
}

void require_distances(const ShellInfo& info) {
    if (info.solver != Solver::direct)
        throw OptionError(
            "signed_distance_bound: the shell was built with the solver lscg, whose grid values are not "
            "distances; build it with the direct solver");
    if (info.sign == SignRule::generalized)
        throw OptionError(
            "signed_distance_bound: under the sign rule generalized grid values beside filled holes are less "
            "than the distance; use closest points");
}

/// Of a point so far away that the root cube, whose side is less than 2⁻³⁸⁰ of the distance to it, changes no
/// digit: that distance errs by 8u in computing, and by less than u where M is in the cube.
static Interval far_bound(const Vec3& point, const Box& root) {
    constexpr double most = std::numeric_limits<double>::max();
    const double distance = geometry::norm_at_any_size(geometry::beyond(point, root));
    return {std::min(distance, most) * (1 - 16 * unit_roundoff), distance * (1 + 16 * unit_roundoff)};
}

Interval distance_bound(const QueryIndex& index, const Vec3& point) {
    const Vec3 u = index.to_lattice(point);
    if (geometry::far_beyond(u)) return far_bound(point, index.shell.info.root);
    Vec3 in;
    for (int axis = 0; axis < 3; ++axis) in[axis] = std::clamp(u[axis], 0.0, index.cells);
    const octree::Cell finest = clamped_cell(index, in);
    const int depth = index.shell.octree.depth;
    const Place at = descend(index.levels.data(), 0, depth, finest);
    // M is in the root cube.
    double lower = norm(u - in), upper = std::numeric_limits<double>::infinity();
    // By corner c of child `child` of a group.
    const auto bound = [&](std::uint64_t group, unsigned child, int level, unsigned c) {
        const double width = double(std::uint64_t{1} << level);
        Vec3 corner;
        for (int axis = 0; axis < 3; ++axis)
            corner[axis] = width * double((finest[axis] >> level) + (c >> axis & 1));
        const double value =
            index.levels[std::size_t(level)]
                .values[octree::group_points * group + unsigned(octree::group_point(int(child), int(c)))];
        const double apart = norm(u - corner), distance = std::abs(value);
        lower = std::max(lower, distance - apart);
        upper = std::min(upper, distance + apart);
    };
    if (!index.adaptive)
        for (unsigned c = 0; c < 8; ++c) bound(at.group, at.child, at.level, c);
    else  // other corners may hang; the middle of a group never does, nor do those of the groups above
        for (Place p{0, child_at(finest, depth), depth, false};; --p.level) {
            bound(p.group, p.child, p.level, 7 - p.child);
            if (p.level == at.level) break;
            p.group = rank(index.levels[std::size_t(p.level)], p.group, p.child);
            p.child = child_at(finest, p.level - 1);
        }
    // In cell widths: D(g) errs by 42u·R, less than the 4096u·R allowed here, p's lattice coordinates by 2u·(R
    // + |u − in|) an axis, and |p − g|, sums and the product with w by a few roundings of at most 2R + |u − in|
    // (docs/design/query.md).
    const double slack = 8192 * unit_roundoff * (index.cells + norm(u - in));
    return {index.width * std::max(lower - slack, 0.0), index.width * (upper + slack)};
}

Interval with_side(const Interval& distance, Side side, SignRule rule) {
    if (side == Side::on_surface) return {0, 0};
    if (side == Side::inside && rule != SignRule::unsigned_rule) return {-distance.upper, -distance.lower};
    return distance;
}

}  // namespace its::query
