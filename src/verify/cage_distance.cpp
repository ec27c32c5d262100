#include "verify/cage_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "geometry/vec3.h"
#include "verify/nearest.h"

namespace its::verifier {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double roundoff_unit = 0x1p-53;
constexpr int most_halvings = 40;
constexpr std::uint64_t most_pieces = 20'000;  // of one triangle

/// Whatever errs here, in units of 2⁻⁵³ of the largest coordinate R. A distance to a triangle: 64 of the
/// farthest corner's, below 3.5R; its differences 3.5; midpoints of 40 halvings 0.9 each. A gap along n: two
/// products of at most √3·R|n| with three roundings each, their difference, a quotient by a length: below 30.
constexpr double distance_roundings = 320;

/// The same direction, of a size whose square is far from underflow: multiplied by a power of two, exactly.
Vec3 enlarged(Vec3 n) {
    const auto size = [&] { return std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)}); };
    for (int i = 0; i < 2 && size() < 0x1p-400; ++i) n = 0x1p+600 * n;
    return n;
}

/// The gap between two triangles along a direction: no two of their points are nearer. Any direction has one.
double gap(const Vec3& direction, const Corners& s, const Corners& t) {
    const Vec3 n = enlarged(direction);
    const double length = norm(n);
    if (!(length > 0)) return -infinity;
    const double low = std::min({dot(n, s[0]), dot(n, s[1]), dot(n, s[2])});
    const double high = std::max({dot(n, t[0]), dot(n, t[1]), dot(n, t[2])});
    return (low - high) / length;
}

/// Where on a triangle a point has its foot: by regions of its plane (Ericson 2005, section 5.1.5). An edge
/// without length is none.
Vec3 foot(const Corners& t, const Vec3& p) {
    const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0], bp = p - t[1], cp = p - t[2];
    const double d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return t[0];
    const double d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return t[1];
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return t[0] + (d1 / (d1 - d3)) * ab;
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return t[2];
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return t[0] + (d2 / (d2 - d6)) * ac;
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0 && (d4 - d3) + (d5 - d6) > 0)
        return t[1] + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (t[2] - t[1]);
    const double sum = va + vb + vc;
    return sum != 0 ? t[0] + (vb / sum) * ab + (vc / sum) * ac : t[0];
}

/// Of two edges: from one to the other at right angles to both, or nothing where that misses them.
Vec3 between_edges(const Vec3& a, const Vec3& u, const Vec3& b, const Vec3& v) {
    const Vec3 n = cross(u, v);
    const double side = dot(n, a - b);
    return side < 0 ? -1.0 * n : n;
}

/// The largest gap along the directions that can be those of the shortest way between two triangles that do not
/// meet: corner to triangle, edge to edge.
double largest_gap(const Corners& s, const Corners& t) {
    double best = -infinity;
    for (std::size_t i = 0; i < 3; ++i) {
        best = std::max(best, gap(s[i] - foot(t, s[i]), s, t));
        best = std::max(best, gap(foot(s, t[i]) - t[i], s, t));
        for (std::size_t j = 0; j < 3; ++j)
            best = std::max(best,
                            gap(between_edges(s[i], s[(i + 1) % 3] - s[i], t[j], t[(j + 1) % 3] - t[j]), s, t));
    }
    return best;
}

double between_boxes(const Box& a, const Box& b) {
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = std::max({a.min[axis] - b.max[axis], b.min[axis] - a.max[axis], 0.0});
        sum += d * d;
    }
    return std::sqrt(sum);
}

}  // namespace

CageDistance::CageDistance(const Mesh& mesh, const Boxes& boxes, double reach)
    : mesh_(mesh), boxes_(boxes), rounding_(distance_roundings * roundoff_unit * reach) {}

