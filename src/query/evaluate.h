#pragma once

#include "its/inspect.h"
#include "its/query.h"
#include "query/index.h"

/// f, its gradient and bounds of the distance at one point.
namespace its::query {

/// NaN for a non-finite point.
double field_value(const QueryIndex& index, const Vec3& point);
Vec3 field_gradient(const QueryIndex& index, const Vec3& point);

inline ShellSide shell_side(const ShellInfo& info, double f) {
    return ShellSide(int(f > info.epsilon_outer) - int(f < info.epsilon_inner));
}

/// \throws OptionError if grid values are not distances
void require_distances(const ShellInfo& info);

/// Encloses the distance of a finite point to M, mesh units.
Interval distance_bound(const QueryIndex& index, const Vec3& point);

/// The signed distance, of the distance and the side.
Interval with_side(const Interval& distance, Side side, SignRule rule);

}  // namespace its::query
