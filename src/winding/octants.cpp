#include "winding/octants.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/platform/compiler.h"
#include "geometry/vec3.h"
#include "winding/expansion.h"

namespace its::winding {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t none = ~std::uint32_t{0};
/// See expand().
constexpr double edge_rounding = 0x1p-30, most_obtuse = 0x1p-12;

using Row = double[Octants::lanes];

void spread(std::uint32_t mask, Row& out) {
    for (int i = 0; i < Octants::lanes; ++i) out[i] = double(mask >> i & 1);
}

std::uint32_t gather(const Row& row) {
    std::uint32_t mask = 0, bit = 1;
    for (const double value : row) {
        if (value != 0) mask |= bit;
        bit <<= 1;
    }
    return mask;
}

}  // namespace

Octants::Octants(const Filling& filling) : filling_(&filling) {
    if (!filling.empty()) patches_.push_back({std::uint32_t(filling.nodes_.size() - 1), none, 1});
}

void Octants::narrow(const Octants& from, int lane, const Cubes& cubes, double tolerance, double detail) {
    tolerance_ = tolerance;
    detail_ = detail;
    start(from, lane, cubes);
    constexpr Mask all = (1u << lanes) - 1;
    place_.assign(from.triangles_.size(), none);
    const auto place = [&](std::uint32_t up) { return up == none ? none : place_[up]; };
    for (std::size_t i = 0; i < from.triangles_.size(); ++i)
        if (from.triangles_[i].mask >> lane & 1)
            place_[i] = triangle(from.triangles_[i].node, place(from.triangles_[i].up), all);
    for (const Part& part : from.patches_)
        if (part.mask >> lane & 1) patch(part.node, place(part.up), all);
    finish();
}

/// The quadratic function of a lane, about the new centres.
void Octants::start(const Octants& from, int lane, const Cubes& cubes) {
    cubes_ = cubes;
    radius_ = std::numbers::sqrt3 * cubes.half * outward;
    all_ = {};
    const Expansion& f = from.far_;
    const double error = f.error[lane] + from.rounding(lane);
    errors_ = from.errors_;
    if (from.radius_ > 0) errors_.push_back(from.own_error(lane));
    own_ = {};
    for (int i = 0; i < lanes; ++i) {
        const Vec3 b{cubes.x[i] - from.cubes_.x[lane], cubes.y[i] - from.cubes_.y[lane],
                     cubes.z[i] - from.cubes_.z[lane]};
        const double xx = f.hessian[0][lane], yy = f.hessian[1][lane], zz = f.hessian[2][lane],
                     xy = f.hessian[3][lane], xz = f.hessian[4][lane], yz = f.hessian[5][lane];
        const Vec3 g{f.gradient[0][lane], f.gradient[1][lane], f.gradient[2][lane]};
        const Vec3 hb{xx * b.x + xy * b.y + xz * b.z, xy * b.x + yy * b.y + yz * b.z,
                      xz * b.x + yz * b.y + zz * b.z};
        far_.value[i] = f.value[lane] + dot(g + 0.5 * hb, b);
        for (int axis = 0; axis < 3; ++axis) far_.gradient[axis][i] = g[axis] + hb[axis];
        for (int k = 0; k < 6; ++k) far_.hessian[k][i] = f.hessian[k][lane];
        far_.error[i] = error;
        whole_[i] = doubtful_[i] = 0;
    }
    far_angles_ = {};
    angles_ = {};
    count_ = 0;
    clear_ = (1u << lanes) - 1;
    triangles_.clear();
    patches_.clear();
    vertices_.clear();
    sights_.clear();
    chords_.clear();
}

std::uint32_t Octants::add_vertex(const Vec3& v) {
    vertices_.push_back(v);
    see(v, sights_.emplace_back());
    return std::uint32_t(vertices_.size() - 1);
}

std::uint32_t Octants::add_chord(std::uint32_t a, std::uint32_t b) {
    Chord& chord = chords_.emplace_back();
    chord.a = a;
    chord.b = b;
    measure(vertices_[b] - vertices_[a], sights_[a], sights_[b], chord);
    return std::uint32_t(chords_.size() - 1);
}

