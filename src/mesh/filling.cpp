#include "mesh/filling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/simd.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "mesh/merged.h"

namespace its {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double whole_sphere = 4 * std::numbers::pi;
/// The error of an expansion is looked at where a patch is farther away than this many of its radii.
constexpr double least_gap = 0.25;
/// Loops are common to all of the surroundings where their error is smaller than this. With 2^-12 thousands of
/// loops add up to too much.
constexpr double small_common_error = 0x1p-14;
/// Moments are sums of some tens of terms with relative errors of a few u: bounds are widened by far more.
constexpr double outward = 1 + 0x1p-40, inward = 1 - 0x1p-40;

/// Edges from one point to others: of −∂M, with multiplicity, by the point that they leave.
struct Outgoing {
    std::vector<std::uint64_t> begin;
    std::vector<std::uint32_t> to;
};

Outgoing boundary_edges(const Merged& mesh) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for_edges(
        mesh, [&](std::size_t i) { return !repeats_corner(mesh.triangles[i]); },
        [&](std::uint32_t low, std::span<const EdgeUse> uses) {
            std::int64_t excess = 0;
            for (const EdgeUse& use : uses) excess += use.upwards ? 1 : -1;
            for (; excess > 0; --excess) edges.emplace_back(uses[0].high, low);
            for (; excess < 0; ++excess) edges.emplace_back(low, uses[0].high);
        });
    std::sort(edges.begin(), edges.end());
    Outgoing out;
    out.begin.resize(mesh.points.size() + 1);
    for (const auto& edge : edges) ++out.begin[edge.first + std::size_t{1}];
    std::partial_sum(out.begin.begin(), out.begin.end(), out.begin.begin());
    for (const auto& edge : edges) out.to.push_back(edge.second);
    return out;
}

/// fn(loop) for closed loops, without repeated points, that use each edge once. As many edges leave a point as
/// arrive (∂∂M = 0), so a walk ends only where it began; what it encloses on the way is cut off.
template <class F>
void for_loops(const Outgoing& out, F&& fn) {
    constexpr std::uint32_t none = ~std::uint32_t{0};
    std::vector<std::uint64_t> next(out.begin.begin(), out.begin.end() - 1);
    std::vector<std::uint32_t> place(next.size(), none);  // on the path
    std::vector<std::uint32_t> path;
    for (std::uint32_t start = 0; start < next.size(); ++start) {
        while (next[start] < out.begin[start + std::size_t{1}]) {
            path.assign(1, start);
            place[start] = 0;
            while (!path.empty()) {
                if (next[path.back()] == out.begin[path.back() + std::size_t{1}]) break;  // back at the start
                const std::uint32_t to = out.to[next[path.back()]++];
                if (place[to] == none) {
                    place[to] = std::uint32_t(path.size());
                    path.push_back(to);
                    continue;
                }
                const auto loop = std::span(path).subspan(place[to]);
                fn(loop);
                for (const std::uint32_t v : loop.subspan(1)) place[v] = none;
                path.resize(place[to] + std::size_t{1});
            }
            place[start] = none;
        }
    }
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 d = b - a;
    const double squared = dot(d, d);
    const double t = squared > 0 ? std::clamp(dot(p - a, d) / squared, 0.0, 1.0) : 0.0;
    return norm(p - a - t * d);
}

/// Cubic forms in x, y, z: coefficients of x³, y³, z³, x²y, x²z, xy², y²z, xz², yz², xyz.
using Cubic = std::array<double, 10>;

