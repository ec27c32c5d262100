#include "simplify/decimate.h"

#include <algorithm>
#include <cmath>

namespace its::simplifier {

namespace {

/// Weight of the squared distance to a vertex, relative to that of the planes around it. It breaks the ties of
/// flat regions, where all collapses cost nothing, in favour of short edges and round triangles, and makes
/// every quadric positive definite.
constexpr double point_weight = 1e-5;

/// Weight of the planes through boundary edges, upright on their triangles; relative to length².
constexpr double boundary_weight = 4;

/// No triangle's normal may turn by more than the angle with this cosine: 78°.
constexpr double least_cosine = 0.2;

constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

Decimator::Decimator(Complex& mesh, CollapseRule& rule, const Numbers& numbers)
    : mesh_(mesh), rule_(rule), numbers_(numbers) {
    Vec3 low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
    for (std::uint32_t v = 0; v < mesh_.vertices(); ++v) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], mesh_.position(v)[axis]);
            high[axis] = std::max(high[axis], mesh_.position(v)[axis]);
        }
    }
    centre_ = 0.5 * low + 0.5 * high;
    scale_ = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
    if (!(scale_ > 0)) scale_ = 1;
    stamp_.assign(mesh_.vertices(), 0);
    last_change_.assign(mesh_.vertices(), 0);
    sum_quadrics();
    for (std::uint32_t t = 0; t < mesh_.triangles(); ++t) {
        const Triangle& c = mesh_.triangle(t);
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t a = c[k], b = c[(k + 1) % 3];
            if (a == b) continue;
            // An edge of two triangles is pushed by the one with the lower number.
            bool first = true;
            mesh_.for_star(a, [&](std::uint32_t s, std::uint32_t) {
                const Triangle& o = mesh_.triangle(s);
                first &= s >= t || (o[0] != b && o[1] != b && o[2] != b);
            });
            if (first) push(a, b);
        }
    }
    std::make_heap(heap_.begin(), heap_.end());
}

void Decimator::sum_quadrics() {
    quadric_.assign(mesh_.vertices(), {});
    double total = 0;
    std::vector<double> area(mesh_.vertices(), 0);
    for (std::uint32_t t = 0; t < mesh_.triangles(); ++t) {
        const Triangle& c = mesh_.triangle(t);
        const Vec3 p = scaled(mesh_.position(c[0])), q = scaled(mesh_.position(c[1])),
                   r = scaled(mesh_.position(c[2]));
        const Vec3 normal = cross(q - p, r - p);
        const double twice = norm(normal);
        total += twice;
        if (!(twice > 0)) continue;
        const Vec3 unit = (1 / twice) * normal;
        const Quadric plane = plane_quadric(unit, p, twice);
        for (int k = 0; k < 3; ++k) {
            quadric_[c[k]] += plane;
            area[c[k]] += twice;
            const std::uint32_t a = c[k], b = c[(k + 1) % 3];
            if (mesh_.rank(a) == 0) continue;
            int others = 0;
            mesh_.for_star(a, [&](std::uint32_t s, std::uint32_t) {
                const Triangle& o = mesh_.triangle(s);
                others += s != t && (o[0] == b || o[1] == b || o[2] == b);
            });
            if (others > 0 && !mesh_.is_seam(t, std::uint32_t(k))) continue;
            const Vec3 along = scaled(mesh_.position(b)) - scaled(mesh_.position(a));
            const Vec3 upright = cross(along, unit);
            const double length = norm(upright);
            if (!(length > 0)) continue;
            const Quadric edge = plane_quadric((1 / length) * upright, scaled(mesh_.position(a)),
                                               boundary_weight * length * length);
            quadric_[a] += edge;
            quadric_[b] += edge;
        }
    }
    // In units of the mean triangle: a cost is a sum of squared distances, of the unit box.
    const double unit = total > 0 ? double(mesh_.triangles()) / total : 1.0;
    for (std::uint32_t v = 0; v < mesh_.vertices(); ++v) {
        Quadric& q = quadric_[v];
        q += point_quadric(scaled(mesh_.position(v)), point_weight * area[v]);
        q = {unit * q.xx, unit * q.xy, unit * q.xz, unit * q.yy,
             unit * q.yz, unit * q.zz, unit * q.b,  unit * q.c};
    }
}