/// A triangle of F, and the place of the one at its chord, should that be known here.
/// \return its place
std::uint32_t Octants::triangle(std::uint32_t index, std::uint32_t up, Mask mask) {
    const Filling::Node& node = filling_->nodes_[index];
    const std::vector<Vec3>& vertices = filling_->surface_.vertices;
    Near t{{index, up, mask}, {}, {none, none, none}};
    const bool loop = node.ends[0] == node.ends[1];  // its triangle has no area
    if (up != none) {
        const Near& above = triangles_[up];
        const int side = filling_->nodes_[above.node].left == index ? 0 : 1;
        t.corner[0] = above.corner[side];
        t.corner[2] = above.corner[side + 1];
        t.chord[0] = above.chord[side + 1];
        t.turned = side == 1 && above.corner[0] == above.corner[2];
    } else {
        t.corner[0] = add_vertex(vertices[node.ends[0]]);
        t.corner[2] = loop ? t.corner[0] : add_vertex(vertices[node.ends[1]]);
        if (!loop) t.chord[0] = add_chord(t.corner[0], t.corner[2]);
    }
    t.corner[1] = add_vertex(vertices[node.middle]);
    t.chord[1] = add_chord(t.corner[0], t.corner[1]);
    t.chord[2] = loop ? t.chord[1] : add_chord(t.corner[1], t.corner[2]);

    Row member, meets = {}, far, near;
    spread(mask, member);
    if (!loop) {
        meet(t, meets);
        clear_ &= ~(gather(meets) & mask);
    }
    classify(t, meets, member, far);
    for (int i = 0; i < lanes; ++i) near[i] = member[i] - far[i];
    t.mask = gather(near);
    if (!loop) {
        add_angles(t, far, near);
        weigh(chords_[t.chord[0]], t.turned ? 1 : -1, far, near);
        weigh(chords_[t.chord[1]], 1, far, near);
        weigh(chords_[t.chord[2]], 1, far, near);
    }
    triangles_.push_back(t);
    return std::uint32_t(triangles_.size() - 1);
}

void Octants::patch(std::uint32_t index, std::uint32_t up, Mask mask) {
    const Filling::Node& node = filling_->nodes_[index];
    if (node.left == none) return;  // an edge: no triangle is at that side
    Row length, scale, error;
    distances(node.centre, length);
    far_errors(node, length, scale, error);
    Mask far = 0;
    for (int i = 0; i < lanes; ++i) far |= Mask(error[i] < tolerance_) << i;
    far &= mask;
    if (far != 0) {
        add_far(node, length, far, far_);
        add_errors(node, scale, error, far);
    }
    mask &= ~far;
    if (mask == 0) return;
    if (node.radius < detail_) {
        patches_.push_back({index, up, mask});
        Mask apart = 0;
        for (int i = 0; i < lanes; ++i) apart |= Mask(error[i] < infinity) << i;
        add_far(node, length, mask & apart, all_);
        for (int i = 0; i < lanes; ++i) whole_[i] += (mask >> i & 1) != 0 ? error[i] : 0.0;
        return;
    }
    const std::uint32_t own = node.middle == none ? none : triangle(index, up, mask);
    patch(node.left, own, mask);
    patch(node.right, own, mask);
}

void Octants::finish() {
    for (const Chord& chord : chords_) {
        bool any = false;
        for (int i = 0; i < lanes; ++i) any = any || chord.far[i] != 0 || chord.near[i] != 0;
        if (any) expand(chord);
    }
    for (int i = 0; i < lanes && count_ > 0; ++i) {
        far_.value[i] += far_angles_.sum(i) / (2 * std::numbers::pi);
        far_.error[i] += far_angles_.error(i, count_) / (2 * std::numbers::pi);
    }
    for (int i = 0; i < lanes; ++i) {
        all_.value[i] += far_.value[i];
        for (int k = 0; k < 3; ++k) all_.gradient[k][i] += far_.gradient[k][i];
        for (int k = 0; k < 6; ++k) all_.hessian[k][i] += far_.hessian[k][i];
    }
}

ITS_CLONES void Octants::see(const Vec3& v, Sights& out) const {
    for (int i = 0; i < lanes; ++i) {
        const double x = v.x - cubes_.x[i], y = v.y - cubes_.y[i], z = v.z - cubes_.z[i];
        out.x[i] = x;
        out.y[i] = y;
        out.z[i] = z;
        out.length[i] = std::sqrt(x * x + y * y + z * z);
    }
}

