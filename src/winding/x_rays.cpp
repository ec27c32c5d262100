#include "winding/x_rays.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/box.h"
#include "geometry/predicates.h"

namespace its::winding {

namespace {

constexpr double most_bins = 2048;                 // a side
constexpr std::uint64_t entries_per_triangle = 8;  // on average, at most

}  // namespace

XRays::XRays(std::span<const Vec3> points, std::span<const Triangle> triangles)
    : points_(points), triangles_(triangles) {
    if (triangles.empty()) return;
    box_ = geometry::bounds(points, triangles);
    side_ = std::int64_t(std::clamp(0.5 * std::sqrt(double(triangles.size())), 1.0, most_bins));
    const auto for_ranges = [&](auto&& fn) {
        for (std::uint32_t i = 0; i < triangles.size(); ++i) {
            const Vec3 &a = points[triangles[i][0]], &b = points[triangles[i][1]], &c = points[triangles[i][2]];
            fn(i, bin(1, std::min({a.y, b.y, c.y})), bin(1, std::max({a.y, b.y, c.y})),
               bin(2, std::min({a.z, b.z, c.z})), bin(2, std::max({a.z, b.z, c.z})));
        }
    };
    const auto for_bins = [&](auto&& fn) {
        for_ranges([&](std::uint32_t i, std::int64_t y_low, std::int64_t y_high, std::int64_t z_low,
                       std::int64_t z_high) {
            for (std::int64_t z = z_low; z <= z_high; ++z)
                for (std::int64_t y = y_low; y <= y_high; ++y) fn(std::uint64_t(z * side_ + y), i);
        });
    };
    for (std::uint64_t entries = 0; side_ > 1;
         side_ = (side_ + 1) / 2, entries = 0) {  // large triangles, few bins
        for_ranges([&](std::uint32_t, std::int64_t y_low, std::int64_t y_high, std::int64_t z_low,
                       std::int64_t z_high) {
            entries += std::uint64_t((y_high - y_low + 1) * (z_high - z_low + 1));
        });
        if (entries <= entries_per_triangle * triangles.size()) break;
    }
    first_.assign(std::uint64_t(side_ * side_) + 1, 0);
    for_bins([&](std::uint64_t at, std::uint32_t) { ++first_[at + 1]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    index_.resize(first_.back());
    std::vector<std::uint64_t> next(first_.begin(), first_.end() - 1);
    for_bins([&](std::uint64_t at, std::uint32_t i) { index_[next[at]++] = i; });
}

/// Monotone in `at`, so a triangle is in the bin of every ray that it may meet.
std::int64_t XRays::bin(int axis, double at) const {
    const double size = box_.max[axis] - box_.min[axis];
    const double place = size > 0 ? (at - box_.min[axis]) / size * double(side_) : 0;
    return std::clamp(std::int64_t(std::clamp(place, 0.0, double(side_))), std::int64_t{0}, side_ - 1);
}

int XRays::crossings(const Vec3& p) const {
    if (triangles_.empty() || p.y < box_.min.y || p.y > box_.max.y || p.z < box_.min.z || p.z > box_.max.z ||
        p.x < box_.min.x)
        return 0;
    // The ray as a segment; where p is beyond everything its end may be, too.
    const double reach = std::max(std::abs(box_.min.x), std::abs(box_.max.x));
    const Vec3 from{-2 * std::max(reach, std::abs(p.x)) - 1e-300, p.y, p.z};
    const auto at = std::uint64_t(bin(2, p.z) * side_ + bin(1, p.y));
    int sum = 0;
    for (std::uint64_t i = first_[at]; i < first_[at + 1]; ++i) {
        const Triangle& t = triangles_[index_[i]];
        sum += geometry::x_line_crossing(points_[t[0]], points_[t[1]], points_[t[2]], from, p.x);
    }
    return sum;
}

}  // namespace its::winding