/// Adds scale (a·r)(b·r)(c·r).
void add_cubic(double scale, const Vec3& a, const Vec3& b, const Vec3& c, Cubic& form) {
    const auto mixed = [&](int i, int j) {  // of the square of axis i and axis j
        return scale * (a[i] * b[i] * c[j] + a[i] * b[j] * c[i] + a[j] * b[i] * c[i]);
    };
    for (int i = 0; i < 3; ++i) form[std::size_t(i)] += scale * a[i] * b[i] * c[i];
    form[3] += mixed(0, 1);
    form[4] += mixed(0, 2);
    form[5] += mixed(1, 0);
    form[6] += mixed(1, 2);
    form[7] += mixed(2, 0);
    form[8] += mixed(2, 1);
    form[9] +=
        scale * (a.x * (b.y * c.z + b.z * c.y) + a.y * (b.x * c.z + b.z * c.x) + a.z * (b.x * c.y + b.y * c.x));
}

double cubic_at(const Cubic& f, const Vec3& r) {
    const double xx = r.x * r.x, yy = r.y * r.y, zz = r.z * r.z;
    return r.x * (f[0] * xx + f[5] * yy + f[7] * zz + f[9] * (r.y * r.z)) +
           r.y * (f[3] * xx + f[1] * yy + f[8] * zz) + r.z * (f[4] * xx + f[6] * yy + f[2] * zz);
}

/// ½ of the Laplacian, a linear form.
Vec3 half_laplacian(const Cubic& f) {
    return {3 * f[0] + f[5] + f[7], 3 * f[1] + f[3] + f[8], 3 * f[2] + f[4] + f[6]};
}

Vec3 times(const std::array<Vec3, 3>& symmetric, const Vec3& v) {
    return v.x * symmetric[0] + v.y * symmetric[1] + v.z * symmetric[2];
}

double frobenius(const std::array<Vec3, 3>& m) {
    return std::sqrt(dot(m[0], m[0]) + dot(m[1], m[1]) + dot(m[2], m[2]));
}

/// A boundary point seen from the origin: α = y + i·z and σ = |v| + x, without cancellation.
struct Seen {
    double y, z, sigma, size;  ///< size ≥ |α|

    explicit Seen(const Vec3& v) : y(v.y), z(v.z) {
        const double squared = y * y + z * z, length = std::sqrt(v.x * v.x + squared);
        sigma = v.x >= 0 ? length + v.x : squared / (length - v.x);
        // On the ray: the displaced origin has −ε_y as its largest component, and σ falls as the square of |α|.
        if (squared == 0 && v.x < 0) y = -1;
        size = std::abs(y) + std::abs(z);
    }
};

/// Half of the spherical area between apex +x and the edge from a to b, as an angle: the argument of
/// σ_a σ_b + conj(α_a) α_b. `side`: the exact sign of its imaginary part for the displaced origin.
void add_half_lune(AngleSums<1>& sum, const Seen& a, const Seen& b, int side) {
    if (side == 0) return;  // the projections coincide
    const double sigmas = a.sigma * b.sigma;
    const double im = std::abs(a.y * b.z - a.z * b.y);
    // Relative errors: u in coordinates, 8u in σ, 3u in products: less than 32u of the sum of magnitudes.
    sum.add(0, sigmas + a.y * b.y + a.z * b.z, side > 0 ? im : -im,
            32 * unit_roundoff * (sigmas + a.size * b.size));
}

}  // namespace

Filling::Filling(const Mesh& mesh) {
    const Merged merged = merge(mesh);
    std::vector<std::uint32_t> number(merged.points.size(), none);
    std::vector<std::uint32_t> roots;
    for_loops(boundary_edges(merged), [&](std::span<const std::uint32_t> loop) {
        chain_begin_.push_back(chain_.size());
        for (const std::uint32_t v : loop) {
            if (number[v] == none) {
                number[v] = std::uint32_t(surface_.vertices.size());
                surface_.vertices.push_back(merged.points[v]);
                for (int axis = 0; axis < 3; ++axis)
                    reach_ = std::max(reach_, std::abs(merged.points[v][axis]));
            }
            chain_.push_back(number[v]);
        }
        chain_.push_back(number[loop[0]]);
        edge_count_ += loop.size();
        ++loop_count_;
    });
    chain_begin_.push_back(chain_.size());
    for (std::size_t i = 0; i + 1 < chain_begin_.size(); ++i)
        roots.push_back(
            add_chain(std::span(chain_).subspan(chain_begin_[i], chain_begin_[i + 1] - chain_begin_[i])));
    if (!roots.empty()) root_ = add_union(roots);
}