ITS_CLONES void Octants::distances(const Vec3& centre, Row& out) const {
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const double x = centre.x - cubes_.x[i], y = centre.y - cubes_.y[i], z = centre.z - cubes_.z[i];
        out[i] = std::sqrt(x * x + y * y + z * z);
    }
}

/// By Biot and Savart the gradient of a winding number is (1/4π) ∫ K(x − p) × dx along its boundary,
/// K(y) = y/|y|³. Its change over a ball has a Taylor series of which term k is at most Rᵏ⁺¹ ∫ ds/|x|ᵏ⁺², since
/// that of K is at most (k + 1)Rᵏ/|x|ᵏ⁺². From k = 0 on they add up to R min(length/m, π)/(m − R), m the edge's
/// distance; from k = 2 on to R³ min(length/m, π/2)/(m²(m − R)).
ITS_CLONES void Octants::measure(const Vec3& d, const Sights& a, const Sights& b, Chord& chord) const {
    const double squared = dot(d, d), inverse = squared > 0 ? 1 / squared : 0.0;
    const double length = std::sqrt(squared) * outward, radius = radius_;
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const double along = -(a.x[i] * d.x + a.y[i] * d.y + a.z[i] * d.z) * inverse;
        const double t = along > 0 ? (along < 1 ? along : 1.0) : 0.0;
        const double x = a.x[i] + t * d.x, y = a.y[i] + t * d.y, z = a.z[i] + t * d.z;
        const double product = a.length[i] * b.length[i];
        const double distance =
            std::sqrt(x * x + y * y + z * z) * inward - 8 * unit_roundoff * (a.length[i] + b.length[i]);
        const double sum = product + (a.x[i] * b.x[i] + a.y[i] * b.y[i] + a.z[i] * b.z[i]);
        const double m = distance > radius ? distance : 2 * radius;
        const double over = radius / (m - radius) * (outward / whole_sphere), span = length / m,
                     ratio = radius / m;
        const double slope = over * (span < std::numbers::pi ? span : std::numbers::pi);
        const double rest = over * ratio * ratio * (span < std::numbers::pi / 2 ? span : std::numbers::pi / 2);
        chord.slope[i] = distance > radius ? slope : infinity;
        const double remainder = sum > most_obtuse * product ? rest + edge_rounding : infinity;
        chord.remainder[i] = distance > radius ? remainder : infinity;
        chord.far[i] = chord.near[i] = 0;
    }
}

/// Whether a triangle may meet the balls: its plane does, and a side or, if none does, the centre's projection
/// is in it. *Rounding:* a component of n is a difference of products of coordinates of b − a and c − a, so
/// that n errs by less than 16u|b − a||c − a|, which for slivers is much beside |n|; products with n and with n
/// × side by that times the other factors, and by some more u. 64u covers all.
ITS_CLONES void Octants::meet(const Near& t, Row& out) const {
    const Vec3 p = vertices_[t.corner[0]], q = vertices_[t.corner[1]], r = vertices_[t.corner[2]];
    const Vec3 pq = q - p, qr = r - q, rp = p - r, n = cross(pq, r - p);
    const Vec3 u = cross(n, pq), v = cross(n, qr), w = cross(n, rp);
    const Sights &a = sights_[t.corner[0]], &b = sights_[t.corner[1]], &c = sights_[t.corner[2]];
    const Row &base = chords_[t.chord[0]].slope, &left = chords_[t.chord[1]].slope,
              &right = chords_[t.chord[2]].slope;
    const double ball = radius_, size = std::sqrt(dot(n, n)) * ball;
    const double slack = 64 * unit_roundoff * norm(pq) * norm(rp);
    const double reach = ball + std::max(norm(pq), norm(rp)) * outward;  // else it is far away, even if n is 0
    const double su = slack * norm(pq), sv = slack * norm(qr), sw = slack * norm(rp);
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const double height = a.x[i] * n.x + a.y[i] * n.y + a.z[i] * n.z;
        const double pu = a.x[i] * u.x + a.y[i] * u.y + a.z[i] * u.z,
                     pv = b.x[i] * v.x + b.y[i] * v.y + b.z[i] * v.z,
                     pw = c.x[i] * w.x + c.y[i] * w.y + c.z[i] * w.z;
        const double in_u = pu <= su * a.length[i] ? 1.0 : 0.0, in_v = pv <= sv * b.length[i] ? in_u : 0.0,
                     inside = pw <= sw * c.length[i] ? in_v : 0.0;
        const double sides = base[i] + left[i] + right[i];
        const double touched = sides < infinity ? inside : 1.0;
        const double crossed = std::abs(height) <= size + slack * (a.length[i] + ball) ? touched : 0.0;
        out[i] = a.length[i] <= reach ? crossed : 0.0;
    }
}

