#include "adaptive/fit.h"

#include <algorithm>
#include <limits>

#include "base/rounding.h"

namespace its::adaptive {

namespace {

constexpr int most_halvings = 10;  // of an edge; the hull's excess falls by four each time
constexpr double infinity = std::numeric_limits<double>::infinity();

ITS_INLINE double smaller(double a, double b) {
    return b < a ? b : a;
}
ITS_INLINE double larger(double a, double b) {
    return a < b ? b : a;
}

}  // namespace

Fit::Fit(const octree::Lattice& lattice, std::span<const Vec3> positions, std::span<const Triangle> triangles)
    : positions_(positions), triangles_(triangles) {
    margin_ = lattice.dilation() + geometry::clipping_error(lattice.cells());
}

bool Fit::within(const Cube& cell, const double (&value)[8], std::span<const std::uint32_t> list, double lower,
                 double upper) {
    const auto [least, most] = std::minmax_element(value, value + 8);
    if (list.empty() || (*least >= lower && *most <= upper)) return true;
    if (*least > upper || *most < lower) return false;
    const double scale = 1 / cell.width;  // a power of two
    geometry::Polygon polygon;
    unsettled_.clear();
    for (const std::uint32_t number : list) {
        const Triangle& t = triangles_[number];
        const Corners corners{scale * (positions_[t[0]] - cell.corner),
                              scale * (positions_[t[1]] - cell.corner),
                              scale * (positions_[t[2]] - cell.corner)};
        const Look look = look_at(value, corners, scale * margin_, lower, upper);
        if (look == Look::outside) return false;
        if (look == Look::unknown) unsettled_.push_back(corners);
    }
    batch_.size = 0;
    for (const Corners& corners : unsettled_) {
        geometry::clip_to_cell(corners.a, corners.b, corners.c, scale * margin_, polygon);
        if (polygon.size == 0) continue;
        const Vec3 apex = polygon.vertex(0);
        Vec3 last = polygon.vertex(std::min(1, polygon.size - 1));
        for (int i = std::min(2, polygon.size - 1); i < polygon.size; ++i) {  // a point or a segment gives one
            const Vec3 next = polygon.vertex(i);
            batch_.add(value, apex, last, next, 0);
            last = next;
            if (batch_.full() && !batch_within(value, lower, upper)) return false;
        }
    }
    return batch_within(value, lower, upper);
}

/// What is cheap to see: f at corners in the cell, and, since f on a box is a mean of its values at the box's
/// corners, in the triangle's box.
ITS_INLINE Fit::Look Fit::look_at(const double* value, const Corners& t, double margin, double lower,
                                  double upper) {
    double low[3], high[3];
    bool inside[3] = {true, true, true};
    for (int axis = 0; axis < 3; ++axis) {
        const double a = t.a[axis], b = t.b[axis], c = t.c[axis];
        const double least = smaller(smaller(a, b), c), most = larger(larger(a, b), c);
        low[axis] = larger(least, -margin);
        high[axis] = smaller(most, 1 + margin);
        inside[0] &= (a >= 0) & (a <= 1);
        inside[1] &= (b >= 0) & (b <= 1);
        inside[2] &= (c >= 0) & (c <= 1);
    }
    for (int i = 0; i < 3; ++i) {
        if (!inside[i]) continue;
        const double f = geometry::trilinear(value, i == 0 ? t.a : i == 1 ? t.b : t.c);
        if (f < lower || f > upper) return Look::outside;
    }
    const auto mix = geometry::lerp_exact_at_zero;
    double x[2][4], least = infinity, most = -infinity;
    for (int end = 0; end < 2; ++end)
        for (int i = 0; i < 4; ++i)
            x[end][i] = mix(value[2 * i], value[2 * i + 1], end == 0 ? low[0] : high[0]);
    for (const double(&v)[4] : x)
        for (int y = 0; y < 2; ++y) {
            const double at = y == 0 ? low[1] : high[1];
            const double z0 = mix(v[0], v[1], at), z1 = mix(v[2], v[3], at);
            const double p = mix(z0, z1, low[2]), q = mix(z0, z1, high[2]);
            least = smaller(least, smaller(p, q));
            most = larger(most, larger(p, q));
        }
    return least >= lower && most <= upper ? Look::within : Look::unknown;
}

/// All triangles of the batch, which is empty then.
bool Fit::batch_within(const double* value, double lower, double upper) {
    geometry::bound(batch_);
    const int size = std::exchange(batch_.size, 0);
    for (int i = 0; i < size; ++i)
        if (batch_.least[i] < lower || batch_.most[i] > upper) return false;
    for (int i = 0; i < size; ++i)
        if ((batch_.lower[i] < lower || batch_.upper[i] > upper) &&
            !piece_within(value, batch_.vertex(batch_.p, i), batch_.vertex(batch_.q, i),
                          batch_.vertex(batch_.r, i), lower, upper))
            return false;
    return true;
}

/// One triangle, halved until its bounds tell.
bool Fit::piece_within(const double* value, const Vec3& a, const Vec3& b, const Vec3& c, double lower,
                       double upper) {
    const auto at = [&](const Vec3& p) { return geometry::sample(value, p); };
    pieces_.clear();
    pieces_.push_back({at(a), at(b), at(c), 0});
    while (!pieces_.empty()) {
        const Piece t = pieces_.back();
        pieces_.pop_back();
        const geometry::Bounds bounds = geometry::bernstein_bounds(value, t.p, t.q, t.r);
        if (bounds.least < lower || bounds.most > upper) return false;
        if (bounds.lower >= lower && bounds.upper <= upper) continue;
        if (t.halvings == most_halvings) return false;
        const geometry::Sample pq = at(0.5 * (t.p.at + t.q.at)), qr = at(0.5 * (t.q.at + t.r.at)),
                               rp = at(0.5 * (t.r.at + t.p.at));
        const int halvings = t.halvings + 1;
        pieces_.push_back({t.p, pq, rp, halvings});
        pieces_.push_back({pq, t.q, qr, halvings});
        pieces_.push_back({rp, qr, t.r, halvings});
        pieces_.push_back({pq, qr, rp, halvings});
    }
    return true;
}

}  // namespace its::adaptive
