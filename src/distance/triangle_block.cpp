#include "distance/triangle_block.h"

#include <algorithm>
#include <cmath>

#include "geometry/vec3.h"

namespace its {

namespace {

/// Extended precision for what is computed once a triangle.
struct WideVec3 {
    long double x, y, z;
};
WideVec3 wide_difference(const Vec3& p, const Vec3& q) {
    return {(long double)p.x - q.x, (long double)p.y - q.y, (long double)p.z - q.z};
}
WideVec3 cross(const WideVec3& a, const WideVec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
long double dot(const WideVec3& a, const WideVec3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
WideVec3 unit(const WideVec3& a) {
    const long double length = std::sqrt(dot(a, a));
    return length > 0 ? WideVec3{a.x / length, a.y / length, a.z / length} : WideVec3{0, 0, 0};
}
double reciprocal(long double x) {
    return x > 0 ? double(1 / x) : 0.0;
}

}  // namespace

void set_lane(TriangleBlock& t, std::uint64_t lane, const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto store = [lane](double(&to)[3][TriangleBlock::lanes], const WideVec3& v) {
        to[0][lane] = double(v.x);
        to[1][lane] = double(v.y);
        to[2][lane] = double(v.z);
    };
    const WideVec3 ab = wide_difference(b, a), ac = wide_difference(c, a), bc = wide_difference(c, b);
    for (int axis = 0; axis < 3; ++axis) t.a[axis][lane] = a[axis];
    store(t.ab, ab);
    store(t.ac, ac);
    t.ab_ab[lane] = double(dot(ab, ab));
    t.ab_ac[lane] = double(dot(ab, ac));
    t.inverse_ab[lane] = reciprocal(dot(ab, ab));
    t.inverse_ac[lane] = reciprocal(dot(ac, ac));
    t.inverse_bc[lane] = reciprocal(dot(bc, bc));

    const WideVec3 normal = unit(cross(ab, ac));
    const WideVec3 in_from_bc = unit(cross(normal, bc));
    store(t.normal, normal);
    store(t.in_from_ab, unit(cross(normal, ab)));
    store(t.in_from_ac, unit(cross(ac, normal)));
    store(t.in_from_bc, in_from_bc);
    const bool degenerate = dot(normal, normal) == 0;
    t.bc_level[lane] = degenerate ? 1.0 : double(dot(in_from_bc, ab));
}

std::array<double, 3> barycentric_of_nearest(const TriangleBlock& t, std::uint64_t lane, const Vec3& p) {
    const auto vector = [&](const double(&v)[3][TriangleBlock::lanes]) {
        return Vec3{v[0][lane], v[1][lane], v[2][lane]};
    };
    const Vec3 ab = vector(t.ab), ac = vector(t.ac), ap = p - vector(t.a);
    // Distances from the edges into the triangle; each barycentric coordinate is one, relative to a corner's.
    const double from_ab = dot(ap, vector(t.in_from_ab)), from_ac = dot(ap, vector(t.in_from_ac));
    const double from_bc = dot(ap, vector(t.in_from_bc)) - t.bc_level[lane];
    if (std::min({from_ab, from_ac, from_bc}) >= 0.0) {
        const double wa = from_bc / -t.bc_level[lane], wb = from_ac / dot(ab, vector(t.in_from_ac)),
                     wc = from_ab / dot(ac, vector(t.in_from_ab));
        const double sum = wa + wb + wc;
        return {wa / sum, wb / sum, wc / sum};
    }
    const double d1 = dot(ap, ab), d2 = dot(ap, ac);
    const double on_ab = std::clamp(d1 * t.inverse_ab[lane], 0.0, 1.0);
    const double on_ac = std::clamp(d2 * t.inverse_ac[lane], 0.0, 1.0);
    const double on_bc = std::clamp((d2 - d1 - t.ab_ac[lane] + t.ab_ab[lane]) * t.inverse_bc[lane], 0.0, 1.0);
    const Vec3 to_ab = ap - on_ab * ab, to_ac = ap - on_ac * ac, to_bc = ap - ab - on_bc * (ac - ab);
    const double ab2 = dot(to_ab, to_ab), ac2 = dot(to_ac, to_ac), bc2 = dot(to_bc, to_bc);
    if (ab2 <= ac2 && ab2 <= bc2) return {1 - on_ab, on_ab, 0};
    if (ac2 <= bc2) return {1 - on_ac, 0, on_ac};
    return {0, 1 - on_bc, on_bc};
}

}  // namespace its
