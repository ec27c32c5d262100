#include "geometry/triangle_pair.h"

#include <cstddef>

#include "geometry/predicates.h"

namespace its::geometry {

namespace {

bool segment_meets(const Vec3& p, const Vec3& q, const NumberedTriangle& t) {
    bool degenerate = false;
    return segment_crossing(t.corner[0], t.corner[1], t.corner[2], p, q, degenerate) != 0 || degenerate;
}

/// Whether two triangles over the edge pq, with the third corners a and b, lie on each other.
bool folded(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b) {
    if (orient3d(p, q, a, b) != 0) return false;
    // Coplanar: in a projection that keeps pqa's area, a and b on the same side of pq.
    for (int axis = 0; axis < 3; ++axis) {
        const int x = (axis + 1) % 3, y = (axis + 2) % 3;
        const int side = orient2d(p[x], p[y], q[x], q[y], a[x], a[y]);
        if (side != 0) return orient2d(p[x], p[y], q[x], q[y], b[x], b[y]) == side;
    }
    return true;  // a on the line pq: of no area, and part of the other's edge
}

}  // namespace

bool intersect(const NumberedTriangle& s, const NumberedTriangle& t) {
    // Corners of s, and of t, that the other does not have, after those that both have.
    std::array<std::size_t, 3> in_s, in_t;
    std::size_t shared = 0;
    std::array<bool, 3> used_s{}, used_t{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            if (s.number[i] == t.number[j] && !used_s[i] && !used_t[j]) {
                in_s[shared] = i, in_t[shared] = j;
                used_s[i] = used_t[j] = true;
                ++shared;
            }
    if (shared == 3) return true;
    for (std::size_t i = 0, at_s = shared, at_t = shared; i < 3; ++i) {
        if (!used_s[i]) in_s[at_s++] = i;
        if (!used_t[i]) in_t[at_t++] = i;
    }
    const auto sc = [&](std::size_t i) { return s.corner[in_s[i]]; };
    const auto tc = [&](std::size_t i) { return t.corner[in_t[i]]; };
    if (shared == 2) return folded(sc(0), sc(1), sc(2), tc(2));
    // One shared corner: the triangles meet elsewhere only if the opposite edge of one meets the other.
    if (shared == 1) return segment_meets(sc(1), sc(2), t) || segment_meets(tc(1), tc(2), s);
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        if (segment_meets(s.corner[i], s.corner[j], t) || segment_meets(t.corner[i], t.corner[j], s))
            return true;
    }
    return false;
}

}  // namespace its::geometry