/// A triangle is far from a cube that it does not meet if its three sides are.
ITS_CLONES void Octants::classify(const Near& t, const Row& meets, const Row& member, Row& far) const {
    const Row& base = chords_[t.chord[t.chord[0] == none ? 1 : 0]].remainder;  // a loop's triangle: no matter
    const Row &left = chords_[t.chord[1]].remainder, &right = chords_[t.chord[2]].remainder;
    const double tolerance = tolerance_;
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const double error = base[i] + left[i] + right[i];
        const double away = meets[i] != 0 ? 0.0 : member[i];
        far[i] = error < tolerance ? away : 0.0;
    }
}

ITS_CLONES void Octants::add_angles(const Near& t, const Row& far, const Row& near) {
    const Sights &a = sights_[t.corner[0]], &b = sights_[t.corner[1]], &c = sights_[t.corner[2]];
    ++count_;
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const SolidAngle s =
            half_solid_angle({a.x[i], a.y[i], a.z[i], a.length[i]}, {b.x[i], b.y[i], b.z[i], b.length[i]},
                             {c.x[i], c.y[i], c.z[i], c.length[i]});
        const bool f = far[i] != 0, n = near[i] != 0;
        far_angles_.add(i, f ? s.re : 1.0, f ? s.im : 0.0, f ? s.error : 0.0);
        angles_.add(i, n ? s.re : 1.0, n ? s.im : 0.0, n ? s.error : 0.0);
        doubtful_[i] += n || f ? s.doubtful : 0.0;
    }
}

ITS_CLONES void Octants::weigh(Chord& chord, double sign, const Row& far, const Row& near) {
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        chord.far[i] += sign * far[i];
        chord.near[i] += sign * near[i];
    }
}

/// For a segment the integral is g = f a × b, f = (|a| + |b|)/(|a||b|(|a||b| + a·b)); its derivative follows
/// from ∇f = f (a/|a|² + b/|b|² + (a/|a| + b/|b|) ((|a| + |b|)/(|a||b| + a·b) − 1/(|a| + |b|))). That of a × b
/// is antisymmetric, which cancels along closed boundaries. *Rounding:* with q = |a||b|/(|a||b| + a·b) all
/// relative errors are below 64u·q of terms of at most 4/m for g and 8/m² for its derivative: less than 2⁻³⁰
/// R/m for q < 2¹².
ITS_CLONES void Octants::expand(const Chord& chord) {
    const Sights &a = sights_[chord.a], &b = sights_[chord.b];
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const double ax = a.x[i], ay = a.y[i], az = a.z[i], bx = b.x[i], by = b.y[i], bz = b.z[i];
        const double la = a.length[i], lb = b.length[i], product = la * lb, sizes = la + lb;
        const double sum = product + (ax * bx + ay * by + az * bz);
        const bool good = chord.remainder[i] < infinity;
        const double inverse = 1 / (good ? product * sum : 1.0);
        const double f = sizes * inverse / whole_sphere;
        const double nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
        const double ia = lb * sum * inverse, ib = la * sum * inverse;  // 1/|a|, 1/|b|
        const double both = sizes * product * inverse - 1 / (good ? sizes : 1.0);
        const double ca = f * (ia + both) * ia, cb = f * (ib + both) * ib;
        const double sx = ca * ax + cb * bx, sy = ca * ay + cb * by, sz = ca * az + cb * bz;
        const double far = chord.far[i], near = chord.near[i];
        const bool tangent = chord.remainder[i] < chord.slope[i];
        const double wf = far, wn = tangent ? near : 0.0;
        own_.cubic[i] += far != 0 ? chord.remainder[i] * std::abs(far) : 0.0;
        far_.error[i] += edge_rounding * std::abs(far);
        const double bend = tangent ? chord.remainder[i] : chord.slope[i];
        all_.error[i] += near != 0 ? bend * std::abs(near) : 0.0;
        const double g[3] = {f * nx, f * ny, f * nz};
        const double h[6] = {nx * sx,
                             ny * sy,
                             nz * sz,
                             0.5 * (nx * sy + ny * sx),
                             0.5 * (nx * sz + nz * sx),
                             0.5 * (ny * sz + nz * sy)};
        for (int k = 0; k < 3; ++k) {
            far_.gradient[k][i] += wf * g[k];
            all_.gradient[k][i] += wn * g[k];
        }
        for (int k = 0; k < 6; ++k) {
            far_.hessian[k][i] += wf * h[k];
            all_.hessian[k][i] += wn * h[k];
        }
    }
}

