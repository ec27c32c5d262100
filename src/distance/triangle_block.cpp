#include "distance/triangle_block.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/vec3.h"

namespace its::distance {

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
    const long double squared = dot(a, a), scale = squared > 0 ? 1 / std::sqrt(squared) : 0;
    return {scale * a.x, scale * a.y, scale * a.z};
}
/// Some unit vector at right angles to the unit vector v.
WideVec3 perpendicular(const WideVec3& v) {
    const long double x = std::abs(v.x), y = std::abs(v.y), z = std::abs(v.z);
    const WideVec3 axis =
        x <= y && x <= z ? WideVec3{1, 0, 0} : (y <= z ? WideVec3{0, 1, 0} : WideVec3{0, 0, 1});
    return unit(cross(v, axis));
}

/// The corner that the longest edge starts from.
int start_of_longest_edge(const std::array<Vec3, 3>& corner) {
    std::array<double, 3> squared{};
    for (int i = 0; i < 3; ++i) {
        const Vec3 edge = corner[(i + 1) % 3] - corner[i];
        squared[i] = dot(edge, edge);
    }
    return int(std::max_element(squared.begin(), squared.end()) - squared.begin());
}

}  // namespace

void set_lane(TriangleBlock& t, std::uint64_t lane, const Vec3& p, const Vec3& q, const Vec3& r) {
    const std::array<Vec3, 3> corner = {p, q, r};
    const int first = start_of_longest_edge(corner);
    const Vec3 a = corner[first], b = corner[(first + 1) % 3], c = corner[(first + 2) % 3];
    const auto store = [lane](double(&to)[3][TriangleBlock::lanes], const WideVec3& v) {
        to[0][lane] = double(v.x);
        to[1][lane] = double(v.y);
        to[2][lane] = double(v.z);
    };
    const WideVec3 ab = wide_difference(b, a), ac = wide_difference(c, a);
    const long double ab_length = std::sqrt(dot(ab, ab));
    const WideVec3 along = ab_length > 0 ? unit(ab) : WideVec3{1, 0, 0};
    // Rounding of a needle's normal may turn the frame about ab, but leaves it at right angles: c is then off
    // the plane by 2⁻⁶² of the length at most.
    WideVec3 across = unit(cross(cross(ab, ac), along));
    const bool has_area = dot(across, across) > 0;
    if (!has_area) across = perpendicular(along);
    const WideVec3 normal = cross(along, across);

    for (int axis = 0; axis < 3; ++axis) t.a[axis][lane] = a[axis];
    store(t.along, along);
    store(t.across, across);
    store(t.normal, normal);
    t.first[lane] = std::uint8_t(first);
    // Without area the triangle is ab. As "edges" ac and bc take ab and ba: no point is on the inner side of
    // both.
    const long double cu = has_area ? dot(along, ac) : ab_length, cv = has_area ? dot(across, ac) : 0;
    const long double wu = has_area ? cu - ab_length : -ab_length;
    const auto store_edge = [lane](double(&direction)[2][TriangleBlock::lanes],
                                   double(&length)[TriangleBlock::lanes], long double u, long double v) {
        const long double norm = std::sqrt(u * u + v * v), scale = norm > 0 ? 1 / norm : 0;
        direction[0][lane] = norm > 0 ? double(scale * u) : 1.0;
        direction[1][lane] = double(scale * v);
        length[lane] = double(norm);
    };
    t.ab[lane] = double(ab_length);
    store_edge(t.unit_ac, t.ac, cu, cv);
    store_edge(t.unit_bc, t.bc, wu, cv);
}

std::array<double, 3> barycentric_of_nearest(const TriangleBlock& t, std::uint64_t lane, const Vec3& p) {
    const auto part = [&](const double(&axis)[3][TriangleBlock::lanes]) {
        return dot(p - Vec3{t.a[0][lane], t.a[1][lane], t.a[2][lane]},
                   Vec3{axis[0][lane], axis[1][lane], axis[2][lane]});
    };
    const double u = part(t.along), v = part(t.across), ab = t.ab[lane], w = u - ab;
    const double acu = t.unit_ac[0][lane], acv = t.unit_ac[1][lane], bcu = t.unit_bc[0][lane],
                 bcv = t.unit_bc[1][lane];
    const double in_ac = acv * u - acu * v, in_bc = bcu * v - bcv * w;
    std::array<double, 3> weight{};  // of a, b, c
    if (std::min({v, in_ac, in_bc, u, ab - u}) > 0.0) {
        // Each is the distance from the opposite edge, relative to the corner's.
        weight = {in_bc / (bcv * ab), in_ac / (acv * ab), v / (acv * t.ac[lane])};
        const double sum = weight[0] + weight[1] + weight[2];
        for (double& x : weight) x /= sum;
    } else {
        struct {
            double on, length, inner;
        } const edge[3] = {
            {u, ab, v}, {acu * u + acv * v, t.ac[lane], in_ac}, {bcu * w + bcv * v, t.bc[lane], in_bc}};
        constexpr int ends[3][2] = {{0, 1}, {0, 2}, {1, 2}};
        double nearest = std::numeric_limits<double>::infinity();
        const int edges = acv > 0 ? 3 : 1;  // a triangle without area is ab
        for (int i = 0; i < edges; ++i) {
            const double on = std::clamp(edge[i].on, 0.0, edge[i].length), beyond = edge[i].on - on;
            const double squared = edge[i].inner * edge[i].inner + beyond * beyond;
            if (squared >= nearest) continue;
            nearest = squared;
            const double share = edge[i].length > 0 ? on / edge[i].length : 0.0;
            weight = {};
            weight[ends[i][0]] = 1 - share;
            weight[ends[i][1]] = share;
        }
    }
    std::array<double, 3> result{};
    for (int i = 0; i < 3; ++i) result[(t.first[lane] + i) % 3] = weight[i];
    return result;
}

}  // namespace its::distance
