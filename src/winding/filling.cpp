#include "winding/filling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/double_double.h"
#include "base/platform/compiler.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "winding/expansion.h"

namespace its::winding {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Edges from one point to others: of −∂M, with multiplicity, by the point that they leave.
struct Outgoing {
    std::vector<std::uint64_t> begin;
    std::vector<std::uint32_t> to;
};

Outgoing boundary_edges(const mesh::Merged& mesh) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    mesh::for_edges(
        mesh, [&](std::size_t i) { return !mesh::repeats_corner(mesh.triangles[i]); },
        [&](std::uint32_t low, std::span<const mesh::EdgeUse> uses) {
            std::int64_t excess = 0;
            for (const mesh::EdgeUse& use : uses) excess += use.upwards ? 1 : -1;
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

/// ½ of the Laplacian, a linear form.
Vec3 half_laplacian(const Cubic& f) {
    return {3 * f[0] + f[5] + f[7], 3 * f[1] + f[3] + f[8], 3 * f[2] + f[4] + f[6]};
}

/// What products of coordinates below lose by underflow: 2⁻¹⁰⁷⁴ for each of them, and 2⁻¹⁰⁷⁴ of the other's σ,
/// below 2³⁰⁰. Coordinates of points that are not moved are above 2⁻⁴⁰⁰ (Shifts), and so are the products of
/// shells' meshes, of size 2⁻²⁵⁰ to 2²⁵⁰, above this but for points 2⁻⁵⁰ of that size away from the boundary.
constexpr double underflow = 0x1p-700;

/// Exponents of powers of two by which a vector is multiplied so that its squares lose nothing: `all` of it,
/// and `across`, what is across the ray, besides. The argument of σ_a σ_b + conj(α_a) α_b, below, stays if α
/// and σ of a point are multiplied by the same positive number. Not 0 only for vectors shorter than 2⁻³⁰⁰ and
/// for those that point along the ray up to an angle of 2⁻¹⁰⁰.
struct Shifts {
    int all = 0, across = 0;

    Shifts(double x, double y, double z) {
        const double off = std::max(std::abs(y), std::abs(z)), most = std::max(std::abs(x), off);
        if (most == 0) return;
        if (most < 0x1p-300) all = -std::ilogb(most);
        if (x < 0 && off > 0 && off < 0x1p-100 * -x) across = -std::ilogb(off) - all;
    }
};

/// A boundary point seen from the origin, up to a factor: α = y + i·z and σ = |v| + x, without cancellation.
struct Seen {
    double y, z, sigma, size;  ///< size ≥ |α|

    explicit Seen(const Vec3& v) : y(v.y), z(v.z) {
        double x = v.x;
        const Shifts shifts(x, y, z);
        if (shifts.all != 0) x = std::ldexp(x, shifts.all);
        if (const int of = shifts.all + shifts.across; of != 0) y = std::ldexp(y, of), z = std::ldexp(z, of);
        const double squared = y * y + z * z;
        if (shifts.across != 0)  // |v| = −x up to 2⁻²⁰⁰ of it
            sigma = std::ldexp(squared / (-2 * x), -shifts.across);
        else if (x >= 0)
            sigma = std::sqrt(x * x + squared) + x;
        else
            sigma = squared / (std::sqrt(x * x + squared) - x);
        // On the ray: the displaced origin has −ε_y as its largest component, and σ falls as the square of |α|.
        if (y == 0 && z == 0 && x < 0) y = -1;
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
    const double re = sigmas + a.y * b.y + a.z * b.z,
                 error = 32 * unit_roundoff * (sigmas + a.size * b.size) + underflow;
    sum.add(0, re, side > 0 ? im : -im, re == 0 && im == 0 ? infinity : error);
}

/// As Seen, with twice the digits. Differences are exact; relative errors, with u² = 2⁻¹⁰⁶: |α|² 15u², |v|²
/// 30u², |v| 27u², σ as a sum 33u², as a quotient 15u² + 45u² + 8u².
struct PreciseSeen {
    DoubleDouble y, z, sigma;
    double size;  ///< ≥ |α|

    PreciseSeen(const Vec3& v, const Vec3& p) : y(exact_sum(v.y, -p.y)), z(exact_sum(v.z, -p.z)) {
        DoubleDouble x = exact_sum(v.x, -p.x);
        const Shifts shifts(x.high, y.high, z.high);
        if (shifts.all != 0) x = shifted(x, shifts.all);
        if (const int of = shifts.all + shifts.across; of != 0) y = shifted(y, of), z = shifted(z, of);
        const DoubleDouble squared = sum_of_products(y, y, z, z);
        if (shifts.across != 0)
            sigma = shifted(squared * inverse(-(x + x)), -shifts.across);
        else if (x.high != 0 || squared.high > 0) {
            const DoubleDouble length = square_root(x * x + squared);
            sigma = x.high >= 0 ? length + x : squared * inverse(length - x);
        }
        if (y.high == 0 && z.high == 0 && x.high < 0) y = -1;
        size = (std::abs(y.high) + std::abs(z.high)) * outward;
    }

private:
    static DoubleDouble shifted(const DoubleDouble& v, int by) {
        return {std::ldexp(v.high, by), std::ldexp(v.low, by)};
    }
};

/// As AngleSums, of one sum, with twice the digits until the end.
class PreciseAngleSum {
public:
    /// Adds arg(re + i·im), which has the sign of `side` for re < 0.
    void add(DoubleDouble re, DoubleDouble im, double side, double error) {
        const double size = std::abs(re.high) + std::abs(im.high);
        if (!(size > 0)) {  // the point is on the edge, as far as can be told
            error_ = infinity;
            return;
        }
        error_ += (std::numbers::sqrt2 * std::numbers::pi / 2) * outward * (error / size);
        if (re.high < 0) {  // turned by a right angle, as there
            quarters_ += side;
            const DoubleDouble turned = side > 0 ? im : -im;
            im = side > 0 ? -re : re;
            re = turned;
        }
        const double scale = std::ldexp(1.0, -std::ilogb(size));
        re = {scale * re.high, scale * re.low};
        im = {scale * im.high, scale * im.low};
        const DoubleDouble x = sum_of_products(x_, re, -y_, im), y = sum_of_products(x_, im, y_, re);
        const bool below = y.high < 0, was_below = y_.high < 0;
        if (x.high < 0 && x_.high < 0 && below != was_below) quarters_ += below ? 4 : -4;
        const double shrink = std::ldexp(1.0, -std::ilogb(std::abs(x.high) + std::abs(y.high)));
        x_ = {shrink * x.high, shrink * x.low};
        y_ = {shrink * y.high, shrink * y.low};
        ++count_;
    }

    double sum() const { return std::atan2(y_.high, x_.high) + std::numbers::pi / 2 * quarters_; }
    /// 64u² for each product; 8u for the last steps and each quarter turn.
    double error() const {
        return error_ + 64 * unit_roundoff * unit_roundoff * count_ +
               8 * unit_roundoff * (2 + std::abs(quarters_));
    }

private:
    DoubleDouble x_ = 1, y_ = 0;
    double quarters_ = 0, error_ = 0, count_ = 0;
};

void add_half_lune(PreciseAngleSum& sum, const PreciseSeen& a, const PreciseSeen& b, int side) {
    if (side == 0) return;
    const DoubleDouble sigmas = a.sigma * b.sigma, re = sigmas + sum_of_products(a.y, b.y, a.z, b.z);
    DoubleDouble im = sum_of_products(a.y, b.z, -a.z, b.y);
    if ((im.high < 0) != (side < 0)) im = -im;  // it is 0 but for its error
    // σσ 144u² and, in the sum, 6u²; α·α 15u² and 6u²; the imaginary part 15u².
    sum.add(re, im, side,
            256 * unit_roundoff * unit_roundoff * (sigmas.high + a.size * b.size) * outward + underflow);
}

}  // namespace

Filling::Filling(const mesh::Merged& merged) {
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
    if (!roots.empty()) add_union(roots);
}

/// The patch between a chain and its chord: the triangle of its ends and its middle, and those of its halves.
std::uint32_t Filling::add_chain(std::span<const std::uint32_t> chain) {
    const std::uint32_t a = chain.front(), c = chain.back();
    const Vec3 ends[] = {surface_.vertices[a], surface_.vertices[c]};
    Node node;
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

/// The winding numbers of points, as far as they are summed.
struct Filling::Sums {
    Points points;
    double tolerance;
    AngleSums<block> angles;
    double value[block] = {}, error[block] = {};
    double count = 0;

    ITS_CLONES void finish(Estimates& out) const {
        ITS_INDEPENDENT
        for (int i = 0; i < block; ++i) {
            out.value[i] = value[i] + angles.quick_sum(i) * (0.5 / std::numbers::pi);
            out.error[i] = error[i] + 32 * unit_roundoff * std::abs(value[i]) +
                           (quick_error + angles.error(i, count)) * (0.5 / std::numbers::pi);
        }
    }
};

/// A patch by its moments.
/// \return false, with nothing added, if that errs by more than the tolerance at a point
ITS_CLONES bool Filling::add_patch(const Node& node, Sums& sums) const {
    const Vec3 c = node.centre, n = node.moment;
    const double radius = node.radius, area = node.area, reach = reach_, least = (1 + least_gap) * radius;
    const double cubes = radius * node.square;
    double rx[block], ry[block], rz[block], inverse[block], error[block];
    ITS_INDEPENDENT
    for (int i = 0; i < block; ++i) {
        const double x = c.x - sums.points.x[i], y = c.y - sums.points.y[i], z = c.z - sums.points.z[i];
        const double length = std::sqrt(x * x + y * y + z * z), away = length > least ? length : 2 * least + 1;
        const PatchError e = patch_error(away, radius, area, reach);
        rx[i] = x;
        ry[i] = y;
        rz[i] = z;
        inverse[i] = 1 / away;
        error[i] = length > least ? e.scale * cubes + e.rounding : infinity;
    }
    double worst = 0;
    for (int i = 0; i < block; ++i) worst = error[i] > worst ? error[i] : worst;
    if (!(worst < sums.tolerance)) return false;
    const auto first = node.first;
    const auto f = node.second;
    const double trace = first[0].x + first[1].y + first[2].z;
    const Vec3 laplacian = half_laplacian(f);
    ITS_INDEPENDENT
    for (int i = 0; i < block; ++i) {
        const double x = rx[i], y = ry[i], z = rz[i], i2 = inverse[i] * inverse[i];
        const double form = x * (first[0].x * x + 2 * (first[0].y * y + first[0].z * z)) +
                            y * (first[1].y * y + 2 * first[1].z * z) + first[2].z * z * z;
        const double xx = x * x, yy = y * y, zz = z * z;
        const double cubic = x * (f[0] * xx + f[5] * yy + f[7] * zz + f[9] * (y * z)) +
                             y * (f[3] * xx + f[1] * yy + f[8] * zz) + z * (f[4] * xx + f[6] * yy + f[2] * zz);
        const double normal = n.x * x + n.y * y + n.z * z,
                     linear = laplacian.x * x + laplacian.y * y + laplacian.z * z;
        sums.value[i] += inverse[i] * i2 * (1 / whole_sphere) *
                         (normal + trace - i2 * (3 * form + 1.5 * linear - 7.5 * i2 * cubic));
        sums.error[i] += error[i];
    }
    return true;
}

ITS_CLONES void Filling::add_triangle(const Node& node, Sums& sums) const {
    const Vec3 a = surface_.vertices[node.ends[0]], b = surface_.vertices[node.middle],
               c = surface_.vertices[node.ends[1]];
    ITS_INDEPENDENT
    for (int i = 0; i < block; ++i) {
        const double x = sums.points.x[i], y = sums.points.y[i], z = sums.points.z[i];
        const double ax = a.x - x, ay = a.y - y, az = a.z - z, bx = b.x - x, by = b.y - y, bz = b.z - z,
                     cx = c.x - x, cy = c.y - y, cz = c.z - z;
        sums.error[i] +=
            add_half_solid_angle(sums.angles, i, {ax, ay, az, std::sqrt(ax * ax + ay * ay + az * az)},
                                 {bx, by, bz, std::sqrt(bx * bx + by * by + bz * bz)},
                                 {cx, cy, cz, std::sqrt(cx * cx + cy * cy + cz * cz)});
    }
    ++sums.count;
}

void Filling::collect(std::uint32_t index, Sums& sums) const {
    const Node& node = nodes_[index];
    if (node.left == none || add_patch(node, sums)) return;  // an edge has no area
    if (node.middle != none && node.ends[0] != node.ends[1]) add_triangle(node, sums);
    collect(node.left, sums);
    collect(node.right, sums);
}

void Filling::winding(const Points& points, double tolerance, Estimates& out) const {
    Sums sums{points, tolerance, {}};
    if (!empty()) collect(std::uint32_t(nodes_.size() - 1), sums);
    sums.finish(out);
}

WindingEstimate Filling::winding(const Vec3& point, double tolerance) const {
    Points points;
    Estimates estimates;
    for (int i = 0; i < block; ++i) points.x[i] = point.x, points.y[i] = point.y, points.z[i] = point.z;
    winding(points, tolerance, estimates);
    return {estimates.value[0], estimates.error[0]};
}

/// fn(loop's first point), then fn of each next one, loop by loop.
template <class F>
void Filling::for_boundary(F&& fn) const {
    for (std::size_t loop = 0; loop + 1 < chain_begin_.size(); ++loop)
        for (std::uint64_t i = chain_begin_[loop]; i < chain_begin_[loop + 1]; ++i)
            fn(surface_.vertices[chain_[i]], i == chain_begin_[loop]);
}

namespace {

/// Of a sum of half angles along the loops, which run along −∂M.
WindingEstimate as_winding(double sum, double error) {
    const double bound = error / (2 * std::numbers::pi) * outward;
    return {-sum / (2 * std::numbers::pi), bound < useless_error ? bound : infinity};
}

}  // namespace

WindingEstimate Filling::boundary_term(const Vec3& p) const {
    AngleSums<1> sum;
    const Vec3* a = nullptr;
    Seen from(Vec3{});
    for_boundary([&](const Vec3& b, bool first) {
        const Seen to(b - p);
        if (!first) add_half_lune(sum, from, to, geometry::perturbed_orient2d_yz(*a, b, p));
        a = &b;
        from = to;
    });
    return as_winding(sum.sum(0), sum.error(0, double(edge_count_)));
}

WindingEstimate Filling::precise_boundary_term(const Vec3& p) const {
    PreciseAngleSum sum;
    const Vec3* a = nullptr;
    PreciseSeen from(p, p);
    for_boundary([&](const Vec3& b, bool first) {
        const PreciseSeen to(b, p);
        if (!first) add_half_lune(sum, from, to, geometry::perturbed_orient2d_yz(*a, b, p));
        a = &b;
        from = to;
    });
    return as_winding(sum.sum(), sum.error());
}

double Filling::boundary_length() const {
    double length = 0;
    const Vec3* a = nullptr;
    for_boundary([&](const Vec3& b, bool first) {
        if (!first) length += norm(b - *a);
        a = &b;
    });
    return length;
}

std::uint64_t Filling::memory_bytes() const {
    return surface_.vertices.size() * sizeof(Vec3) + surface_.triangles.size() * sizeof(Triangle) +
           nodes_.size() * sizeof(Node) + chain_.size() * sizeof(chain_[0]) +
           chain_begin_.size() * sizeof(chain_begin_[0]);
}

int Filling::crossings(const Vec3& p) const {
    const Vec3 from{-2 * reach_ - std::abs(p.x), p.y, p.z};
    int sum = 0;
    for (const Triangle& t : surface_.triangles)
        sum += geometry::x_line_crossing(surface_.vertices[t[0]], surface_.vertices[t[1]],
                                         surface_.vertices[t[2]], from, p.x);
    return sum;
}

}  // namespace its::winding