/// Of patches, for all points of the balls; infinite where they are too near.
ITS_CLONES void Octants::far_errors(const Filling::Node& node, const Row& length, Row& scale, Row& out) const {
    const double ball = radius_, reach = filling_->reach_, area = node.area;
    const double cubes =
        (node.radius + 3 * ball) * node.square + ball * ball * (3 * node.linear + ball * node.area);
    const double most = ball + node.radius, least = ball + (1 + least_gap) * node.radius;
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const PatchError e = patch_error(length[i] > least ? length[i] : 2 * least + 1, most, area, reach);
        scale[i] = e.scale;
        out[i] = length[i] > least ? e.scale * cubes + e.rounding : infinity;
    }
}

/// The bound ∫ (|a| + |b|)³ as a cubic polynomial in |b|/R.
ITS_CLONES void Octants::add_errors(const Filling::Node& node, const Row& scale, const Row& error, Mask mask) {
    const double r = radius_, c0 = node.radius * node.square, c1 = 3 * r * node.square,
                 c2 = 3 * r * r * node.linear, c3 = r * r * r * node.area, cubes = c0 + c1 + c2 + c3;
    Row member;
    spread(mask, member);
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const double s = member[i] != 0 ? scale[i] : 0.0;
        own_.constant[i] += member[i] != 0 ? error[i] - scale[i] * cubes * inward : 0.0;  // rounding
        own_.constant[i] += c0 * s;
        own_.linear[i] += c1 * s;
        own_.quadratic[i] += c2 * s;
        own_.cubic[i] += c3 * s;
    }
}

/// K's derivatives at r are A = 1/|r|³ − 3rrᵀ/|r|⁵ and B = 15rrr/|r|⁷ − 3(δr + rδ + …)/|r|⁵. Up to order two
/// ∫ n·K(r + a − b) is N·K + first:A + ½ second:B − (AN + B:first)·b + ½ b·(BN)b.
ITS_CLONES void Octants::add_far(const Filling::Node& node, const Row& length, Mask mask, Expansion& to) const {
    const Vec3 c = node.centre, n = node.moment;
    const auto first = node.first;
    const auto f = node.second;
    Row counts;
    spread(mask, counts);
    const double trace = first[0].x + first[1].y + first[2].z;
    const Vec3 laplacian{3 * f[0] + f[5] + f[7], 3 * f[1] + f[3] + f[8], 3 * f[2] + f[4] + f[6]};  // half of it
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        const double rx = c.x - cubes_.x[i], ry = c.y - cubes_.y[i], rz = c.z - cubes_.z[i];
        const double inverse = counts[i] / (counts[i] != 0 ? length[i] : 1.0), inverse2 = inverse * inverse;
        const double i3 = inverse * inverse2 / whole_sphere, i5 = i3 * inverse2, i7 = i5 * inverse2;
        const double normal = n.x * rx + n.y * ry + n.z * rz;
        const double tx = first[0].x * rx + first[1].x * ry + first[2].x * rz,
                     ty = first[0].y * rx + first[1].y * ry + first[2].y * rz,
                     tz = first[0].z * rx + first[1].z * ry + first[2].z * rz;
        const double form = tx * rx + ty * ry + tz * rz;
        const double xx = rx * rx, yy = ry * ry, zz = rz * rz;
        const double cubic = rx * (f[0] * xx + f[5] * yy + f[7] * zz + f[9] * (ry * rz)) +
                             ry * (f[3] * xx + f[1] * yy + f[8] * zz) +
                             rz * (f[4] * xx + f[6] * yy + f[2] * zz);
        to.value[i] += (normal + trace) * i3 -
                       (3 * form + 1.5 * (laplacian.x * rx + laplacian.y * ry + laplacian.z * rz)) * i5 +
                       7.5 * cubic * i7;
        const double along = 3 * (normal + trace) * i5 - 15 * form * i7;
        to.gradient[0][i] += along * rx - i3 * n.x + 6 * i5 * tx;
        to.gradient[1][i] += along * ry - i3 * n.y + 6 * i5 * ty;
        to.gradient[2][i] += along * rz - i3 * n.z + 6 * i5 * tz;
        const double whole = 15 * normal * i7, part = 3 * i5, diagonal = part * normal;
        to.hessian[0][i] += whole * xx - 2 * part * n.x * rx - diagonal;
        to.hessian[1][i] += whole * yy - 2 * part * n.y * ry - diagonal;
        to.hessian[2][i] += whole * zz - 2 * part * n.z * rz - diagonal;
        to.hessian[3][i] += whole * (rx * ry) - part * (n.x * ry + n.y * rx);
        to.hessian[4][i] += whole * (rx * rz) - part * (n.x * rz + n.z * rx);
        to.hessian[5][i] += whole * (ry * rz) - part * (n.y * rz + n.z * ry);
    }
}