/// Where the merged vertex goes, and the quadric error there.
double Decimator::place(std::uint32_t u, std::uint32_t v, Vec3& to) const {
    const Quadric q = quadric_[u] + quadric_[v];
    const Vec3 p = scaled(mesh_.position(u)), r = scaled(mesh_.position(v));
    // u goes, so v is the one that is held: fixed, or on the boundary where u is not.
    if (mesh_.is_fixed(v) || mesh_.rank(v) > mesh_.rank(u)) {
        to = mesh_.position(v);
        return q(r);
    }
    if (mesh_.on_seam(u)) {  // ends only: attributes are known exactly there, on both sides
        const bool at_u = q(p) < q(r) && mesh_.on_seam(v);
        to = mesh_.position(at_u ? u : v);
        return at_u ? q(p) : q(r);
    }
    const Vec3 middle = 0.5 * (p + r);
    Vec3 best = middle;
    double cost = q(middle);
    const auto consider = [&](const Vec3& x) {
        if (const double there = q(x); there < cost) cost = there, best = x;
    };
    Vec3 optimum;
    const double length = norm(r - p);
    // A minimum far away belongs to nearly parallel planes.
    if (minimum(q, optimum) && norm(optimum - middle) <= 2 * length) consider(optimum);
    consider(p);
    consider(r);
    to = best == p ? mesh_.position(u) : best == r ? mesh_.position(v) : centre_ + scale_ * best;
    to = numbers_.nearest(to);
    return cost;
}

void Decimator::push(std::uint32_t a, std::uint32_t b) {
    // u may go: it is not fixed, and not on the boundary unless v is too.
    if (mesh_.is_fixed(a) && mesh_.is_fixed(b)) return;
    std::uint32_t u = std::max(a, b), v = std::min(a, b);
    if (mesh_.rank(u) > mesh_.rank(v)) std::swap(u, v);
    Vec3 to;
    const double cost = place(u, v, to) + rule_.extra_cost(to);
    heap_.push_back({cost, u, v, stamp_[u] + stamp_[v]});
}

bool Decimator::flips(const Collapse& collapse) const {
    for (std::size_t i = 0; i < collapse.corners.size(); ++i) {
        const Triangle& t = mesh_.triangle(collapse.faces()[i]);
        const Vec3 p = mesh_.position(t[0]);
        const Vec3 before = cross(mesh_.position(t[1]) - p, mesh_.position(t[2]) - p);
        const auto& c = collapse.corners[i];
        const Vec3 after = cross(c[1] - c[0], c[2] - c[0]);
        const double length = norm(before);
        if (length > 0 && !(dot(before, after) > least_cosine * length * norm(after))) return true;
    }
    return false;
}

void Decimator::step(double tolerance) {
    std::pop_heap(heap_.begin(), heap_.end());
    const Candidate candidate = heap_.back();
    heap_.pop_back();
    if (!is_current(candidate)) return;
    const auto [cost, u, v, stamp] = candidate;
    ++tests_;
    ring_.clear();
    const std::uint32_t shared = mesh_.ring(u, v, ring_);
    if (!mesh_.can_merge(u, v, ring_, shared)) {
        refused_.push_back({candidate, collapses_, infinity});
        return;
    }
    Collapse collapse{.u = u, .v = v, .to = {}, .ring = ring_, .shared = shared, .corners = {}};
    place(u, v, collapse.to);
    corners_.clear();
    for (std::size_t i = shared; i < ring_.size(); ++i) {
        auto& c = corners_.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t w = mesh_.triangle(ring_[i])[k];
            c[k] = w == u || w == v ? collapse.to : mesh_.position(w);
        }
    }
    collapse.corners = corners_;
    if (flips(collapse)) {
        refused_.push_back({candidate, collapses_, infinity});
        return;
    }
    const CollapseRule::Verdict verdict = rule_.test(collapse, mesh_, tolerance);
    if (!verdict.allowed) {
        refused_.push_back({candidate, collapses_, verdict.need});
        return;
    }
    make(collapse);
}

void Decimator::make(const Collapse& collapse) {
    const std::uint32_t u = collapse.u, v = collapse.v;
    rule_.accept(collapse, mesh_);
    mesh_.merge(u, v, collapse.to, collapse.ring, collapse.shared);
    rule_.made(collapse, mesh_);
    quadric_[v] += quadric_[u];
    ++stamp_[v];
    ++collapses_;
    around_.clear();
    for (const std::uint32_t t : collapse.faces())
        for (const std::uint32_t w : mesh_.triangle(t)) {
            if (last_change_[w] == collapses_) continue;
            last_change_[w] = collapses_;
            if (w != v) around_.push_back(w);
        }
    for (const std::uint32_t w : around_) {
        push(w, v);
        if (heap_.size() > 1) std::push_heap(heap_.begin(), heap_.end());
    }
}

/// Puts back the refused collapses that may now be allowed. Returns whether there is anything to try.
bool Decimator::revive(double tolerance) {
    std::size_t kept = 0;
    for (const Refused& r : refused_) {
        if (!is_current(r.candidate)) continue;
        const bool changed = std::max(last_change_[r.candidate.u], last_change_[r.candidate.v]) > r.when;
        if (changed || r.need <= tolerance) {
            heap_.push_back(r.candidate);
            std::push_heap(heap_.begin(), heap_.end());
        } else {
            refused_[kept++] = r;
        }
    }
    refused_.resize(kept);
    return !heap_.empty();
}

double Decimator::next_tolerance(double tolerance) const {
    double next = infinity;
    for (const Refused& r : refused_)
        if (is_current(r.candidate) && r.need > tolerance) next = std::min(next, r.need);
    return next;
}

}  // namespace its::simplifier
