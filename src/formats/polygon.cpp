#include <algorithm>
#include <cmath>

#include "formats/readers.h"
#include "geometry/predicates.h"
#include "geometry/scaling.h"
#include "geometry/vec3.h"

namespace its::formats {

namespace {

struct Point {
    double x, y;
    friend bool operator==(const Point&, const Point&) = default;
};

int turn(const Point& a, const Point& b, const Point& c) {
    return geometry::orient2d(a.x, a.y, b.x, b.y, c.x, c.y);
}

/// The corners seen along the axis nearest to the normal (Newell's: twice the vector area), such that the
/// polygon runs counter-clockwise. No arithmetic is done on them, so predicates are exact. Empty if there is no
/// normal.
std::vector<Point> project(std::span<const std::uint32_t> polygon, std::span<const Vec3> vertices) {
    Vec3 normal;
    double largest = 0;
    for (const std::uint32_t corner : polygon)
        largest = std::max(largest, geometry::largest_magnitude(vertices[corner]));
    const geometry::Scaling scaling = geometry::scaling_for(largest);
    const Vec3 origin = scaling.in(vertices[polygon[0]]);
    Vec3 a;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3 b = scaling.in(vertices[polygon[(i + 1) % polygon.size()]]) - origin;
        normal = normal + cross(a, b);
        a = b;
    }
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
        if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
    }
    std::vector<Point> points;
    if (!(std::abs(normal[axis]) > 0) || !std::isfinite(normal[axis])) return points;
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
    points.reserve(polygon.size());
    for (const std::uint32_t corner : polygon) points.push_back({vertices[corner][u], vertices[corner][v]});
    return points;
}

/// Whether the polygon turns left at every corner, and just once around.
bool strictly_convex(const std::vector<Point>& p) {
    const std::size_t n = p.size();
    int reversals = 0;  // of the direction along x; a convex polygon has two
    bool right = false, known = false, first_right = false;
    for (std::size_t i = 0; i < n; ++i) {
        const Point &a = p[i], &b = p[(i + 1) % n], &c = p[(i + 2) % n];
        if (turn(a, b, c) <= 0) return false;
        if (a.x == b.x) continue;
        const bool now = b.x > a.x;
        if (known && now != right) ++reversals;
        if (!known) first_right = now;
        known = true;
        right = now;
    }
    return reversals + (right != first_right) <= 2;
}

/// Ear clipping on a ring of corners.
class EarClipper {
public:
    EarClipper(std::span<const std::uint32_t> corners, const std::vector<Point>& points, std::uint64_t& budget,
               std::vector<Triangle>& out)
        : polygon_(corners), points_(points), budget_(budget), out_(out) {
        const std::size_t n = corners.size();
        previous_.resize(n), next_.resize(n), turn_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            previous_[i] = i == 0 ? n - 1 : i - 1;
            next_[i] = i + 1 == n ? 0 : i + 1;
        }
        for (std::size_t i = 0; i < n; ++i) turn_[i] = turn_at(i);
        for (std::size_t i = 0; i < n; ++i) {
            if (turn_[i] <= 0) blockers_.push_back(i);
        }
    }

    /// False if the budget did not suffice and the rest was made a fan.
    bool run() {
        std::size_t left = polygon_.size(), at = 0;
        while (left > 3) {
            at = find_ear(at, left);
            if (budget_ == 0) break;
            const std::size_t before = previous_[at], after = next_[at];
            emit(at);
            next_[before] = after;
            previous_[after] = before;
            turn_[at] = removed;
            turn_[before] = turn_at(before);
            turn_[after] = turn_at(after);
            at = after;
            --left;
        }
        const bool complete = left == 3;
        const std::size_t apex = previous_[at];  // the rest as a fan; a single triangle if all went well
        for (; left >= 3; --left, at = next_[at]) {
            out_.push_back({polygon_[apex], polygon_[at], polygon_[next_[at]]});
        }
        return complete;
    }