/// Bounds on |gradient·b| and |b·hessian b| in the cube.
double Octants::linear(const Expansion& e, int lane) const {
    double sum = 0;
    for (const Row& g : e.gradient) sum += std::abs(g[lane]);
    return sum * cubes_.half;
}
double Octants::bend(const Expansion& e, int lane) const {
    double sum = 0;
    for (int k = 0; k < 6; ++k) sum += (k < 3 ? 1 : 2) * std::abs(e.hessian[k][lane]);
    return sum * cubes_.half * cubes_.half;
}

double Octants::rounding(int lane) const {
    return 32 * unit_roundoff * (std::abs(far_.value[lane]) + linear(far_, lane) + bend(far_, lane));
}

Octants::Error Octants::own_error(int lane) const {
    return {{cubes_.x[lane], cubes_.y[lane], cubes_.z[lane]},
            1 / radius_,
            {own_.constant[lane], own_.linear[lane], own_.quadratic[lane], own_.cubic[lane]}};
}

namespace {

ITS_INLINE double polynomial(const double (&c)[4], double s) {
    return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
}

}  // namespace

/// Of what is far, at points up to `radius` from the lane's centre.
double Octants::far_error(int lane, double radius) const {
    const Vec3 centre{cubes_.x[lane], cubes_.y[lane], cubes_.z[lane]};
    double sum = far_.error[lane] + rounding(lane) + polynomial(own_error(lane).coefficient, radius / radius_);
    for (const Error& e : errors_)
        sum += polynomial(e.coefficient, (norm(centre - e.centre) + radius) * e.inverse);
    return sum * outward;
}

WindingEstimate Octants::at_centre(int lane) const {
    return {all_.value[lane] + angles_.sum(lane) / (2 * std::numbers::pi),
            far_error(lane, 0) + whole_[lane] + doubtful_[lane] +
                angles_.error(lane, count_) / (2 * std::numbers::pi)};
}

/// What is far, and what patches left whole add, is within its error of a quadratic function, at the centre as
/// elsewhere; what is near within its sides' remainders, which are 0 at the centre.
double Octants::variation(int lane) const {
    return (linear(all_, lane) + 0.5 * bend(all_, lane) + far_error(lane, 0) + far_error(lane, radius_) +
            2 * whole_[lane] + all_.error[lane]) *
           outward;
}

/// What is far is within far_error() of its function, patches left whole within theirs; near triangles are
/// exact at the centre and within their sides' remainders elsewhere.
Octants::Quadratic Octants::quadratic(int lane) const {
    Quadratic q;
    q.value = at_centre(lane).value;
    for (int k = 0; k < 3; ++k) q.gradient[k] = all_.gradient[k][lane];
    for (int k = 0; k < 6; ++k) q.hessian[k] = all_.hessian[k][lane];
    q.error = (far_error(lane, radius_) + whole_[lane] + all_.error[lane] + doubtful_[lane] +
               angles_.error(lane, count_) / (2 * std::numbers::pi) +
               32 * unit_roundoff * (std::abs(q.value) + linear(all_, lane) + bend(all_, lane))) *
              outward;
    return q;
}

