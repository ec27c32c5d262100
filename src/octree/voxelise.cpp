#include "octree/voxelise.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/vec3.h"
#include "octree/morton.h"

namespace its {

namespace {

using Lanes = double __attribute__((vector_size(32)));
using Flags = long long __attribute__((vector_size(32)));

/// Bit i + 2j of the result: the square i, j of the four children in a plane is separated from the triangle by
/// one of the three axes that are normal to an edge within this plane. p, q: the two coordinates of the plane.
unsigned separated_in_plane(const double (&p)[3], const double (&q)[3], double half, double dilated) {
    constexpr Lanes sign_p = {-1, 1, -1, 1};
    constexpr Lanes sign_q = {-1, -1, 1, 1};
    Flags apart = {};
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double ep = q[i] - q[j], eq = p[j] - p[i];  // normal of edge ij
        const double along = ep * p[i] + eq * q[i];
        const double across = ep * p[k] + eq * q[k];
        const double radius = dilated * (std::abs(ep) + std::abs(eq));
        const Lanes centre = (ep * half) * sign_p + (eq * half) * sign_q;
        apart |= (centre + radius < std::min(along, across)) | (centre - radius > std::max(along, across));
    }
    unsigned bits = 0;
    for (int lane = 0; lane < 4; ++lane) bits |= unsigned(apart[lane] & 1) << lane;
    return bits;
}

/// Children on one side or both of the middle plane of an axis: bits of the children that the interval meets.
unsigned met_along_axis(int axis, double low, double high, double half, double dilated) {
    constexpr unsigned lower_side[3] = {0x55, 0x33, 0x0f};
    unsigned met = 0;
    if (low <= -half + dilated && high >= -half - dilated) met |= lower_side[axis];
    if (low <= half + dilated && high >= half - dilated) met |= lower_side[axis] ^ 0xff;
    return met;
}

/// Bits of the children that the triangle's plane meets. `size`: bound on all coordinates.
unsigned met_by_plane(const Vec3& a, const Vec3& ab, const Vec3& ac, double half, double dilated, double size) {
    const Vec3 n = cross(ab, ac);
    // |computed n·x − exact| ≤ 16u·size·|ab|₁|ac|₁: n errs by at most 3u|ab|₁|ac|₁ per component, x ≤ size.
    const double slack = 16 * unit_roundoff * size * (std::abs(ab.x) + std::abs(ab.y) + std::abs(ab.z)) *
                         (std::abs(ac.x) + std::abs(ac.y) + std::abs(ac.z));
    const double radius = dilated * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z)) + slack;
    const double at = dot(n, a);
    unsigned met = 0;
    for (int child = 0; child < 8; ++child) {
        const double centre =
            (child & 1 ? n.x : -n.x) * half + (child & 2 ? n.y : -n.y) * half + (child & 4 ? n.z : -n.z) * half;
        met |= unsigned(std::abs(at - centre) <= radius) << child;
    }
    return met;
}

// A square's bit i + 2j stands for two children: those that differ along the third axis.
constexpr unsigned spread_yz(unsigned bits) {
    unsigned out = 0;
    for (int b = 0; b < 4; ++b)
        if (bits >> b & 1) out |= 3u << (2 * b);
    return out;
}
constexpr unsigned spread_xz(unsigned bits) {
    unsigned out = 0;
    for (int b = 0; b < 4; ++b)
        if (bits >> b & 1) out |= 5u << ((b & 1) + 4 * (b >> 1));
    return out;
}
constexpr unsigned spread_xy(unsigned bits) {
    return bits | bits << 4;
}

struct SpreadTable {
    std::uint8_t yz[16], xz[16], xy[16];
};
constexpr SpreadTable spread = [] {
    SpreadTable table{};
    for (unsigned b = 0; b < 16; ++b) {
        table.yz[b] = std::uint8_t(spread_yz(b));
        table.xz[b] = std::uint8_t(spread_xz(b));
        table.xy[b] = std::uint8_t(spread_xy(b));
    }
    return table;
}();

}  // namespace

