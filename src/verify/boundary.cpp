#include "verify/boundary.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "geometry/vec3.h"
#include "verify/exact.h"

namespace its::verifier {
namespace {

bool before(const Vec3& a, const Vec3& b) {
    return std::tuple(a.x, a.y, a.z) < std::tuple(b.x, b.y, b.z);
}

/// An edge between numbered positions, low < high.
struct Use {
    std::uint32_t low, high;
    std::int64_t excess;  ///< uses from low to high, less those from high to low; or just the uses
};

/// Adds up the uses of each edge; those that come to 0 go.
std::vector<Use> add_up(std::vector<Use> uses, bool parity) {
    std::sort(uses.begin(), uses.end(),
              [](const Use& s, const Use& t) { return std::pair(s.low, s.high) < std::pair(t.low, t.high); });
    std::vector<Use> out;
    for (std::size_t i = 0; i < uses.size();) {
        Use sum = uses[i];
        for (++i; i < uses.size() && uses[i].low == sum.low && uses[i].high == sum.high; ++i)
            sum.excess += uses[i].excess;
        if (parity) sum.excess &= 1;
        if (sum.excess != 0) out.push_back(sum);
    }
    return out;
}

/// Positions by each coordinate, to find those within a box.
class SortedEnds {
public:
    SortedEnds(const std::vector<Vec3>& at, const std::vector<std::uint32_t>& which) : at_(at) {
        for (int axis = 0; axis < 3; ++axis) {
            sorted_[axis] = which;
            std::sort(sorted_[axis].begin(), sorted_[axis].end(),
                      [&](std::uint32_t i, std::uint32_t j) { return at[i][axis] < at[j][axis]; });
        }
    }

    /// Those strictly within the edge, in order from `a`.
    std::vector<std::uint32_t> within(std::uint32_t a, std::uint32_t b) const {
        auto best = range(0, a, b);
        for (int axis = 1; axis < 3; ++axis) {
            const auto other = range(axis, a, b);
            if (other.second - other.first < best.second - best.first) best = other;
        }
        std::vector<std::uint32_t> out;
        for (auto it = best.first; it != best.second; ++it)
            if (strictly_between(at_[a], at_[b], at_[*it])) out.push_back(*it);
        const bool ascending = before(at_[a], at_[b]);
        std::sort(out.begin(), out.end(), [&](std::uint32_t i, std::uint32_t j) {
            return ascending ? before(at_[i], at_[j]) : before(at_[j], at_[i]);
        });
        return out;
    }

private:
    using Iterator = std::vector<std::uint32_t>::const_iterator;
    std::pair<Iterator, Iterator> range(int axis, std::uint32_t a, std::uint32_t b) const {
        const double low = std::min(at_[a][axis], at_[b][axis]), high = std::max(at_[a][axis], at_[b][axis]);
        const auto begin = std::lower_bound(sorted_[axis].begin(), sorted_[axis].end(), low,
                                            [&](std::uint32_t i, double v) { return at_[i][axis] < v; });
        const auto end = std::upper_bound(begin, sorted_[axis].end(), high,
                                          [&](double v, std::uint32_t i) { return v < at_[i][axis]; });
        return {begin, end};
    }