double CageDistance::lower(const Corners& s, double limit) const {
    const Box box = box_of(s);
    double least = limit + rounding_;
    std::vector<std::uint32_t> open{0};
    while (!open.empty()) {
        const std::uint32_t at = open.back();
        open.pop_back();
        const Boxes::Node& node = boxes_.nodes()[at];
        if (between_boxes(node.box, box) >= least + rounding_) continue;
        if (node.second != 0) {
            open.push_back(node.second);
            open.push_back(at + 1);
            continue;
        }
        for (std::uint32_t i = node.begin; i < node.end; ++i) {
            const Corners t = corners_of(mesh_, boxes_.order()[i]);
            if (between_boxes(box_of(t), box) >= least + rounding_) continue;
            const Vec3 middle = (1.0 / 3) * (s[0] + s[1] + s[2]);
            if (gap(middle - foot(t, middle), s, t) >= least) continue;
            least = std::min(least, largest_gap(s, t));
        }
    }
    return std::max(least - rounding_, 0.0);
}

double CageDistance::distance_to(std::uint32_t triangle, const Vec3& p) const {
    const Corners t = corners_of(mesh_, triangle);
    return distance_to_triangle(t[0] - p, t[1] - p, t[2] - p, infinity);
}

CageDistance::Located CageDistance::locate(const Vec3& p) const {
    Located result{p, 0, infinity};
    struct Entry {
        double away;
        std::uint32_t node;
    };
    std::vector<Entry> open{{between_boxes(boxes_.nodes()[0].box, {p, p}), 0}};
    while (!open.empty()) {
        const Entry entry = open.back();
        open.pop_back();
        if (entry.away > result.distance) continue;
        const Boxes::Node& node = boxes_.nodes()[entry.node];
        if (node.second == 0) {
            for (std::uint32_t i = node.begin; i < node.end; ++i) {
                const std::uint32_t t = boxes_.order()[i];
                if (between_boxes(box_of(corners_of(mesh_, t)), {p, p}) > result.distance) continue;
                const double d = distance_to(t, p);
                if (d < result.distance) result = {p, t, d};
            }
            continue;
        }
        Entry first{between_boxes(boxes_.nodes()[entry.node + 1].box, {p, p}), entry.node + 1};
        Entry second{between_boxes(boxes_.nodes()[node.second].box, {p, p}), node.second};
        if (first.away < second.away) std::swap(first, second);
        open.push_back(first);
        open.push_back(second);  // the nearer one comes first
    }
    return result;
}

/// The distance to one triangle of M is convex: on a piece it is nowhere more than at a corner.
double CageDistance::upper(const Corners& s, double limit, double excess, double allowed) const {
    struct Piece {
        std::array<Located, 3> corner;
        int halvings;
    };
    std::vector<Piece> open{{{locate(s[0]), locate(s[1]), locate(s[2])}, 0}};
    double most = 0, attained = 0;
    for (std::uint64_t pieces = 0; !open.empty(); ++pieces) {
        const Piece piece = open.back();
        open.pop_back();
        const auto& c = piece.corner;
        double least = infinity;
        for (std::size_t i = 0; i < 3; ++i) {
            attained = std::max(attained, c[i].distance);
            double largest = 0;
            for (std::size_t k = 0; k < 3; ++k) largest = std::max(largest, distance_to(c[i].nearest, c[k].at));
            least = std::min(least, largest);
        }
        const bool near = least <= attained + excess && least + rounding_ <= allowed;
        if (least + rounding_ <= limit || near || piece.halvings == most_halvings || pieces >= most_pieces) {
            most = std::max(most, least);
            continue;
        }
        std::size_t longest = 0;
        for (std::size_t i = 1; i < 3; ++i)
            if (norm(c[(i + 1) % 3].at - c[i].at) > norm(c[(longest + 1) % 3].at - c[longest].at)) longest = i;
        const Located &a = c[longest], &b = c[(longest + 1) % 3], &rest = c[(longest + 2) % 3];
        const Located middle = locate(0.5 * (a.at + b.at));
        open.push_back({{a, middle, rest}, piece.halvings + 1});
        open.push_back({{middle, b, rest}, piece.halvings + 1});
    }
    return most + rounding_;
}

}  // namespace its::verifier
