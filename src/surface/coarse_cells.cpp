#include "surface/coarse_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "geometry/trilinear.h"
#include "surface/level_cells.h"

namespace its::surface {

namespace {

constexpr std::uint64_t group_grain = 1024, min_tasks = 256;

octree::Cell child_of(const octree::Cell& at, int child) {
    return {2 * at[0] + (child & 1), 2 * at[1] + (child >> 1 & 1), 2 * at[2] + std::uint32_t(child >> 2)};
}

}  // namespace

CoarseCells::CoarseCells(const octree::Octree& octree, const field::Field& field, double ratio,
                         std::uint32_t side)
    : octree_(octree),
      field_(field),
      ratio_(ratio),
      side_(side),
      level_(std::clamp(std::ilogb(ratio), 0, octree.depth)),
      ranges_(std::size_t(octree.depth) + 1) {
    for (int level = 0; level <= octree.depth; ++level) {
        const octree::Level& groups = octree.levels[level];
        auto& ranges = ranges_[std::size_t(level)];
        ranges.resize(groups.groups());
        parallel_for(groups.groups(), group_grain, [&](std::uint64_t g) {
            const double* const values = field.values[level].data() + octree::group_points * g;
            const auto [least, most] = std::minmax_element(values, values + octree::group_points);
            ValueRange range{*least, *most};
            if (level > 0)
                for (std::uint64_t child = groups.first[g]; child < groups.first[g + 1]; ++child) {
                    const ValueRange& below = ranges_[std::size_t(level) - 1][child];
                    range = {std::min(range.least, below.least), std::max(range.most, below.most)};
                }
            ranges[g] = range;
        });
    }
}

/// One search.
class CoarseFinder {
public:
    CoarseFinder(const CoarseCells& of, double low, double high, std::vector<std::uint64_t>& keys)
        : of_(of), low_(low), high_(high), keys_(keys) {}

    /// A cell of level + 1 whose children are the group's: all of it, or its leaves only.
    void visit_group(int level, std::uint64_t group, const octree::Cell& at, bool all) {
        const CoarseCells::ValueRange& range = of_.ranges_[std::size_t(level)][group];
        if (!crossed(range.least, range.most)) return;
        if (level + 1 <= of_.level_) return emit(level + 1, at);
        const octree::Level& groups = of_.octree_.levels[level];
        const double* const points = of_.field_.values[level].data() + octree::group_points * group;
        const unsigned mask = level > 0 ? groups.mask[group] : 0;
        std::uint64_t next = groups.first[group];
        for (int c = 0; c < 8; ++c) {
            if (mask >> c & 1) {
                if (all) visit_group(level - 1, next, child_of(at, c), true);
                ++next;
                continue;
            }
            std::array<double, 8> corner;
            for (int i = 0; i < 8; ++i) corner[std::size_t(i)] = points[octree::group_point(c, i)];
            visit_leaf(level, child_of(at, c), corner);
        }
    }

private:
    bool crossed(double least, double most) const { return least < high_ && most >= low_; }

    void visit_leaf(int level, const octree::Cell& at, const std::array<double, 8>& corner) {
        const auto [least, most] = std::minmax_element(corner.begin(), corner.end());
        if (!crossed(*least, *most)) return;
        if (level <= of_.level_) return emit(level, at);
        for (int c = 0; c < 8; ++c) {
            std::array<double, 8> half;
            for (int i = 0; i < 8; ++i) {
                const Vec3 p{0.5 * ((c & 1) + (i & 1)), 0.5 * ((c >> 1 & 1) + (i >> 1 & 1)),
                             0.5 * ((c >> 2) + (i >> 2))};
                half[std::size_t(i)] = geometry::trilinear(corner.data(), p);
            }
            visit_leaf(level - 1, child_of(at, c), half);
        }
    }

    /// The lattice's cells that the octree's cell reaches into.
    void emit(int level, const octree::Cell& at) {
        const double width = std::ldexp(1.0, level), last = of_.side_ - 1.0;
        std::array<std::uint32_t, 3> from, to;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double low = at[axis] * width / of_.ratio_, high = (at[axis] + 1) * width / of_.ratio_;
            from[axis] = std::uint32_t(std::clamp(std::floor(low), 0.0, last));
            to[axis] = std::uint32_t(std::clamp(std::ceil(high) - 1, double(from[axis]), last));
        }
        for (std::uint32_t z = from[2]; z <= to[2]; ++z)
            for (std::uint32_t y = from[1]; y <= to[1]; ++y)
                for (std::uint32_t x = from[0]; x <= to[0]; ++x) keys_.push_back(key_of({x, y, z}));
    }

    const CoarseCells& of_;
    double low_, high_;
    std::vector<std::uint64_t>& keys_;
};

std::vector<std::uint64_t> CoarseCells::find(double low, double high) const {
    struct Task {
        int level;
        std::uint64_t group;
    };
    int split = octree_.depth;
    while (split > level_ && octree_.levels[split].groups() < min_tasks) --split;
    std::vector<Task> tasks;
    for (int level = split; level <= octree_.depth; ++level)
        for (std::uint64_t group = 0; group < octree_.levels[level].groups(); ++group)
            tasks.push_back({level, group});
    std::vector<std::vector<std::uint64_t>> parts(tasks.size());
    parallel_for(tasks.size(), 16, [&](std::uint64_t i) {
        const auto& [level, group] = tasks[i];
        CoarseFinder(*this, low, high, parts[i])
            .visit_group(level, group, octree::morton_decode(octree_.levels[level].parent[group]),
                         level == split);
    });
    std::vector<std::uint64_t> keys;
    for (const auto& part : parts) keys.insert(keys.end(), part.begin(), part.end());
    parallel_sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    return keys;
}

}  // namespace its::surface
