#include "inspect/cycle.h"

#include <algorithm>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "geometry/predicates.h"

namespace its::inspector {

namespace {

constexpr std::uint64_t point_grain = 1024;

/// One end of an edge, seen from the point there.
struct End {
    std::uint32_t other;  ///< the point at the edge's other end
    std::uint32_t edge;
    std::int64_t leaving;  ///< how often the edge leaves the point; negative: arrives there
};

/// The direction from a point to another, as one of a line through the point: its sense is that in which the
/// first coordinate that changes grows.
struct Direction {
    int axis = 0;       ///< the first coordinate that changes
    bool ahead = true;  ///< whether the other point is in the sense of the line

    Direction(const Vec3& from, const Vec3& to) {
        while (axis < 2 && from[axis] == to[axis]) ++axis;
        ahead = from[axis] < to[axis];
    }
};

/// < 0, 0, > 0: an order of the lines from p to a and from p to b; 0 iff they are the same line. Directions
/// along x are compared by their slopes in y, then in z; those without x by the slope of z over y.
int compare_lines(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Direction to_a(p, a), to_b(p, b);
    if (to_a.axis != to_b.axis) return to_a.axis - to_b.axis;
    const int sense = to_a.ahead == to_b.ahead ? -1 : 1;
    const auto slopes = [&](int i, int j) {
        return sense * geometry::orient2d(p[i], p[j], a[i], a[j], b[i], b[j]);
    };
    if (to_a.axis == 2) return 0;
    if (to_a.axis == 1) return slopes(1, 2);
    const int y = slopes(0, 1);
    return y != 0 ? y : slopes(0, 2);
}

/// Edges that are known to lie on one line, in sets; a set is open if it does not cancel.
class Sets {
public:
    explicit Sets(std::size_t count) : sets_(count), open_(count, 0) {}
    void join(std::uint32_t i, std::uint32_t j) {
        i = sets_.find(i), j = sets_.find(j);
        const bool open = (open_[i] | open_[j]) != 0;
        sets_.join(i, j);
        if (open) set_open(i);
    }
    void set_open(std::uint32_t i) { open_[sets_.find(i)] = 1; }
    bool open(std::uint32_t i) { return open_[sets_.find(i)] != 0; }

private:
    DisjointSets sets_;
    std::vector<std::uint8_t> open_;
};

/// The ends of edges by the point that they are at.
struct Ends {
    std::vector<std::uint32_t> point;  ///< that have any, in ascending order
    std::vector<std::uint64_t> begin;
    std::vector<End> end;
};

Ends gather(std::span<const UnbalancedEdge> edges, Chain chain) {
    std::vector<std::pair<std::uint32_t, End>> all;
    for (std::uint32_t i = 0; i < edges.size(); ++i) {
        const auto& [low, high, excess] = edges[i];
        if (chain == Chain::modulo_two && excess % 2 == 0) continue;
        all.push_back({low, {high, i, excess}});
        all.push_back({high, {low, i, -excess}});
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Ends ends;
    for (const auto& [point, end] : all) {
        if (ends.point.empty() || ends.point.back() != point) {
            ends.point.push_back(point);
            ends.begin.push_back(ends.end.size());
        }
        ends.end.push_back(end);
    }
    ends.begin.push_back(ends.end.size());
    return ends;
}

}  // namespace

Remainder cancel_segments(std::span<const Vec3> points, std::span<const UnbalancedEdge> edges, Chain chain) {
    Ends ends = gather(edges, chain);
    const auto vanishes = [&](std::int64_t sum) {
        return chain == Chain::signed_sum ? sum == 0 : sum % 2 == 0;
    };
    const auto collinear = [&](const Vec3& p, const End& a, const End& b) {
        return compare_lines(p, points[a.other], points[b.other]) == 0;
    };
    parallel_for(ends.point.size(), point_grain, [&](std::uint64_t i) {
        const Vec3& p = points[ends.point[i]];
        std::stable_sort(ends.end.begin() + std::ptrdiff_t(ends.begin[i]),
                         ends.end.begin() + std::ptrdiff_t(ends.begin[i + 1]), [&](const End& a, const End& b) {
                             return compare_lines(p, points[a.other], points[b.other]) < 0;
                         });
    });
    Sets sets(edges.size());
    std::vector<std::pair<std::uint32_t, std::uint32_t>> passed;  // points, and an edge that goes on beyond it
    for (std::size_t i = 0; i < ends.point.size(); ++i) {
        const Vec3& p = points[ends.point[i]];
        for (std::uint64_t first = ends.begin[i], last = first; first < ends.begin[i + 1]; first = last) {
            std::int64_t sum = 0, ahead = 0;
            for (; last < ends.begin[i + 1] && collinear(p, ends.end[first], ends.end[last]); ++last) {
                const End& end = ends.end[last];
                sum += end.leaving;
                if (Direction(p, points[end.other]).ahead) ahead += end.leaving;
                sets.join(ends.end[first].edge, end.edge);
            }
            if (!vanishes(sum)) sets.set_open(ends.end[first].edge);
            if (!vanishes(ahead)) passed.emplace_back(ends.point[i], ends.end[first].edge);
        }
    }
    Remainder out;
    for (const End& end : ends.end) out.open += sets.open(end.edge) ? 1 : 0;
    out.open /= 2;  // each edge has two ends
    std::uint32_t counted = ~std::uint32_t{0};
    for (const auto& [point, edge] : passed)
        if (point != counted && !sets.open(edge)) ++out.t_junctions, counted = point;
    return out;
}

}  // namespace its::inspector
