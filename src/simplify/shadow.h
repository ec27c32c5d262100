#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "simplify/frame.h"

/// What is over a triangle: other triangles, projected along its normal.
namespace its::simplifier {

/// A triangle in its own plane: (0, 0), (bx, 0), (cx, cy) drawn in towards its centroid.
struct Core {
    double x[3], y[3];
    double nx[3], ny[3], level[3];  ///< edge k from corner k: inside where nx·x + ny·y ≥ level, unit normal

    /// Every corner moves by at most `inset`.
    Core(const Frame& f, double inset) : x{0, f.bx, f.cx}, y{0, 0, f.cy}, nx{}, ny{}, level{} {
        const double gx = (x[0] + x[1] + x[2]) / 3, gy = (y[0] + y[1] + y[2]) / 3;
        for (int k = 0; k < 3; ++k) {
            const double dx = gx - x[k], dy = gy - y[k], length = std::sqrt(dx * dx + dy * dy);
            const double t = length > inset ? inset / length : 1.0;
            x[k] += t * dx;
            y[k] += t * dy;
        }
        for (int k = 0; k < 3; ++k) {
            const double dx = x[(k + 1) % 3] - x[k], dy = y[(k + 1) % 3] - y[k];
            const double length = std::sqrt(dx * dx + dy * dy);
            nx[k] = length > 0 ? -dy / length : 0;
            ny[k] = length > 0 ? dx / length : 0;
            level[k] = nx[k] * x[k] + ny[k] * y[k];
        }
    }

    /// Bit k: certainly on the outer side of edge k.
    unsigned outside(double px, double py, double margin) const {
        unsigned code = 0;
        for (int k = 0; k < 3; ++k) code |= unsigned(nx[k] * px + ny[k] * py < level[k] - margin) << k;
        return code;
    }

    /// Whether the segment certainly passes by, given that its ends share no outer side: all of the core on one
    /// side of its line.
    bool beside(double px, double py, double qx, double qy, double margin) const {
        const double dx = qx - px, dy = qy - py, length = std::sqrt(dx * dx + dy * dy);
        double low = 1e300, high = -1e300;
        for (int k = 0; k < 3; ++k) {
            const double side = dx * (y[k] - py) - dy * (x[k] - px);
            low = std::min(low, side);
            high = std::max(high, side);
        }
        return low > 2 * margin * length || high < -2 * margin * length;
    }
};

/// A triangle's corners in the frame of another: seen along its normal, with heights z over it.
struct Shadow {
    std::array<Vec3, 3> corner;

    /// 1 if it certainly covers the point, 0 if it certainly does not, −1 if rounding may decide.
    int covers(double px, double py, double margin) const;
    /// Whether no point of it that is over the core is higher or lower than `height`. A part that is within
    /// `margin` of the core counts as over it.
    bool low_over(const Core& core, double height, double margin) const;
};

}  // namespace its::simplifier