unsigned children_met(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& centre, double half,
                      double dilation, double size) {
    const double x[3] = {a.x - centre.x, b.x - centre.x, c.x - centre.x};
    const double y[3] = {a.y - centre.y, b.y - centre.y, c.y - centre.y};
    const double z[3] = {a.z - centre.z, b.z - centre.z, c.z - centre.z};
    const double dilated = half + dilation;

    unsigned met = met_along_axis(0, std::min({x[0], x[1], x[2]}), std::max({x[0], x[1], x[2]}), half, dilated);
    met &= met_along_axis(1, std::min({y[0], y[1], y[2]}), std::max({y[0], y[1], y[2]}), half, dilated);
    met &= met_along_axis(2, std::min({z[0], z[1], z[2]}), std::max({z[0], z[1], z[2]}), half, dilated);
    if (std::popcount(met) <= 1)
        return met;  // boxes overlap in one child at most: the triangle lies in it, or
                     // in none, and the parent was met
    met &= ~unsigned(spread.yz[separated_in_plane(y, z, half, dilated)]);
    met &= ~unsigned(spread.xz[separated_in_plane(x, z, half, dilated)]);
    met &= ~unsigned(spread.xy[separated_in_plane(x, y, half, dilated)]);
    if (met == 0) return 0;
    return met & met_by_plane({x[0], y[0], z[0]}, b - a, c - a, half, dilated, size);
}

namespace {

constexpr std::uint64_t cell_grain = 64;

/// One step down: the children of `above` that triangles meet. half: of a child, in finest cell widths.
Voxels descend(const Voxels& above, std::span<const Vec3> positions, std::span<const Triangle> triangles,
               int level, double dilation, double size, Stage& stage) {
    const double half = std::ldexp(0.5, level);
    const std::uint64_t count = above.cell.size();
    std::vector<std::uint8_t> met(above.triangle.size());
    std::vector<std::uint64_t> cells_before(count + 1), pairs_before(count + 1);
    for_chunks(count, cell_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) {
            const Cell at = morton_decode(above.cell[i]);
            const Vec3 centre = {(2.0 * at[0] + 1) * 2 * half, (2.0 * at[1] + 1) * 2 * half,
                                 (2.0 * at[2] + 1) * 2 * half};
            unsigned any = 0;
            std::uint64_t pairs = 0;
            for (std::uint64_t p = above.offset[i]; p < above.offset[i + 1]; ++p) {
                const Triangle& t = triangles[above.triangle[p]];
                const unsigned bits = children_met(positions[t[0]], positions[t[1]], positions[t[2]], centre,
                                                   half, dilation, size);
                met[p] = std::uint8_t(bits);
                any |= bits;
                pairs += std::uint64_t(std::popcount(bits));
            }
            cells_before[i + 1] = std::uint64_t(std::popcount(any));
            pairs_before[i + 1] = pairs;
        }
        stage.advance(end - begin);
    });
    for (std::uint64_t i = 0; i < count; ++i) {
        cells_before[i + 1] += cells_before[i];
        pairs_before[i + 1] += pairs_before[i];
    }

    Voxels below;
    below.cell.resize(cells_before[count]);
    below.offset.resize(cells_before[count] + 1);
    below.triangle.resize(pairs_before[count]);
    below.offset.back() = pairs_before[count];
    parallel_for(count, cell_grain, [&](std::uint64_t i) {
        unsigned any = 0;
        for (std::uint64_t p = above.offset[i]; p < above.offset[i + 1]; ++p) any |= met[p];
        std::uint64_t cell = cells_before[i], pair = pairs_before[i];
        for (; any != 0; any &= any - 1) {
            const int child = std::countr_zero(any);
            below.cell[cell] = above.cell[i] << 3 | std::uint64_t(child);
            below.offset[cell++] = pair;
            for (std::uint64_t p = above.offset[i]; p < above.offset[i + 1]; ++p)
                if (met[p] >> child & 1) below.triangle[pair++] = above.triangle[p];
        }
    });
    return below;
}

}  // namespace

Voxels voxelise(std::span<const Vec3> positions, std::span<const Triangle> triangles, int depth,
                double dilation, const Progress& progress,
                const std::function<void(int, std::uint64_t, std::uint64_t)>& before_level) {
    const double size = std::ldexp(2.0, depth);
    // 8u·size covers the test along the box's and the edges' axes: coordinates relative to the centre err by
    // u·size, edges by a relative u, a dot product of two terms by a relative 3u.
    const double dilated = dilation + 8 * unit_roundoff * size;
    Voxels voxels{.cell = {0}, .offset = {0, triangles.size()}, .triangle = {}};
    voxels.triangle.resize(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) voxels.triangle[i] = std::uint32_t(i);
    for (int level = depth; level >= 0; --level) {
        if (before_level) before_level(level, voxels.cell.size(), voxels.triangle.size());
        Stage stage(progress, "octree", voxels.cell.size());
        voxels = descend(voxels, positions, triangles, level, dilated, size, stage);
    }
    return voxels;
}

}  // namespace its