/// The patch between a chain and its chord: the triangle of its ends and its middle, and those of its halves.
std::uint32_t Filling::add_chain(std::span<const std::uint32_t> chain) {
    const std::uint32_t a = chain.front(), c = chain.back();
    const Vec3 ends[] = {surface_.vertices[a], surface_.vertices[c]};
    Node node;
    node.chord = norm(ends[1] - ends[0]) * outward;
    node.centre = 0.5 * ends[0] + 0.5 * ends[1];
    node.ends = {a, c};
    if (chain.size() == 2) return finish(node, ends);
    const std::size_t middle = chain.size() / 2;
    const std::uint32_t b = node.middle = chain[middle];
    node.left = add_chain(chain.first(middle + 1));
    node.right = add_chain(chain.subspan(middle));
    const Vec3 corners[] = {ends[0], surface_.vertices[b], ends[1]};
    if (a != c) surface_.triangles.push_back({a, b, c});
    return finish(node, corners);
}

/// A balanced tree above the patches of loops, halved along the longest side of their centres' box.
std::uint32_t Filling::add_union(std::span<const std::uint32_t> roots) {
    if (roots.size() == 1) return roots[0];
    Vec3 low = nodes_[roots[0]].centre, high = low;
    for (const std::uint32_t r : roots)
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], nodes_[r].centre[axis]);
            high[axis] = std::max(high[axis], nodes_[r].centre[axis]);
        }
    int axis = 0;
    for (int other = 1; other < 3; ++other)
        if (high[other] - low[other] > high[axis] - low[axis]) axis = other;
    std::vector<std::uint32_t> sorted(roots.begin(), roots.end());
    const auto middle = sorted.begin() + std::ptrdiff_t(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
        const double x = nodes_[a].centre[axis], y = nodes_[b].centre[axis];
        return x != y ? x < y : a < b;
    });
    Node node;
    node.left = add_union(std::span(sorted).first(sorted.size() / 2));
    node.right = add_union(std::span(sorted).subspan(sorted.size() / 2));
    node.centre = 0.5 * nodes_[node.left].centre + 0.5 * nodes_[node.right].centre;
    return finish(node, {});
}

/// The moments of a triangle: of its quadratic forms in x the mean is that over the corners, with weight ¼, and
/// the centroid, with weight ¾.
Filling::Node Filling::triangle(std::span<const Vec3> corners) {
    Node t;
    t.centre = (1.0 / 3) * corners[0] + (1.0 / 3) * corners[1] + (1.0 / 3) * corners[2];
    t.moment = 0.5 * cross(corners[1] - corners[0], corners[2] - corners[0]);
    t.area = norm(t.moment);
    for (const Vec3& v : corners) {
        const Vec3 d = v - t.centre;
        t.square += t.area / 12 * dot(d, d);
        t.radius = std::max(t.radius, norm(d));
        add_cubic(1.0 / 12, t.moment, d, d, t.second);
    }
    return t;
}

/// With a = a' + offset: the sums of n aᵀ and of (n·r)(a·r)².
void Filling::add_moments(const Node& part, const Vec3& offset, Node& node) {
    node.moment = node.moment + part.moment;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            node.first[std::size_t(i)][j] +=
                part.first[std::size_t(i)][j] + 0.5 * (part.moment[i] * offset[j] + part.moment[j] * offset[i]);
        Vec3 axis;
        axis[i] = 1;
        add_cubic(2, axis, part.first[std::size_t(i)], offset, node.second);
    }
    for (std::size_t i = 0; i < node.second.size(); ++i) node.second[i] += part.second[i];
    add_cubic(1, part.moment, offset, offset, node.second);
    node.square += part.square + part.area * dot(offset, offset);
}

