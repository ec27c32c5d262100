#include "signs/hole_points.h"

#include <algorithm>
#include <limits>

#include "octree/octree.h"

namespace its::signs {

HolePoints::HolePoints(std::vector<Point> points) {
    if (points.empty()) return;
    std::sort(points.begin(), points.end());
    filter_.resize(std::size_t{1} << filter_bits);
    for (const Point& p : points) {
        if (!code_.empty() && code_.back() == p.code) continue;
        code_.push_back(p.code);
        distance_.push_back(p.distance);
        filter_[place(p.code >> 3)] = true;
    }
}

std::size_t HolePoints::place(std::uint64_t block) {
    return std::size_t((block * 0x9e3779b97f4a7c15ull) >> (64 - filter_bits));
}

double HolePoints::distance(std::uint64_t code) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!may_have(code >> 3)) return infinity;
    const auto it = std::lower_bound(code_.begin(), code_.end(), code);
    return it != code_.end() && *it == code ? distance_[std::size_t(it - code_.begin())] : infinity;
}

void HolePoints::shorten(const octree::Cell& parent, int level, double* distance) const {
    if (code_.empty()) return;
    if (level == 0) {  // the points are in eight blocks
        bool any = false;
        for (std::uint32_t i = 0; i < 8; ++i)
            any = any || may_have(octree::morton_encode(
                             {parent[0] + (i & 1), parent[1] + (i >> 1 & 1), parent[2] + (i >> 2)}));
        if (!any) return;
    }
    for (std::uint32_t p = 0; p < std::uint32_t(octree::group_points); ++p) {
        const std::uint64_t code =
            octree::morton_encode({(2 * parent[0] + p % 3) << level, (2 * parent[1] + p / 3 % 3) << level,
                                   (2 * parent[2] + p / 9) << level});
        distance[p] = std::min(distance[p], this->distance(code));
    }
}

}  // namespace its::signs
