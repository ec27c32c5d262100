#include "distance/triangle_block.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/double_double.h"
#include "geometry/vec3.h"

namespace its::distance {

namespace {

constexpr int lanes = TriangleBlock::lanes;

/// Twice a double's digits, for what is computed once a triangle. Straight selections: a loop over lanes
/// becomes vector code.
struct WideVec3 {
    DoubleDouble x, y, z;
};
ITS_INLINE WideVec3 operator*(const DoubleDouble& s, const WideVec3& a) {
    return {s * a.x, s * a.y, s * a.z};
}
ITS_INLINE WideVec3 cross(const WideVec3& a, const WideVec3& b) {
    return {sum_of_products(a.y, b.z, -a.z, b.y), sum_of_products(a.z, b.x, -a.x, b.z),
            sum_of_products(a.x, b.y, -a.y, b.x)};
}
ITS_INLINE DoubleDouble dot(const WideVec3& a, const WideVec3& b) {
    return sum_of_products(a.x, b.x, a.y, b.y) + a.z * b.z;
}
ITS_INLINE double largest(const WideVec3& a) {
    const double x = std::abs(a.x.high), y = std::abs(a.y.high), z = std::abs(a.z.high), xy = x < y ? y : x;
    return xy < z ? z : xy;
}

/// A power of two that brings x into [1, 4), if x is positive and no subnormal number. Products with it are
/// exact.
ITS_INLINE double scale_to_one(double x) {
    const std::uint64_t exponent = std::bit_cast<std::uint64_t>(x) >> 52;  // biased by 1023
    const std::uint64_t low = exponent < 1 ? 1 : exponent, within = low < 2045 ? low : 2045;
    return std::bit_cast<double>((2046 - within) << 52);
}
ITS_INLINE WideVec3 scaled(const WideVec3& a, double power) {
    return {{power * a.x.high, power * a.x.low},
            {power * a.y.high, power * a.y.low},
            {power * a.z.high, power * a.z.low}};
}
/// The direction of a vector that is not 0. Scaled first: the squares of what is nearly 0 would vanish.
ITS_INLINE WideVec3 unit(const WideVec3& a) {
    const WideVec3 v = scaled(a, scale_to_one(largest(a)));
    return inverse(square_root(dot(v, v))) * v;
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

/// Triangles by their longest edge ab.
struct Longest {
    double a[3][lanes], b[3][lanes], c[3][lanes];
};

ITS_INLINE WideVec3 edge(const double (&from)[3][lanes], const double (&to)[3][lanes], int i) {
    return {exact_sum(to[0][i], -from[0][i]), exact_sum(to[1][i], -from[1][i]),
            exact_sum(to[2][i], -from[2][i])};
}
ITS_INLINE void store(const WideVec3& v, double (&to)[3][lanes], int i) {
    to[0][i] = v.x.high;
    to[1][i] = v.y.high;
    to[2][i] = v.z.high;
}
ITS_INLINE void store_edge(const DoubleDouble& u, const DoubleDouble& v, double back,
                           double (&direction)[2][lanes], double (&length)[lanes], int i) {
    const WideVec3 edge = {u, v, 0.0}, to = unit(edge);
    direction[0][i] = to.x.high;
    direction[1][i] = to.y.high;
    length[i] = back * sum_of_products(to.x, u, to.y, v).high;
}

/// The frames of triangles with an area.
/// \param has_area  set to 0 where there is none, as computed
ITS_CLONES void set_frames(const Longest& in, TriangleBlock& t, double (&has_area)[lanes]) {
    ITS_INDEPENDENT
    for (int i = 0; i < lanes; ++i) {
        // In units of a power of two near the length of ab: nothing overflows.
        const WideVec3 to_b = edge(in.a, in.b, i);
        const double power = scale_to_one(largest(to_b)), back = 1 / power;
        const WideVec3 ab = scaled(to_b, power), ac = scaled(edge(in.a, in.c, i), power), along = unit(ab);
        // Rounding of a needle's normal, by 26u² of the squared length at most, may turn the frame about ab,
        // but leaves it at right angles: c is then off the plane by 2⁻¹⁰⁰ of the length at most.
        const WideVec3 to_c = cross(cross(ab, ac), along), across = unit(to_c);
        has_area[i] = largest(to_c);
        store(along, t.along, i);
        store(across, t.across, i);
        store(cross(along, across), t.normal, i);
        const DoubleDouble length = dot(along, ab), cu = dot(along, ac), cv = dot(across, ac);
        t.ab[i] = back * length.high;
        store_edge(cu, cv, back, t.unit_ac, t.ac, i);
        store_edge(cu - length, cv, back, t.unit_bc, t.bc, i);
    }
}

/// A triangle without area is ab. As "edges" ac and bc it takes ab and ba: no point is on the inner side of
/// both.
void set_segment(const Longest& in, TriangleBlock& t, int i) {
    const WideVec3 ab = edge(in.a, in.b, i);
    const bool is_point = !(largest(ab) > 0);
    const WideVec3 along = is_point ? WideVec3{1, 0, 0} : unit(ab);
    const double x = std::abs(along.x.high), y = std::abs(along.y.high), z = std::abs(along.z.high);
    const WideVec3 axis =
        x <= y && x <= z ? WideVec3{1, 0, 0} : (y <= z ? WideVec3{0, 1, 0} : WideVec3{0, 0, 1});
    const WideVec3 across = unit(cross(along, axis));
    store(along, t.along, i);
    store(across, t.across, i);
    store(cross(along, across), t.normal, i);
    const double power = scale_to_one(largest(ab));
    const double length = is_point ? 0.0 : dot(along, scaled(ab, power)).high / power;
    t.ab[i] = t.ac[i] = t.bc[i] = length;
    t.unit_ac[0][i] = 1;
    t.unit_bc[0][i] = is_point ? 1 : -1;
    t.unit_ac[1][i] = t.unit_bc[1][i] = 0;
}

}  // namespace

TriangleBlock make_block(const std::array<std::array<Vec3, 3>, lanes>& triangles) {
    TriangleBlock t;
    Longest in;
    for (int i = 0; i < lanes; ++i) {
        const std::array<Vec3, 3>& corner = triangles[i];
        const int first = start_of_longest_edge(corner);
        t.first[i] = std::uint8_t(first);
        for (int axis = 0; axis < 3; ++axis) {
            t.a[axis][i] = in.a[axis][i] = corner[first][axis];
            in.b[axis][i] = corner[(first + 1) % 3][axis];
            in.c[axis][i] = corner[(first + 2) % 3][axis];
        }
    }
    double has_area[lanes];
    set_frames(in, t, has_area);
    for (int i = 0; i < lanes; ++i)
        if (!(has_area[i] > 0)) set_segment(in, t, i);
    return t;
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