/// Adds up the moments of the triangle, if there is one, and of the two parts.
std::uint32_t Filling::finish(Node node, std::span<const Vec3> corners) {
    std::array<Node, 3> parts;
    int count = 0;
    if (corners.size() == 3 && node.ends[0] != node.ends[1]) parts[std::size_t(count++)] = triangle(corners);
    if (node.left != none) parts[std::size_t(count++)] = nodes_[node.left];
    if (node.right != none) parts[std::size_t(count++)] = nodes_[node.right];

    Vec3 centre;
    for (int i = 0; i < count; ++i) node.area += parts[std::size_t(i)].area;
    for (int i = 0; i < count; ++i)
        centre = centre + (parts[std::size_t(i)].area / node.area) * parts[std::size_t(i)].centre;
    if (node.area > 0) node.centre = centre;  // else the middle of the ends, as it came
    for (int i = 0; i < count; ++i) {
        const Node& part = parts[std::size_t(i)];
        const Vec3 offset = part.centre - node.centre;
        add_moments(part, offset, node);
        node.radius = std::max(node.radius, norm(offset) + part.radius);
    }
    for (const Vec3& v : corners) node.radius = std::max(node.radius, norm(v - node.centre));
    // A centroid is off by some u of the coordinates: 64u covers the few roundings of each of up to 64 levels'
    // sums that reach it, each weighted by its area.
    const double off = 64 * unit_roundoff * reach_;
    node.square = node.square * outward + off * node.radius * node.area;
    node.linear = std::sqrt(node.square * node.area) * outward;
    node.radius = node.radius * outward + off;
    nodes_.push_back(node);
    return std::uint32_t(nodes_.size() - 1);
}

void Filling::clear(const Vec3& centre, double radius, Local& local) {
    local.centre_ = centre;
    local.gradient_ = {};
    local.hessian_ = {};
    local.radius_ = radius;
    local.near_gradient_ = {};
    local.value_ = local.error_ = local.bend_ = 0;
    local.clear_ = true;
    local.vertices_.clear();
    local.triangles_.clear();
}

void Filling::localise(const Vec3& centre, double radius, double tolerance, Local& local) const {
    clear(centre, radius, local);
    if (root_ != none) collect(root_, none, none, tolerance, local);
}

void Filling::surround(const Vec3& centre, double radius, Surroundings& surroundings) const {
    clear(centre, radius, surroundings.far_);
    surroundings.near_.clear();
    if (root_ != none) collect_loops(root_, surroundings);
}

void Filling::collect_loops(std::uint32_t index, Surroundings& surroundings) const {
    const Node& node = nodes_[index];
    Local& far = surroundings.far_;
    const double length = norm(node.centre - far.centre_), gap = length - far.radius_ - node.radius;
    if (gap > least_gap * node.radius) {
        const double error = far_error(node, length, gap, far.radius_);
        if (error < small_common_error) return add_far(node, length, error, far);
    }
    if (node.middle != none || node.left == none) {
        surroundings.near_.push_back(index);
        return;
    }
    collect_loops(node.left, surroundings);
    collect_loops(node.right, surroundings);
}

void Filling::localise(const Vec3& centre, double radius, double tolerance, const Surroundings& surroundings,
                       Local& local) const {
    clear(centre, radius, local);
    const Local& far = surroundings.far_;
    const Vec3 offset = centre - far.centre_;
    local.value_ = far.far(offset);
    local.gradient_ = far.gradient_ + times(far.hessian_, offset);
    local.hessian_ = far.hessian_;
    local.error_ = far.error_ + far.rounding();
    for (const std::uint32_t index : surroundings.near_) collect(index, none, none, tolerance, local);
}

