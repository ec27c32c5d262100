#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/bernstein.h"

/// Branch and bound of f over the triangles of a surface.
namespace its::surface {

/// f on a surface, in cell widths: all values lie in [lower, upper].
struct SurfaceRange {
    double lower, upper;
};

/// Which ends of a range matter; the other end of a result then means nothing.
enum class RangeEnds { both, lower, upper };

/// The gap that subdivision leaves between a bound and what is attained, in cell widths.
inline constexpr double surface_gap = 0x1p-13;

/// Bounds what is included, and subdivides only what may exceed the extremes attained so far.
class Hull {
public:
    /// \param level  taken to be attained
    Hull(double level, RangeEnds ends)
        : level_(level), least_(level), most_(level), lower_(level), upper_(level), ends_(ends) {}

    SurfaceRange range() const { return {lower_, upper_}; }

    /// Adds bounds known beforehand if they cannot be the extreme ones; else returns false.
    bool include_if_within(double lower, double upper) {
        const geometry::Bounds b = masked({lower, upper, level_, level_});
        if (open(b)) return false;
        settle(b);
        return true;
    }

    /// Adds bounds known beforehand.
    void include_bounds(double lower, double upper) { settle(masked({lower, upper, level_, level_})); }

    /// Adds the function with these corner values on triangle pqr, in local coordinates.
    void include(const double* corners, const geometry::Sample& p, const geometry::Sample& q,
                 const geometry::Sample& r, int halvings = 0) {
        const geometry::Bounds b = masked(geometry::bernstein_bounds(corners, p, q, r));
        least_ = std::min(least_, b.least);
        most_ = std::max(most_, b.most);
        if (!open(b) || halvings == max_halvings) return settle(b);
        const geometry::Sample pq = geometry::sample(corners, 0.5 * (p.at + q.at)),
                               qr = geometry::sample(corners, 0.5 * (q.at + r.at)),
                               rp = geometry::sample(corners, 0.5 * (r.at + p.at));
        include(corners, p, pq, rp, halvings + 1);
        include(corners, pq, q, qr, halvings + 1);
        include(corners, rp, qr, r, halvings + 1);
        include(corners, pq, qr, rp, halvings + 1);
    }

    /// A halving divides the gap by four: 12 of them leave far less than surface_gap of any there can be.
    static constexpr int max_halvings = 12;

private:
    geometry::Bounds masked(geometry::Bounds b) const {
        if (ends_ == RangeEnds::upper) b.lower = b.least = level_;
        if (ends_ == RangeEnds::lower) b.upper = b.most = level_;
        return b;
    }
    bool open(const geometry::Bounds& b) const {
        return b.lower < least_ - surface_gap || b.upper > most_ + surface_gap;
    }
    void settle(const geometry::Bounds& b) {
        lower_ = std::min(lower_, b.lower);
        upper_ = std::max(upper_, b.upper);
    }

    double level_, least_, most_, lower_, upper_;
    RangeEnds ends_;
};

/// Steepest slope along an edge of the unit cell.
inline double steepest(const double* v) {
    double slope = 0;
    for (int c = 0; c < 8; ++c)
        for (const int step : {1, 2, 4})
            if (!(c & step)) slope = std::max(slope, std::abs(v[c | step] - v[c]));
    return slope;
}

/// How far the function can be from its linear interpolation over points of the cell, at most. In coordinates
/// from the cell's centre f = a + linear + Σ β yz + τ xyz; over points p = Σ λᵢpᵢ the mean of yz and the
/// product of the means of y and z differ by at most 1/4 (a covariance), those of xyz by at most 1/8 + 1/8.
inline double curvature(const double* v) {
    const double xy = (v[0] - v[1] - v[2] + v[3]) + (v[4] - v[5] - v[6] + v[7]);
    const double xz = (v[0] - v[1] - v[4] + v[5]) + (v[2] - v[3] - v[6] + v[7]);
    const double yz = (v[0] - v[2] - v[4] + v[6]) + (v[1] - v[3] - v[5] + v[7]);
    const double xyz = (v[7] - v[6] - v[5] + v[4]) - (v[3] - v[2] - v[1] + v[0]);
    return 0.25 * (0.5 * (std::abs(xy) + std::abs(xz) + std::abs(yz)) + std::abs(xyz));
}

}  // namespace its::surface
