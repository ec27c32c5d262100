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
    return classify_in_root(index, point, u);
}

bool Query::contains(const Vec3& point, std::optional<bool> when_uncertain) const {
    return contained(classify(point), when_uncertain);
}

WindingNumber Query::winding_number(const Vec3& point) const {
    require_finite(point);
    return winding_off_surface(data_->index, data_->winding(), point);
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
    return data_->index.memory_bytes() + data_->winding_bytes();
}

}  // namespace its