private:
    static constexpr signed char removed = 2;

    signed char turn_at(std::size_t i) const {
        return static_cast<signed char>(turn(points_[previous_[i]], points_[i], points_[next_[i]]));
    }
    void emit(std::size_t i) { out_.push_back({polygon_[previous_[i]], polygon_[i], polygon_[next_[i]]}); }

    void spend(std::uint64_t steps) { budget_ -= std::min(budget_, steps); }

    /// The next ear from `at` on; in a polygon that has none (it crosses itself), the corner that does least
    /// harm: one on a straight line or a spike, else one that turns left, else any.
    std::size_t find_ear(std::size_t at, std::size_t left) {
        std::size_t straight = at, convex = at;
        bool found_straight = false, found_convex = false;
        for (std::size_t k = 0; k < left && budget_ > 0; ++k, at = next_[at]) {
            spend(1);
            if (turn_[at] == 0 && !found_straight) straight = at, found_straight = true;
            if (turn_[at] == 1 && !found_convex) convex = at, found_convex = true;
            if (turn_[at] == 1 && is_ear(at)) return at;
        }
        return found_straight ? straight : convex;
    }

    /// Whether no other corner is in the closed triangle at i. Only a corner that does not turn left can be the
    /// first to enter it. Corners at the places of the triangle's own do not count: bridges to holes have them.
    bool is_ear(std::size_t i) {
        const Point &a = points_[previous_[i]], &b = points_[i], &c = points_[next_[i]];
        const double x0 = std::min({a.x, b.x, c.x}), x1 = std::max({a.x, b.x, c.x});
        const double y0 = std::min({a.y, b.y, c.y}), y1 = std::max({a.y, b.y, c.y});
        std::size_t kept = 0;
        bool ear = true;
        for (std::size_t k = 0; k < blockers_.size(); ++k) {
            const std::size_t j = blockers_[k];
            if (turn_[j] == removed || turn_[j] == 1)
                continue;  // once convex, a corner of a simple ring stays so
            blockers_[kept++] = j;
            if (!ear) continue;
            const Point& p = points_[j];
            if (p.x < x0 || p.x > x1 || p.y < y0 || p.y > y1) continue;
            if (p == a || p == b || p == c) continue;
            spend(16);
            ear = turn(a, b, p) < 0 || turn(b, c, p) < 0 || turn(c, a, p) < 0;
        }
        spend(blockers_.size());
        blockers_.resize(kept);
        return ear;
    }

    std::span<const std::uint32_t> polygon_;
    const std::vector<Point>& points_;
    std::uint64_t& budget_;
    std::vector<Triangle>& out_;
    std::vector<std::size_t> previous_, next_, blockers_;
    std::vector<signed char> turn_;  ///< 1 left, 0 straight, −1 right, or removed
};

}  // namespace

bool triangulate(std::span<const std::uint32_t> polygon, std::span<const Vec3> vertices, std::uint64_t& budget,
                 std::vector<Triangle>& out) {
    // Corners that do not repeat their neighbour, and their vertices; the others, and their places in the ring.
    std::vector<std::uint32_t> ring, ring_vertices, repeated;
    std::vector<std::uint32_t> place_of;
    const auto drop = [&](std::uint32_t corner, std::size_t place) {
        repeated.push_back(corner);
        place_of.push_back(std::uint32_t(place));
    };
    for (std::uint32_t corner = 0; corner < polygon.size(); ++corner) {
        if (ring.empty() || ring_vertices.back() != polygon[corner]) {
            ring.push_back(corner);
            ring_vertices.push_back(polygon[corner]);
        } else {
            drop(corner, ring.size() - 1);
        }
    }
    for (; ring.size() > 1 && ring_vertices.back() == ring_vertices.front();
         ring.pop_back(), ring_vertices.pop_back())
        drop(ring.back(), 0);
    // A repeated corner makes a triangle that is a segment, so that n corners make n − 2 triangles.
    for (std::size_t i = 0; i < repeated.size(); ++i) {
        const std::size_t place = place_of[i];
        out.push_back({ring[place < ring.size() ? place : 0], repeated[i], ring[(place + 1) % ring.size()]});
    }
    if (ring.size() < 3) return true;
    const auto fan = [&] {
        for (std::size_t i = 2; i < ring.size(); ++i) out.push_back({ring[0], ring[i - 1], ring[i]});
    };
    const std::vector<Point> points = ring.size() > 3 ? project(ring_vertices, vertices) : std::vector<Point>();
    if (points.empty() || strictly_convex(points)) {
        fan();
        return true;
    }
    if (budget == 0) {
        fan();
        return false;
    }
    return EarClipper(ring, points, budget, out).run();
}

}  // namespace its::formats
