#include "its/query.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/names.h"
#include "geometry/vec3.h"
#include "query/access.h"
#include "query/decide.h"
#include "query/evaluate.h"

namespace its {
using namespace query;

namespace {

void require_finite(const Vec3& p) {
    if (!finite(p))
        throw InputError(fmt::format("point ({}, {}, {}): coordinates must be finite", p.x, p.y, p.z));
}

constexpr Named<ShellSide> sides[] = {
    {ShellSide::inside, "inside"}, {ShellSide::on_shell, "on_shell"}, {ShellSide::outside, "outside"}};

}  // namespace

std::string_view name(ShellSide side) {
    return name_in(sides, side);
}

std::optional<ShellSide> parse_shell_side(std::string_view name) {
    return value_in(sides, name);
}

const QueryIndex& query::Access::index(const Query& query) {
    return query.data_->index;
}

Query::Query(const ThinShell& shell) : data_(std::make_shared<const Data>(shell)) {}

const ThinShell& Query::shell() const {
    return data_->shell;
}

Side Query::classify(const Vec3& point) const {
    const QueryIndex& index = data_->index;
    const Vec3 u = index.to_lattice(point);
    if (!index.in_root(u)) {
        require_finite(point);
        return Side::outside;
    }
    if (!constant_off_surface(data_->shell.info().sign))
        return side_by_sign_of_field(index, point, field_value(index, point));
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

ShellSide Query::classify_shell(const Vec3& point) const {
    require_finite(point);
    return shell_side(data_->shell.info(), value(point));
}

Side Query::classify_shell(const Vec3& point, const ClosestSides& closest) const {
    const ShellSide side = classify_shell(point);
    return side == ShellSide::on_shell ? closest.side(point) : Side(side);
}

double Query::value(const Vec3& point) const {
    return field_value(data_->index, point);
}

Vec3 Query::gradient(const Vec3& point) const {
    return field_gradient(data_->index, point);
}

Interval Query::signed_distance_bound(const Vec3& point) const {
    require_finite(point);
    require_distances(data_->shell.info());
    return with_side(distance_bound(data_->index, point), classify(point), data_->shell.info().sign);
}

std::uint64_t Query::memory_bytes() const {
    return data_->index.memory_bytes();
}

}  // namespace its