ITS_CLONES void Octants::see(const Vec3& v, const Points& points, Seen& out) {
    for (int i = 0; i < block; ++i) {
        const double x = v.x - points.x[i], y = v.y - points.y[i], z = v.z - points.z[i];
        out.x[i] = x;
        out.y[i] = y;
        out.z[i] = z;
        out.length[i] = std::sqrt(x * x + y * y + z * z);
    }
}

ITS_CLONES void Octants::add(const Seen& a, const Seen& b, const Seen& c, AngleSums<block>& sums,
                             double* doubtful) {
    ITS_INDEPENDENT
    for (int i = 0; i < block; ++i)
        doubtful[i] +=
            add_half_solid_angle(sums, i, {a.x[i], a.y[i], a.z[i], a.length[i]},
                                 {b.x[i], b.y[i], b.z[i], b.length[i]}, {c.x[i], c.y[i], c.z[i], c.length[i]});
}

/// Sums of what is far.
ITS_CLONES void Octants::far_values(int lane, const Points& points, double* value) const {
    const Expansion& f = far_;
    const double v = f.value[lane], gx = f.gradient[0][lane], gy = f.gradient[1][lane],
                 gz = f.gradient[2][lane];
    const double xx = 0.5 * f.hessian[0][lane], yy = 0.5 * f.hessian[1][lane], zz = 0.5 * f.hessian[2][lane],
                 xy = f.hessian[3][lane], xz = f.hessian[4][lane], yz = f.hessian[5][lane];
    for (int i = 0; i < block; ++i) {
        const double x = points.x[i] - cubes_.x[lane], y = points.y[i] - cubes_.y[lane],
                     z = points.z[i] - cubes_.z[lane];
        value[i] = v + (gx + xx * x + xy * y + xz * z) * x + (gy + yy * y + yz * z) * y + (gz + zz * z) * z;
    }
}

ITS_CLONES void Octants::add_sums(const AngleSums<block>& sums, double* value) {
    ITS_INDEPENDENT
    for (int i = 0; i < block; ++i) value[i] += sums.quick_sum(i) * (0.5 / std::numbers::pi);
}

ITS_CLONES void Octants::add_error(const Error& e, const Points& points, double* error) {
    ITS_INDEPENDENT
    for (int i = 0; i < block; ++i) {
        const double x = points.x[i] - e.centre.x, y = points.y[i] - e.centre.y, z = points.z[i] - e.centre.z;
        error[i] += polynomial(e.coefficient, std::sqrt(x * x + y * y + z * z) * e.inverse) * outward;
    }
}

void Octants::at(int lane, const Points& points, Estimates& out) {
    AngleSums<block> sums;
    double doubtful[block] = {}, count = 0;
    place_.assign(vertices_.size(), none);
    std::size_t used = 0;
    seen_.resize(std::max(seen_.size(), vertices_.size()));
    for (const Near& t : triangles_) {
        if ((t.mask >> lane & 1) == 0 || t.corner[0] == t.corner[2]) continue;
        for (const std::uint32_t v : t.corner) {
            if (place_[v] != none) continue;
            place_[v] = std::uint32_t(used++);
            see(vertices_[v], points, seen_[place_[v]]);
        }
        add(seen_[place_[t.corner[0]]], seen_[place_[t.corner[1]]], seen_[place_[t.corner[2]]], sums, doubtful);
        ++count;
    }
    far_values(lane, points, out.value);
    if (count > 0) add_sums(sums, out.value);
    for (int i = 0; i < block; ++i)
        out.error[i] = far_.error[lane] + rounding(lane) + quick_error / (2 * std::numbers::pi);
    for (const Error& e : errors_) add_error(e, points, out.error);
    add_error(own_error(lane), points, out.error);
    for (int i = 0; i < block; ++i) out.error[i] += doubtful[i] + sums.error(i, count) / (2 * std::numbers::pi);
}

}  // namespace its::winding
