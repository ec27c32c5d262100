#include "wrap/distance_proof.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/rounding.h"
#include "geometry/box.h"
#include "geometry/vec3.h"
#include "simplify/frame.h"

namespace its::wrapper {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Halvings of a triangle's longest edge, of which each midpoint is off by √3/2·uS₀; see hausdorff_bound.cpp.
constexpr int most_halvings = 40;
/// Pieces of one triangle; a proof that needs more is given up.
constexpr int most_pieces = 4096;

using Corners = std::array<Vec3, 3>;

double least_along(const Vec3& n, const Corners& c) {
    return std::min({dot(n, c[0]), dot(n, c[1]), dot(n, c[2])});
}

double most_along(const Vec3& n, const Corners& c) {
    return std::max({dot(n, c[0]), dot(n, c[1]), dot(n, c[2])});
}

/// The distance of two triangles is at least that of their projections on any direction. −infinity without one.
double gap_along(const Vec3& n, const Corners& p, const Corners& t) {
    const double length = norm(n);
    return length > 0 ? (least_along(n, p) - most_along(n, t)) / length : -infinity;
}

Vec3 nearest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 d = b - a;
    const double squared = dot(d, d);
    const double t = squared > 0 ? std::clamp(dot(p - a, d) / squared, 0.0, 1.0) : 0.0;
    return a + t * d;
}

/// Up to rounding, which proves nothing: what it gives is a direction to look along.
Vec3 nearest_on_triangle(const Vec3& p, const Corners& t) {
    const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], n = cross(ab, ac);
    const Vec3 ap = p - t[0];
    const double squared = dot(n, n);
    if (squared > 0) {
        const double v = dot(cross(ap, ac), n), w = dot(cross(ab, ap), n);
        if (v >= 0 && w >= 0 && v + w <= squared) return t[0] + (v / squared) * ab + (w / squared) * ac;
    }
    Vec3 best = nearest_on_segment(p, t[0], t[1]);
    for (int k = 1; k < 3; ++k) {
        const Vec3 other = nearest_on_segment(p, t[std::size_t(k)], t[std::size_t((k + 1) % 3)]);
        if (dot(other - p, other - p) < dot(best - p, best - p)) best = other;
    }
    return best;
}

/// From the point of segment cd nearest to segment ab to that of ab (Ericson 2005, section 5.1.9).
Vec3 between_segments(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const Vec3 u = b - a, v = d - c, r = a - c;
    const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ur = dot(u, r), vr = dot(v, r);
    const double det = uu * vv - uv * uv;
    double s = det > 0 ? std::clamp((uv * vr - ur * vv) / det, 0.0, 1.0) : 0.0;
    double t = vv > 0 ? (uv * s + vr) / vv : 0.0;
    if (t < 0 || t > 1) {
        t = std::clamp(t, 0.0, 1.0);
        s = uu > 0 ? std::clamp((uv * t - ur) / uu, 0.0, 1.0) : 0.0;
    }
    return (a + s * u) - (c + t * v);
}

/// Between the nearest points of two triangles that do not meet, from t to p, up to rounding: two edges, or a
/// corner and a triangle.
Vec3 shortest_between(const Corners& p, const Corners& t) {
    Vec3 best;
    double least = infinity;
    const auto offer = [&](const Vec3& n) {
        if (dot(n, n) < least) best = n, least = dot(n, n);
    };
    for (std::size_t i = 0; i < 3; ++i) {
        offer(p[i] - nearest_on_triangle(p[i], t));
        offer(nearest_on_triangle(t[i], p) - t[i]);
        for (std::size_t j = 0; j < 3; ++j) offer(between_segments(p[i], p[(i + 1) % 3], t[j], t[(j + 1) % 3]));
    }
    return best;
}

Corners corners_of(const mesh::Arrays& mesh, std::uint32_t triangle) {
    const Triangle& t = mesh.triangles[triangle];
    return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

}  // namespace

SeparationTree::SeparationTree(const mesh::Arrays& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), std::uint32_t{0});
    std::vector<Box> boxes(order_.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) boxes[i] = geometry::bounds(corners_of(mesh, i));
    nodes_.reserve(2 * order_.size() / leaf_size + 1);
    make_node(boxes, 0, std::uint32_t(order_.size()));
    corner_.reserve(order_.size());
    for (const std::uint32_t t : order_) corner_.push_back(corners_of(mesh, t));
}

void SeparationTree::make_node(const std::vector<Box>& boxes, std::uint32_t begin, std::uint32_t end) {
    const std::size_t at = nodes_.size();
    Box box = boxes[order_[begin]];
    for (std::uint32_t i = begin + 1; i < end; ++i) geometry::extend(box, boxes[order_[i]]);
    Node node;
    for (int axis = 0; axis < 3; ++axis) {
        node.centre[axis] = 0.5 * box.min[axis] + 0.5 * box.max[axis];
        node.half[axis] = std::nextafter(
            std::max(box.max[axis] - node.centre[axis], node.centre[axis] - box.min[axis]), infinity);
    }
    node.begin = begin, node.end = end;
    nodes_.push_back(node);
    if (end - begin <= leaf_size) return;
    int axis = 0;
    for (int other = 1; other < 3; ++other)
        if (node.half[other] > node.half[axis]) axis = other;
    const std::uint32_t middle = begin + (end - begin) / 2;
    const auto centre = [&](std::uint32_t i) { return 0.5 * boxes[i].min[axis] + 0.5 * boxes[i].max[axis]; };
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t i, std::uint32_t j) {
                         const double a = centre(i), b = centre(j);
                         return a < b || (a == b && i < j);
                     });
    make_node(boxes, begin, middle);
    nodes_[at].second = std::uint32_t(nodes_.size());
    make_node(boxes, middle, end);
}

