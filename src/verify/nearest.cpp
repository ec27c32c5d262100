#include "verify/nearest.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/vec3.h"
#include "verify/lattice.h"
#include "verify/polygon.h"
#include "verify/twofold.h"

namespace its::verifier {
namespace {

constexpr std::uint32_t leaf_size = 4;
/// Halving makes no tree of 2³² triangles deeper.
constexpr int most_levels = 40;

/// The part of a box's distance that rounding may have added: squares and sums of differences.
constexpr double box_shrink = 1 - 0x1p-48;

template <class Vector, class Number>
Number edge_distance2(const Vector& a, const Vector& b) {
    const Vector d = b - a;
    const Number length2 = dot(d, d);
    // From the nearer end, so that the rounding is that of the shorter part.
    const Number from_a = -dot(a, d), from_b = dot(b, d);
    if (!(Number(0.0) < from_a) || !(Number(0.0) < length2)) return dot(a, a);
    if (!(Number(0.0) < from_b)) return dot(b, b);
    const Vector foot = from_a < from_b ? a + (from_a / length2) * d : b - (from_b / length2) * d;
    return dot(foot, foot);
}

template <class Vector, class Number>
Number least_edge2(const Vector& a, const Vector& b, const Vector& c) {
    Number least = edge_distance2<Vector, Number>(a, b);
    for (const Number& other : {edge_distance2<Vector, Number>(b, c), edge_distance2<Vector, Number>(c, a)})
        if (other < least) least = other;
    return least;
}

/// Whether the foot of the perpendicular to the plane is within the triangle: on the inner side of the three
/// planes through the edges along the normal.
template <class Number, class Vector>
bool foot_inside(const Vector& a, const Vector& b, const Vector& c, const Vector& n) {
    const Number zero(0.0);
    return !(dot(cross(b - a, n), a) < zero) && !(dot(cross(c - b, n), b) < zero) &&
           !(dot(cross(a - c, n), c) < zero);
}

double precise_distance(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto wide = [](const Vec3& v) { return Twofold3{v.x, v.y, v.z}; };
    const Twofold3 p = wide(a), q = wide(b), r = wide(c), n = cross(q - p, r - p);
    Twofold least2 = least_edge2<Twofold3, Twofold>(p, q, r);
    const Twofold length2 = dot(n, n);
    // Thinner than this and the edges are as near as the inside, to all digits.
    const double span = std::max({norm(b - a), norm(c - a), norm(c - b)});
    if (length2.high > 0x1p-120 * span * span * span * span && foot_inside<Twofold>(p, q, r, n)) {
        const Twofold height = dot(n, p);
        const Twofold plane2 = height * height / length2;
        if (plane2 < least2) least2 = plane2;
    }
    return double(square_root(least2));
}

double box_distance2(const Box& box, const Vec3& p) {
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = std::max({box.min[axis] - p[axis], p[axis] - box.max[axis], 0.0});
        sum += d * d;
    }
    return sum;
}

double largest(const Vec3& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

Vec3 times_power(const Vec3& p, int e) {
    return {std::ldexp(p.x, e), std::ldexp(p.y, e), std::ldexp(p.z, e)};
}

Mesh scaled(Mesh mesh, int e) {
    for (Vec3& v : mesh.vertices) v = times_power(v, e);
    return mesh;
}

/// 0 where products of six lengths are far from overflow and underflow.
int exponent_for(const Mesh& mesh) {
    double largest = 0;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::abs(mesh.vertices[v][axis]));
    return largest == 0 || (largest > 0x1p-100 && largest < 0x1p100) ? 0 : std::ilogb(largest);
}

}  // namespace