/// The patch's solid angle is ∫ n·K(r + u) dA, K(y) = y/|y|³, with r from the ball's centre to the patch's and
/// u = a − b, b from the ball's centre to the point. Term k of the Taylor series about r is at most
/// (k + 1) |u|ᵏ / |r|ᵏ⁺²; those of k ≥ 3 add up to at most |u|³/|r|⁵ (4 − 3t)/(1 − t)² for |u| ≤ t|r|, t < 1.
/// And ∫ |u|³ ≤ ∫ (|a| + R)³. Rounding: the sums have below 2⁹ |n|/|r|² in all, of below 2⁵ roundings each;
/// moments are off by those of their centres.
double Filling::far_error(const Node& node, double length, double gap, double ball) const {
    const double inverse = 1 / length, near = 1 / gap;
    const double q = gap * inverse, over = length * near;  // 1 − t
    const double inverse2 = inverse * inverse;
    const double cubes =
        (node.radius + 3 * ball) * node.square + ball * ball * (3 * node.linear + ball * node.area);
    const double series = (1 + 3 * q) * (over * over) * (inverse2 * inverse2 * inverse) * cubes;
    const double rounding = node.area * (0x1p-38 * inverse2 + 0x1p-43 * reach_ * (near * near) * near);
    return (series + rounding) * outward / whole_sphere;
}

/// K's derivatives at r are A = 1/|r|³ − 3rrᵀ/|r|⁵ and B = 15rrr/|r|⁷ − 3(δr + rδ + …)/|r|⁵. Up to order two
/// ∫ n·K(r + a − b) is N·K + first:A + ½ second:B − (AN + B:first)·b + ½ b·(BN)b.
void Filling::add_far(const Node& node, double length, double error, Local& local) {
    const Vec3 r = node.centre - local.centre_;
    const double inverse = 1 / length, inverse2 = inverse * inverse;
    const double i3 = inverse * inverse2 / whole_sphere, i5 = i3 * inverse2, i7 = i5 * inverse2;
    const double normal = dot(node.moment, r);
    const Vec3 turned = times(node.first, r);
    const double trace = node.first[0].x + node.first[1].y + node.first[2].z, form = dot(turned, r);
    local.value_ += (normal + trace) * i3 - (3 * form + 1.5 * dot(half_laplacian(node.second), r)) * i5 +
                    7.5 * cubic_at(node.second, r) * i7;
    local.gradient_ = local.gradient_ + (3 * (normal + trace) * i5 - 15 * form * i7) * r - i3 * node.moment +
                      (6 * i5) * turned;
    for (int i = 0; i < 3; ++i) {
        Vec3& row = local.hessian_[std::size_t(i)];
        row = row + (15 * normal * i7 * r[i] - 3 * i5 * node.moment[i]) * r - (3 * i5 * r[i]) * node.moment;
        row[i] -= 3 * normal * i5;
    }
    local.error_ += error;
}

/// An edge of what is near, `distance` from the ball. By Biot and Savart the gradient of a winding number is
/// (1/4π) ∫ K(x − p) × dx along its boundary, for a segment from p + a to p + b
/// (a × b) (|a| + |b|) / (|a||b| (|a||b| + a·b)). With the bounds on K and K' it is at most
/// min(length / d², 2 / d), and its own derivative is at most min(2 length / d³, 4 / d²).
void Filling::add_edge(const Node& node, double distance, Local& local) const {
    if (!(distance > 0)) {
        local.bend_ = infinity;
        return;
    }
    const double inverse = 1 / distance;
    const double slope = std::min(node.chord * inverse, 2.0) * inverse * local.radius_;
    const double bend = std::min(node.chord * inverse, 2.0) * inverse * inverse * local.radius_ * local.radius_;
    if (bend > slope) {
        local.bend_ += slope * (outward / whole_sphere);
        return;
    }
    const Vec3 a = surface_.vertices[node.ends[0]] - local.centre_,
               b = surface_.vertices[node.ends[1]] - local.centre_;
    const double la = norm(a), lb = norm(b), product = la * lb, sum = product + dot(a, b);
    // The error of `sum` is below 8u of the product, and so is that of a × b, beside the length of which
    // `sum` is at most 2|a||b|: where the edge is seen under almost half a turn, the bound takes over.
    if (!(sum > 0x1p-20 * product)) {
        local.bend_ += slope * (outward / whole_sphere);
        return;
    }
    const double scale = (la + lb) / (product * sum * whole_sphere);
    local.near_gradient_ = local.near_gradient_ + scale * cross(a, b);
    local.bend_ += (bend + 64 * unit_roundoff * (product * local.radius_) * (la + lb) / (product * sum)) *
                   (outward / whole_sphere);
}

