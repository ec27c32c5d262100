#include "simplify/shadow.h"

namespace its::simplifier {

namespace {

/// A triangle, or what three lines leave of it. A line that separates c runs of n corners from as many others
/// leaves at most n + c, and c ≤ n/2: 4 corners after the first, 6 and 9 after the next, even where rounding
/// costs convexity.
struct Polygon {
    std::array<Vec3, 9> corner;
    std::size_t size = 0;

    void add(const Vec3& p) { corner[size++] = p; }
};

/// The part on the inner side of the core's edge k, moved outward by the margin.
Polygon clip(const Polygon& polygon, const Core& core, std::size_t k, double margin) {
    const auto inside_by = [&](const Vec3& p) {
        return core.nx[k] * p.x + core.ny[k] * p.y - core.level[k] + margin;
    };
    Polygon cut;
    for (std::size_t i = 0; i < polygon.size; ++i) {
        const Vec3 &p = polygon.corner[i], &q = polygon.corner[(i + 1) % polygon.size];
        const double from_p = inside_by(p), from_q = inside_by(q);
        if (from_p >= 0) cut.add(p);
        if ((from_p >= 0) != (from_q >= 0)) cut.add(p + (from_p / (from_p - from_q)) * (q - p));
    }
    return cut;
}

}  // namespace

int Shadow::covers(double px, double py, double margin) const {
    double least = 1e300, most = -1e300;
    bool sure = true, surely_left = false, surely_right = false;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 &from = corner[k], &to = corner[(k + 1) % 3];
        const double ex = to.x - from.x, ey = to.y - from.y;
        const double side = ex * (py - from.y) - ey * (px - from.x);
        const double doubt = 2 * margin * (std::abs(ex) + std::abs(ey));
        sure &= std::abs(side) > doubt;
        surely_left |= side > doubt;
        surely_right |= side < -doubt;
        least = std::min(least, side);
        most = std::max(most, side);
    }
    if (sure) return least >= 0 || most <= 0 ? 1 : 0;
    return surely_left && surely_right ? 0 : -1;  // outside if two sides certainly differ
}

bool Shadow::low_over(const Core& core, double height, double margin) const {
    const auto low = [&](const Vec3& p) { return std::abs(p.z) <= height; };
    if (std::all_of(corner.begin(), corner.end(), low)) return true;
    Polygon part;
    for (const Vec3& p : corner) part.add(p);
    for (std::size_t k = 0; k < 3; ++k) part = clip(part, core, k, margin);
    return std::all_of(part.corner.begin(), part.corner.begin() + std::ptrdiff_t(part.size), low);
}

}  // namespace its::simplifier