// Squares and products here are far from underflow or do not matter: lengths below 2⁻¹⁰⁰ are scaled, by a power
// of two; all of a triangle whose sides are below 2⁻⁶⁰ of the distance to a corner is as far as that corner,
// but for 2⁻⁶⁰ of it, and other sides have a square of at least 2⁻³²⁰. A normal whose square is below 2⁻⁹⁰⁰ is
// one of a needle. The normal of a needle is off by some 8 · 2⁻⁵³ · |ab||ac| / |n|, and so is all that is
// measured along it. Where that is too much twice the precision is taken; but no point of a triangle is farther
// from its edges than its height over ab, which settles most.
double distance_to_triangle(const Vec3& a, const Vec3& b, const Vec3& c, double limit) {
    const double size = std::max({largest(a), largest(b), largest(c)});
    if (size < 0x1p-100) {
        if (size == 0) return 0;
        const int e = std::ilogb(size);
        const double found = distance_to_triangle(times_power(a, -e), times_power(b, -e), times_power(c, -e),
                                                  std::ldexp(limit, -e));
        return std::ldexp(found, e);
    }
    const Vec3 u = b - a, v = c - a, n = cross(u, v);
    const double length2 = dot(n, n), u2 = dot(u, u), v2 = dot(v, v), sides2 = u2 * v2;
    const double edges = std::sqrt(least_edge2<Vec3, double>(a, b, c));
    if (std::max(u2, v2) <= 0x1p-120 * dot(a, a)) return edges;
    if (!(length2 > 0x1p-4 * sides2) || !(length2 > 0x1p-900)) {
        const double height = u2 > 0 ? std::sqrt(length2 / u2) + 16 * roundoff * norm(v) : 0.0;
        return edges * (1 - 0x1p-40) - height > limit ? edges : precise_distance(a, b, c);
    }
    return foot_inside<double>(a, b, c, n) ? std::min(edges, std::abs(dot(n, a)) / std::sqrt(length2)) : edges;
}

Nearest::Nearest(const Mesh& given)
    : exponent_(exponent_for(given)),
      scaled_(exponent_ != 0 ? scaled(given, -exponent_) : Mesh{}),
      mesh_(exponent_ != 0 ? scaled_ : given),
      order_(given.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    std::vector<Vec3> centre(order_.size());
    for (std::size_t t = 0; t < centre.size(); ++t) {
        const auto& [i, j, k] = mesh_.triangles[t];
        centre[t] = mesh_.vertices[i] + mesh_.vertices[j] + mesh_.vertices[k];
    }
    nodes_.reserve(order_.size());
    split(centre, 0, std::uint32_t(order_.size()));
}

void Nearest::split(std::vector<Vec3>& centre, std::uint32_t begin, std::uint32_t end) {
    const std::size_t me = nodes_.size();
    Box box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}}, centres = box;
    const auto grow = [](Box& to, const Vec3& p) {
        for (int axis = 0; axis < 3; ++axis) {
            to.min[axis] = std::min(to.min[axis], p[axis]);
            to.max[axis] = std::max(to.max[axis], p[axis]);
        }
    };
    for (std::uint32_t i = begin; i < end; ++i) {
        for (const std::uint32_t v : mesh_.triangles[order_[i]]) grow(box, mesh_.vertices[v]);
        grow(centres, centre[order_[i]]);
    }
    nodes_.push_back({box, begin, end});
    if (end - begin <= leaf_size) return;
    int axis = 0;
    for (int other = 1; other < 3; ++other)
        if (centres.max[other] - centres.min[other] > centres.max[axis] - centres.min[axis]) axis = other;
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t s, std::uint32_t t) { return centre[s][axis] < centre[t][axis]; });
    split(centre, begin, middle);
    nodes_[me].begin = std::uint32_t(nodes_.size());
    nodes_[me].end = 0;
    split(centre, middle, end);
}

double Nearest::distance(const Vec3& p, double limit) const {
    if (exponent_ == 0) return scaled_distance(p, limit);
    return std::ldexp(scaled_distance(times_power(p, -exponent_), std::ldexp(limit, -exponent_)), exponent_);
}

double Nearest::scaled_distance(const Vec3& p, double limit) const {
    struct Open {
        std::uint32_t node;
        double distance2;
    };
    Open stack[most_levels];
    int size = 0;
    double best = infinity, best2 = limit * limit * (1 + 0x1p-48);
    stack[size++] = {0, box_distance2(nodes_[0].box, p)};
    while (size > 0) {
        const Open open = stack[--size];
        if (open.distance2 * box_shrink > best2) continue;
        const Node& node = nodes_[open.node];
        if (node.end == 0) {
            Open first = {open.node + 1, box_distance2(nodes_[open.node + 1].box, p)};
            Open second = {node.begin, box_distance2(nodes_[node.begin].box, p)};
            if (second.distance2 < first.distance2) std::swap(first, second);
            if (second.distance2 * box_shrink <= best2) stack[size++] = second;
            stack[size++] = first;
            continue;
        }
        for (std::uint32_t i = node.begin; i < node.end; ++i) {
            const auto& [a, b, c] = mesh_.triangles[order_[i]];
            const double d = distance_to_triangle(mesh_.vertices[a] - p, mesh_.vertices[b] - p,
                                                  mesh_.vertices[c] - p, std::min(best, limit));
            if (d < best) {
                best = d;
                best2 = std::min(best2, d * d * (1 + 0x1p-48));
            }
        }
    }
    return best <= limit ? best : infinity;
}

}  // namespace its::verifier