double SeparationTree::bound(const Corners& p, double wanted, double rounding) const {
    const double enough = wanted + rounding;
    const Vec3 middle = (1.0 / 3) * (p[0] + p[1] + p[2]);
    double least = infinity;
    std::array<std::uint32_t, 64> open;  // the depth is at most 32
    std::size_t count = 0;
    open[count++] = 0;
    while (count > 0) {
        const std::uint32_t at = open[--count];
        const Node& node = nodes_[at];
        // From the box's nearest point to the middle of the triangle.
        Vec3 n = middle - node.centre;
        for (int axis = 0; axis < 3; ++axis) n[axis] -= std::clamp(n[axis], -node.half[axis], node.half[axis]);
        const double length = norm(n);
        if (length > 0) {
            const double reach =
                std::abs(n.x) * node.half.x + std::abs(n.y) * node.half.y + std::abs(n.z) * node.half.z;
            const double gap = (least_along(n, p) - (dot(n, node.centre) + reach)) / length;
            if (gap >= enough) {
                least = std::min(least, gap);
                continue;
            }
        }
        if (node.second != 0) {
            open[count++] = node.second;
            open[count++] = at + 1;
            continue;
        }
        for (std::uint32_t i = node.begin; i < node.end; ++i) {
            const Corners& t = corner_[i];
            double gap = gap_along(middle - nearest_on_triangle(middle, t), p, t);
            if (!(gap >= enough)) gap = std::max(gap, gap_along(shortest_between(p, t), p, t));
            least = std::min(least, gap);
            if (!(least >= enough)) return least - rounding;
        }
    }
    return least - rounding;
}

/// A gap is that of two dot products of at most √3·R|n|, R the largest coordinate, each of which errs by
/// 3.1u√3R|n| and their difference by 2√3uR|n|; it is divided by a length that errs by 3u of itself, and the
/// quotient, of at most 2√3R, rounds once more: 29uR in all, which distance_roundings·u·2R exceeds. A box's
/// reach, another three products of half sides up to 2R, adds 22uR.
DistanceProof::DistanceProof(const mesh::Arrays& mesh, const distance::ClosestPointTree& tree, double reach)
    : mesh_(mesh),
      tree_(tree),
      separation_(mesh),
      rounding_(simplifier::distance_roundings * unit_roundoff * 2 * reach) {}

DistanceRange DistanceProof::range(const std::array<Located, 3>& triangle, const DistanceRange& limits) const {
    const double lower =
        separation_.bound({triangle[0].at, triangle[1].at, triangle[2].at}, limits.lower, rounding_);
    if (!(lower >= limits.lower)) return {lower, infinity};
    return {lower, upper(triangle, limits.upper)};
}

/// The distance to one triangle is convex: over a piece it is largest at a corner.
double DistanceProof::upper(const std::array<Located, 3>& triangle, double limit) const {
    struct Piece {
        std::array<Located, 3> corner;
        int halvings;
    };
    std::array<Piece, most_halvings + 2> open;
    std::size_t count = 0;
    open[count++] = {triangle, 0};
    double most = 0;
    for (int pieces = 0; count > 0; ++pieces) {
        const Piece piece = open[--count];
        const auto& c = piece.corner;
        double least = infinity;
        for (std::size_t i = 0; i < 3 && !(least <= limit); ++i) {
            if (i > 0 && c[i].nearest == c[0].nearest) continue;
            const Corners t = corners_of(mesh_, c[i].nearest);
            const simplifier::Frame frame = simplifier::make_frame(t[0], t[1], t[2]);
            const simplifier::EdgeTerms terms(frame);
            double squared = 0;
            for (const Located& corner : c)
                squared = std::max(squared, simplifier::squared_distance(frame, terms, corner.at));
            least = std::min(least, std::sqrt(squared) + rounding_);
        }
        if (least <= limit) {
            most = std::max(most, least);
            continue;
        }
        if (piece.halvings == most_halvings || pieces == most_pieces) return least;
        std::size_t longest = 0;
        double length = -1;
        for (std::size_t i = 0; i < 3; ++i) {
            const Vec3 edge = c[(i + 1) % 3].at - c[i].at;
            if (dot(edge, edge) > length) longest = i, length = dot(edge, edge);
        }
        const Located &a = c[longest], &b = c[(longest + 1) % 3], &opposite = c[(longest + 2) % 3];
        const Vec3 at = 0.5 * (a.at + b.at);
        const distance::Nearest nearest = tree_.find(at);
        if (std::sqrt(nearest.squared) + rounding_ > limit) return std::sqrt(nearest.squared) + rounding_;
        const Located middle{at, nearest.triangle};
        open[count++] = {{a, middle, opposite}, piece.halvings + 1};
        open[count++] = {{middle, b, opposite}, piece.halvings + 1};
    }
    return most;
}

}  // namespace its::wrapper
