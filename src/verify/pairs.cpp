#include "verify/pairs.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "verify/exact.h"

namespace its::verifier {
namespace {

constexpr std::uint32_t leaf_size = 2;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// A segment and a triangle in one plane, seen along an axis from which the triangle has an area.
bool meet_in_plane(const Corners& t, const Vec3& p, const Vec3& q) {
    int first = 0, second = 1;
    int area = 0;
    for (int axis = 0; axis < 3 && area == 0; ++axis) {
        first = axis, second = (axis + 1) % 3;
        area = turn_sign(t[0], t[1], t[2], first, second);
    }
    const auto turn = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
        return turn_sign(a, b, c, first, second);
    };
    for (const Vec3& end : {p, q}) {
        bool within = true;
        for (std::size_t k = 0; k < 3; ++k) within = within && turn(t[k], t[(k + 1) % 3], end) * area >= 0;
        if (within) return true;
    }
    // No end is within: the segment meets the triangle only if it crosses an edge.
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 &a = t[k], &b = t[(k + 1) % 3];
        const int pa = turn(p, q, a), pb = turn(p, q, b), ap = turn(a, b, p), aq = turn(a, b, q);
        if (pa == 0 && pb == 0 && ap == 0 && aq == 0) {  // on one line: an end of the edge between p and q
            for (const Vec3& corner : {a, b})
                if (corner == p || corner == q || strictly_between(p, q, corner)) return true;
            continue;
        }
        if (pa * pb <= 0 && ap * aq <= 0) return true;
    }
    return false;
}

/// The triangle is not degenerate; p and q may be one point.
bool meet_segment(const Corners& t, const Vec3& p, const Vec3& q) {
    const int sp = plane_side(t[0], t[1], t[2], p), sq = plane_side(t[0], t[1], t[2], q);
    if (sp * sq > 0) return false;
    if (sp == 0 && sq == 0) return meet_in_plane(t, p, q);
    bool positive = false, negative = false;
    for (std::size_t k = 0; k < 3; ++k) {
        const int side = plane_side(p, q, t[k], t[(k + 1) % 3]);
        positive = positive || side > 0;
        negative = negative || side < 0;
    }
    return !(positive && negative);
}

/// All of t is strictly on one side of s.
bool beside(const Corners& s, const Corners& t) {
    const int side = plane_side(s[0], s[1], s[2], t[0]);
    return side != 0 && side == plane_side(s[0], s[1], s[2], t[1]) &&
           side == plane_side(s[0], s[1], s[2], t[2]);
}

}  // namespace

Corners corners_of(const Mesh& mesh, std::uint64_t triangle) {
    const Triangle& t = mesh.triangles[triangle];
    return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

Box box_of(const Corners& t) {
    Box box{t[0], t[0]};
    for (const Vec3& p : t)
        for (int axis = 0; axis < 3; ++axis) {
            box.min[axis] = std::min(box.min[axis], p[axis]);
            box.max[axis] = std::max(box.max[axis], p[axis]);
        }
    return box;
}

bool overlap(const Box& a, const Box& b) {
    for (int axis = 0; axis < 3; ++axis)
        if (a.min[axis] > b.max[axis] || a.max[axis] < b.min[axis]) return false;
    return true;
}

bool is_degenerate(const Corners& t) {
    return turn_sign(t[0], t[1], t[2], 0, 1) == 0 && turn_sign(t[0], t[1], t[2], 1, 2) == 0 &&
           turn_sign(t[0], t[1], t[2], 2, 0) == 0;
}

bool meet(const Corners& s, const Corners& t) {
    if (!overlap(box_of(s), box_of(t)) || beside(s, t)) return false;
    for (std::size_t k = 0; k < 3; ++k)
        if (meet_segment(s, t[k], t[(k + 1) % 3])) return true;
    if (is_degenerate(t)) return false;  // its points are those of its edges
    for (std::size_t k = 0; k < 3; ++k)
        if (meet_segment(t, s[k], s[(k + 1) % 3])) return true;
    return false;
}

bool meet_beside_shared(const Corners& s, const Corners& t) {
    std::array<std::size_t, 3> of_s{}, of_t{};
    std::size_t shared = 0;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            if (s[i] == t[j]) of_s[shared] = i, of_t[shared] = j, ++shared;
    if (shared == 0) return meet(s, t);
    if (shared == 3) return true;
    if (shared == 2) {
        // In two planes the edge's line is all that they share; in one, they overlap if they are on one side of
        // it.
        const Vec3 &a = s[of_s[0]], &b = s[of_s[1]];
        const Vec3 &c = s[3 - of_s[0] - of_s[1]], &d = t[3 - of_t[0] - of_t[1]];
        if (plane_side(a, b, c, d) != 0) return false;
        for (int axis = 0; axis < 3; ++axis) {
            const int side = turn_sign(a, b, c, axis, (axis + 1) % 3);
            if (side != 0) return side == turn_sign(a, b, d, axis, (axis + 1) % 3);
        }
        return true;
    }
    // Another common point lies with the corner on a ray in both, which first leaves one of them: through the
    // side opposite to the corner.
    const std::size_t i = of_s[0], j = of_t[0];
    return meet_segment(t, s[(i + 1) % 3], s[(i + 2) % 3]) || meet_segment(s, t[(j + 1) % 3], t[(j + 2) % 3]);
}

Boxes::Boxes(const Mesh& mesh) : order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    std::vector<Box> boxes(order_.size());
    for (std::size_t t = 0; t < boxes.size(); ++t) boxes[t] = box_of(corners_of(mesh, t));
    nodes_.reserve(order_.size());
    split(boxes, 0, std::uint32_t(order_.size()));
}

void Boxes::split(const std::vector<Box>& boxes, std::uint32_t begin, std::uint32_t end) {
    const std::size_t me = nodes_.size();
    Box box = boxes[order_[begin]];
    for (std::uint32_t i = begin; i < end; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            box.min[axis] = std::min(box.min[axis], boxes[order_[i]].min[axis]);
            box.max[axis] = std::max(box.max[axis], boxes[order_[i]].max[axis]);
        }
    nodes_.push_back({box, begin, end, 0});
    if (end - begin <= leaf_size) return;
    int axis = 0;
    for (int other = 1; other < 3; ++other)
        if (box.max[other] - box.min[other] > box.max[axis] - box.min[axis]) axis = other;
    const std::uint32_t middle = begin + (end - begin) / 2;
    const auto centre = [&](std::uint32_t t) { return boxes[t].min[axis] / 2 + boxes[t].max[axis] / 2; };
    std::nth_element(
        order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
        [&](std::uint32_t s, std::uint32_t t) { return std::pair(centre(s), s) < std::pair(centre(t), t); });
    split(boxes, begin, middle);
    nodes_[me].second = std::uint32_t(nodes_.size());
    split(boxes, middle, end);
}

std::int64_t winding_number(const Mesh& mesh, const Boxes& boxes, const Vec3& p) {
    std::int64_t sum = 0;
    boxes.for_near({p, {p.x, p.y, infinity}}, [&](std::uint32_t i) {
        const Corners t = corners_of(mesh, i);
        const int up = turn_sign(t[0], t[1], t[2], 0, 1);
        if (up == 0) return;
        for (std::size_t k = 0; k < 3; ++k)
            if (displaced_turn(t[k], t[(k + 1) % 3], p) != up) return;
        if (!displaced_above(t[0], t[1], t[2], up, p)) sum += up;
    });
    return sum;
}

}  // namespace its::verifier