/// What is far is within its error of a quadratic function; what is near differs from a linear one by its bend.
double Filling::Local::variation() const {
    const double bend = bend_ + 0.5 * frobenius(hessian_) * radius_ * radius_;
    return (norm(gradient_ + near_gradient_) * radius_ + 2 * (error_ + rounding()) + bend) * outward;
}

double Filling::Local::far(const Vec3& offset) const {
    return value_ + dot(gradient_ + 0.5 * times(hessian_, offset), offset);
}

double Filling::Local::rounding() const {
    return 32 * unit_roundoff *
           (std::abs(value_) + (norm(gradient_) + frobenius(hessian_) * radius_) * radius_);
}

/// \param first, last  the chord's ends among the near vertices; none: a loop, or several
void Filling::collect(std::uint32_t index, std::uint32_t first, std::uint32_t last, double tolerance,
                      Local& local) const {
    const Node& node = nodes_[index];
    const double length = norm(node.centre - local.centre_), gap = length - local.radius_ - node.radius;
    const bool leaf = node.left == none;
    bool far = leaf;
    if (!leaf && gap > least_gap * node.radius) {
        const double error = far_error(node, length, gap, local.radius_);
        far = error < tolerance;
        if (far) add_far(node, length, error, local);
    }
    if (far) {
        // What is near ends at the edges and at the chords of what is far.
        if (node.chord > 0 && local.radius_ > 0)
            add_edge(node,
                     leaf ? distance_to_segment(local.centre_, surface_.vertices[node.ends[0]],
                                                surface_.vertices[node.ends[1]]) *
                                    inward -
                                local.radius_
                          : gap,
                     local);
        return;
    }
    if (node.middle == none) {  // of several loops
        collect(node.left, none, none, tolerance, local);
        collect(node.right, none, none, tolerance, local);
        return;
    }
    const auto add_vertex = [&](std::uint32_t v) {
        local.vertices_.push_back(surface_.vertices[v]);
        return std::uint32_t(local.vertices_.size() - 1);
    };
    if (first == none) first = last = add_vertex(node.ends[0]);
    const std::uint32_t middle = add_vertex(node.middle);
    if (node.ends[0] != node.ends[1]) {
        local.triangles_.push_back({first, middle, last});
        if (comes_near(node, gap, local)) local.clear_ = false;
    }
    collect(node.left, first, middle, tolerance, local);
    collect(node.right, middle, last, tolerance, local);
}

/// Whether the node's triangle may meet the ball: its plane does, and the sphere around the patch. *Rounding:*
/// a component of n is a difference of products of coordinates of b − a and c − a, so that n errs by less than
/// 16u|b − a||c − a|, which for slivers is much beside |n|; n·d by that times |d|, and by 8u|n||d|. 64u covers
/// both.
bool Filling::comes_near(const Node& node, double gap, const Local& local) const {
    const Vec3 &a = surface_.vertices[node.ends[0]], &b = surface_.vertices[node.middle],
               &c = surface_.vertices[node.ends[1]];
    const Vec3 n = cross(b - a, c - a), d = a - local.centre_;
    const double slack = 64 * unit_roundoff * norm(b - a) * norm(c - a) * (norm(d) + local.radius_);
    return gap <= 0 && std::abs(dot(n, d)) <= local.radius_ * norm(n) + slack;
}

