#include "query/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
    return index.width * (geometry::trilinear(at.patch.value, at.local) + norm(at.u - at.in));
}

Vec3 field_gradient(const QueryIndex& index, const Vec3& point) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (!finite(point)) return {nan, nan, nan};
    const Located at = locate(index, point);
    Vec3 gradient;
    geometry::trilinear_with_gradient(at.patch.value, at.local, gradient);
    gradient = (1.0 / at.width) * gradient;
    const Vec3 away = at.u - at.in;
    const double distance = norm(away);
    if (distance == 0) return gradient;
    for (int axis = 0; axis < 3; ++axis)  // f(clamp(u)) does not change along an axis that is clamped
        gradient[axis] = away[axis] == 0 ? gradient[axis] : away[axis] / distance;
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

Interval distance_bound(const QueryIndex& index, const Vec3& point) {
    const Vec3 u = index.to_lattice(point);
    Vec3 in;
    for (int axis = 0; axis < 3; ++axis) in[axis] = std::clamp(u[axis], 0.0, index.cells);
    const octree::Cell finest = clamped_cell(index, in);
    const int depth = index.shell.octree.depth;
    const Place at = descend(index.levels.data(), 0, depth, finest);
    double lower = 0, upper = std::numeric_limits<double>::infinity();
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