    const std::vector<Vec3>& at_;
    std::vector<std::uint32_t> sorted_[3];
};

/// What is left when edges are divided at all ends of other edges that lie on them.
std::vector<BoundaryEdge> cancel(const std::vector<Vec3>& at, const std::vector<Use>& uses, bool parity) {
    std::vector<std::uint32_t> ends;
    for (const Use& use : uses) ends.insert(ends.end(), {use.low, use.high});
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    const SortedEnds sorted(at, ends);
    std::vector<Use> parts;
    for (const Use& use : uses) {
        std::vector<std::uint32_t> chain = sorted.within(use.low, use.high);
        chain.push_back(use.high);
        std::uint32_t from = use.low;
        for (const std::uint32_t to : chain) {
            parts.push_back({std::min(from, to), std::max(from, to), from < to ? use.excess : -use.excess});
            from = to;
        }
    }
    std::vector<BoundaryEdge> out;
    for (const Use& use : add_up(std::move(parts), parity))
        out.push_back({at[use.low], at[use.high], use.excess});
    return out;
}

/// The direction of a vertex in the plane across the ray, y to the right and x upward, and how far behind the
/// point it is: |v| − z. All three up to the same factor, which no argument depends on.
struct Direction {
    double y, x, behind;
};

/// Squares of what is small would underflow: the vector, or what of it is across a ray that it nearly is on, is
/// multiplied by a power of two.
Direction direction_of(Vec3 v) {
    const double longest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (longest > 0 && longest < 0x1p-300)
        for (int axis = 0; axis < 3; ++axis) v[axis] = std::ldexp(v[axis], -std::ilogb(longest));
    // On the ray itself the displacement decides, most of it along −y.
    if (v.x == 0 && v.y == 0 && v.z > 0) return {-1, 0, 0};
    const double across = std::max(std::abs(v.x), std::abs(v.y));
    if (v.z > 0 && across < 0x1p-100 * v.z) {  // |v| = z up to 2⁻²⁰⁰ of it
        const int exponent = std::ilogb(across);
        const double y = std::ldexp(v.y, -exponent), x = std::ldexp(v.x, -exponent);
        return {y, x, std::ldexp((x * x + y * y) / (2 * v.z), exponent)};
    }
    const double across2 = v.x * v.x + v.y * v.y, length = std::sqrt(across2 + v.z * v.z);
    return {v.y, v.x, v.z > 0 ? across2 / (length + v.z) : length - v.z};
}

}  // namespace

Positions number_positions(const Mesh& mesh) {
    std::vector<std::uint32_t> order;
    for (const Triangle& t : mesh.triangles) order.insert(order.end(), t.begin(), t.end());
    std::sort(order.begin(), order.end());
    order.erase(std::unique(order.begin(), order.end()), order.end());
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t i, std::uint32_t j) { return before(mesh.vertices[i], mesh.vertices[j]); });
    Positions out{{}, std::vector<std::uint32_t>(mesh.vertices.size())};
    for (const std::uint32_t v : order) {
        if (out.at.empty() || !(out.at.back() == mesh.vertices[v])) out.at.push_back(mesh.vertices[v]);
        out.number[v] = std::uint32_t(out.at.size() - 1);
    }
    return out;
}

Boundary find_boundary(const Mesh& mesh) {
    const auto [at, number] = number_positions(mesh);
    std::vector<Use> directed, counted;
    for (const Triangle& t : mesh.triangles) {
        const std::uint32_t c[3] = {number[t[0]], number[t[1]], number[t[2]]};
        if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t from = c[i], to = c[(i + 1) % 3];
            directed.push_back({std::min(from, to), std::max(from, to), from < to ? 1 : -1});
            counted.push_back({std::min(from, to), std::max(from, to), 1});
        }
    }
    Boundary out;
    out.vertices = at.size();
    for (const Use& use : add_up(counted, false)) out.single_edges = out.single_edges || use.excess == 1;
    out.edges = cancel(at, add_up(std::move(directed), false), false);
    out.odd_edges = cancel(at, add_up(std::move(counted), true), true);
    return out;
}

// What products lose below 2⁻¹⁰⁷⁴, times sizes below 2³⁰⁰; far below the products themselves.
constexpr double underflow = 0x1p-700;

// Half of the solid angle of (−z, a, b) is the argument of behind_a·behind_b + conj(across_a)·across_b, across
// = y + ix (Van Oosterom, Strackee 1983, with the first vertex at infinity). On which side of the ray the edge
// passes, the sign of the imaginary part, must be what the crossings are counted by: it is taken from the same
// exact sign. A coordinate of a − p errs by a relative u, `behind` by 8u, the products by 3u more: the complex
// number is off by less than 32u (behind_a behind_b + |across_a||across_b|), its argument by π/2 times that
// over its modulus.
Estimate boundary_term(const std::vector<BoundaryEdge>& edges, const Vec3& p) {
    double half = 0, error = 0;
    for (const BoundaryEdge& edge : edges) {
        const int turn = displaced_turn(edge.a, edge.b, p);
        if (turn == 0) continue;
        const Direction a = direction_of(edge.a - p), b = direction_of(edge.b - p);
        const double behind = a.behind * b.behind, along = a.y * b.y + a.x * b.x, real = behind + along,
                     imaginary = std::abs(a.y * b.x - a.x * b.y);
        const double angle = std::atan2(imaginary, real), times = double(edge.excess);
        half -= times * (turn > 0 ? angle : -angle);
        const double size = std::max(std::abs(real), imaginary);  // at least 0.7 of the modulus
        error += std::abs(times) *
                 ((64 * roundoff * (behind + std::abs(along) + imaginary) + underflow) / size + 4 * roundoff);
    }
    return {half / (2 * std::numbers::pi), error / (2 * std::numbers::pi) * (1 + 0x1p-20)};
}

}  // namespace its::verifier