ITS_CLONES void Filling::Local::see(const Vec3& vertex, const Points& points, Seen& seen) {
    for (int i = 0; i < block; ++i) {
        const double x = vertex.x - points.x[i], y = vertex.y - points.y[i], z = vertex.z - points.z[i];
        seen.x[i] = x;
        seen.y[i] = y;
        seen.z[i] = z;
        seen.length[i] = std::sqrt(x * x + y * y + z * z);
    }
}

ITS_CLONES void Filling::Local::add(const Seen& a, const Seen& b, const Seen& c, AngleSums<block>& sums,
                                    double* doubtful) {
#pragma GCC ivdep
    for (int i = 0; i < block; ++i)
        doubtful[i] +=
            add_half_solid_angle(sums, i, {a.x[i], a.y[i], a.z[i], a.length[i]},
                                 {b.x[i], b.y[i], b.z[i], b.length[i]}, {c.x[i], c.y[i], c.z[i], c.length[i]});
}

void Filling::Local::at(const Points& points, Estimates& out) {
    if (seen_.size() < vertices_.size()) seen_.resize(2 * vertices_.size());
    for (std::size_t i = 0; i < vertices_.size(); ++i) see(vertices_[i], points, seen_[i]);
    AngleSums<block> sums;
    double doubtful[block] = {};
    for (const Triangle& t : triangles_) add(seen_[t[0]], seen_[t[1]], seen_[t[2]], sums, doubtful);
    const double rounding = this->rounding();
    for (int i = 0; i < block; ++i) {
        const Vec3 offset = Vec3{points.x[i], points.y[i], points.z[i]} - centre_;
        out.value[i] = far(offset) + sums.sum(i) / (2 * std::numbers::pi);
        out.error[i] =
            error_ + rounding + doubtful[i] + sums.error(i, double(triangles_.size())) / (2 * std::numbers::pi);
    }
}

WindingEstimate Filling::Local::at(const Vec3& point) const {
    const auto sight = [&](std::uint32_t v) {
        const Vec3 d = vertices_[v] - point;
        return Sight{d.x, d.y, d.z, norm(d)};
    };
    AngleSums<1> sum;
    double doubtful = 0;
    for (const Triangle& t : triangles_)
        doubtful += add_half_solid_angle(sum, 0, sight(t[0]), sight(t[1]), sight(t[2]));
    const double rounding = this->rounding();
    return {far(point - centre_) + sum.sum(0) / (2 * std::numbers::pi),
            error_ + rounding + doubtful + sum.error(0, double(triangles_.size())) / (2 * std::numbers::pi)};
}

WindingEstimate Filling::boundary_term(const Vec3& p) const {
    AngleSums<1> sum;
    for (std::size_t loop = 0; loop + 1 < chain_begin_.size(); ++loop) {
        const Vec3* a = &surface_.vertices[chain_[chain_begin_[loop]]];
        Seen from(*a - p);
        for (std::uint64_t i = chain_begin_[loop] + 1; i < chain_begin_[loop + 1]; ++i) {
            const Vec3* b = &surface_.vertices[chain_[i]];
            const Seen to(*b - p);
            add_half_lune(sum, from, to, perturbed_orient2d_yz(*a, *b, p));
            a = b;
            from = to;
        }
    }
    // The loops run along −∂M.
    return {-sum.sum(0) / (2 * std::numbers::pi), sum.error(0, double(edge_count_)) / (2 * std::numbers::pi)};
}

int Filling::crossings(const Vec3& p) const {
    const Vec3 from{-2 * reach_ - std::abs(p.x), p.y, p.z};
    int sum = 0;
    for (const Triangle& t : surface_.triangles)
        sum += x_line_crossing(surface_.vertices[t[0]], surface_.vertices[t[1]], surface_.vertices[t[2]], from,
                               p.x);
    return sum;
}

}  // namespace its
