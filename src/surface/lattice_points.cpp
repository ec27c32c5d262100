#include "surface/lattice_points.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "surface/box_walk.h"

namespace its::surface {

namespace {

/// Where lattice points are among the finest cells, the same along each axis.
class PointTable {
public:
    PointTable(int depth, double ratio, std::uint32_t side)
        : ratio_(ratio), last_(double(std::uint32_t{2} << depth)), first_((std::size_t{2} << depth) + 1) {
        std::uint32_t i = 0;
        for (std::size_t x = 0; x + 1 < first_.size(); ++x) {
            while (i <= side && at(i) < double(x)) ++i;
            first_[x] = i;
        }
        first_.back() = side + 1;  // points on the upper face are those of the last cell
    }

    /// In finest cells.
    double at(std::uint32_t i) const { return std::min(i * ratio_, last_); }
    /// Points in finest cells x to y − 1 are [first(x), first(y)).
    std::uint32_t first(std::uint32_t x) const { return first_[x]; }

private:
    double ratio_, last_;
    std::vector<std::uint32_t> first_;
};

/// Samples boxes in a region.
class Sampler {
public:
    Sampler(const PointTable& table, const Region& region, double low, double high,
            std::vector<LatticePoint>& found)
        : table_(table), region_(region), low_(low), high_(high), found_(found) {}

    bool enter(int level, const octree::Cell& at) const {
        Range range;
        return (level < region_.level || region_.meets(level, at)) && range_in(level, at, range);
    }
    void leave(int) const {}
    bool wants(const double* points) const { return possible<octree::group_points>(points); }

    void box(int level, const octree::Cell& at, const double* points, int child) const {
        Range range;
        if ((level >= region_.level && !region_.meets(level, at)) || !range_in(level, at, range)) return;
        Box box;
        for (int c = 0; c < 8; ++c) box.value[c] = points[octree::group_point(child, c)];
        if (!possible<8>(box.value)) return;
        box.scale = 1.0 / double(std::uint64_t{1} << level);
        for (std::size_t axis = 0; axis < 3; ++axis) box.corner[int(axis)] = double(at[axis] << level);
        sample(box, range);
    }

private:
    static constexpr std::uint64_t few = 32;

    /// Lattice points, from `low` to before `high`.
    struct Range {
        std::array<std::uint32_t, 3> low, high;
    };
    struct Box {
        double value[8], scale;
        Vec3 corner;
    };

    bool range_in(int level, const octree::Cell& at, Range& range) const {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            range.low[axis] = table_.first(region_.from(level, at, axis));
            range.high[axis] = table_.first(region_.to(level, at, axis));
            if (range.low[axis] == range.high[axis]) return false;
        }
        return true;
    }

    template <int count>
    bool possible(const double* value) const {
        double least = value[0], most = value[0];
        for (int c = 1; c < count; ++c) {
            least = std::min(least, value[c]);
            most = std::max(most, value[c]);
        }
        return least <= high_ && most >= low_;
    }

    double value(const Box& box, std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
        const Vec3 u{table_.at(x), table_.at(y), table_.at(z)};
        return geometry::trilinear(box.value, box.scale * (u - box.corner));
    }

    /// A trilinear function on a box of points is between its values at the box's corners.
    void sample(const Box& box, const Range& range) const {
        std::uint64_t count = 1;
        std::size_t longest = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            count *= range.high[axis] - range.low[axis];
            if (range.high[axis] - range.low[axis] > range.high[longest] - range.low[longest]) longest = axis;
        }
        if (count <= few) return sample_all(box, range);
        double corner[8];
        for (int c = 0; c < 8; ++c)
            corner[c] =
                value(box, c & 1 ? range.high[0] - 1 : range.low[0], c & 2 ? range.high[1] - 1 : range.low[1],
                      c & 4 ? range.high[2] - 1 : range.low[2]);
        if (!possible<8>(corner)) return;
        const std::uint32_t middle = range.low[longest] + (range.high[longest] - range.low[longest]) / 2;
        Range half = range;
        half.high[longest] = middle;
        sample(box, half);
        half = range;
        half.low[longest] = middle;
        sample(box, half);
    }

    void sample_all(const Box& box, const Range& range) const {
        for (std::uint32_t z = range.low[2]; z < range.high[2]; ++z)
            for (std::uint32_t y = range.low[1]; y < range.high[1]; ++y)
                for (std::uint32_t x = range.low[0]; x < range.high[0]; ++x) {
                    const double f = value(box, x, y, z);
                    if (f >= low_ && f <= high_) found_.push_back({key_of({x, y, z}), f});
                }
    }

    const PointTable& table_;
    const Region region_;
    double low_, high_;
    std::vector<LatticePoint>& found_;
};

/// By z, then each layer by the rest.
std::vector<LatticePoint> sorted(std::vector<std::vector<LatticePoint>>& parts, std::uint32_t side) {
    std::vector<std::uint64_t> begin(std::size_t{side} + 2, 0);
    for (const auto& part : parts)
        for (const LatticePoint& p : part) ++begin[(p.key >> 42) + 1];
    for (std::size_t z = 1; z < begin.size(); ++z) begin[z] += begin[z - 1];
    std::vector<LatticePoint> points(begin.back());
    std::vector<std::uint64_t> next(begin.begin(), begin.end() - 1);
    for (auto& part : parts) {
        for (const LatticePoint& p : part) points[next[p.key >> 42]++] = p;
        std::vector<LatticePoint>().swap(part);
    }
    parallel_for(begin.size() - 1, 1, [&](std::uint64_t z) {
        std::sort(points.begin() + std::ptrdiff_t(begin[z]), points.begin() + std::ptrdiff_t(begin[z + 1]),
                  [](const LatticePoint& a, const LatticePoint& b) { return a.key < b.key; });
    });
    return points;
}

}  // namespace

std::vector<LatticePoint> find_lattice_points(const octree::Octree& octree, const field::Field& field,
                                              double ratio, std::uint32_t side, double low, double high,
                                              MemoryGuard& guard, const Progress& progress) {
    const PointTable table(octree.depth, ratio, side);
    const int level = Region::level_of(octree.depth);
    const std::uint32_t regions = 1u << (octree.depth + 1 - level);
    const std::uint64_t count = std::uint64_t{regions} * regions * regions;
    Stage stage(progress, "surface points", count);
    std::vector<std::vector<LatticePoint>> parts(count);
    Taken taken(guard, 0);
    parallel_for(count, 1, [&](std::uint64_t i) {
        const octree::Cell at{std::uint32_t(i % regions), std::uint32_t(i / regions % regions),
                              std::uint32_t(i / regions / regions)};
        Sampler sampler(table, {level, at}, low, high, parts[i]);
        BoxWalk<Sampler>(octree, field, sampler).run();
        taken.add(sizeof(LatticePoint) * parts[i].size());  // and given back as they are put in order
        stage.advance(1);
    });
    return sorted(parts, side);
}

}  // namespace its::surface
