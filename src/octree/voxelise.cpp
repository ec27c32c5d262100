#include "octree/voxelise.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "base/platform/lanes.h"
#include "base/progress.h"
#include "base/rounding.h"
#include "geometry/vec3.h"
#include "octree/morton.h"

namespace its::octree {

namespace {

using platform::absolute;
using platform::Lanes;
using platform::lanes;
using platform::larger;
using platform::smaller;

/// Eight (cell, triangle) pairs: the triangles' corners relative to the cells' centres.
struct Batch {
    Lanes x[3], y[3], z[3];

    void set(int lane, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& centre) {
        int corner = 0;
        for (const Vec3& v : {a, b, c}) {
            x[corner][lane] = v.x - centre.x;
            y[corner][lane] = v.y - centre.y;
            z[corner][lane] = v.z - centre.z;
            ++corner;
        }
    }
};

/// What children are tested with, lengths in finest cells.
struct Cube {
    double half;     ///< of a child
    double dilated;  ///< half and the dilation
    double size;     ///< bound on all coordinates
};

/// Cells of a level, to be tested for triangles.
Cube children_at(int level, int depth, double dilation) {
    const double size = std::ldexp(2.0, depth), half = std::ldexp(0.5, level);
    // 8u·size covers the test along the box's and the edges' axes: coordinates relative to the centre err by
    // u·size, edges by a relative u, a dot product of two terms by a relative 3u.
    return {half, half + dilation + 8 * unit_roundoff * size, size};
}

/// How far the interval [low, high] is from the one around `centre`: positive if they are apart.
ITS_INLINE Lanes gap(const Lanes& low, const Lanes& high, const Lanes& centre, const Lanes& radius) {
    return larger(low - centre, centre - high) - radius;
}

/// gaps[side]: along one axis of the box, to the lower and the upper children.
ITS_INLINE void box_gaps(const Lanes (&v)[3], const Cube& cube, Lanes (&gaps)[2]) {
    const Lanes low = smaller(smaller(v[0], v[1]), v[2]), high = larger(larger(v[0], v[1]), v[2]);
    gaps[0] = gap(low, high, Lanes{} - cube.half, Lanes{} + cube.dilated);
    gaps[1] = gap(low, high, Lanes{} + cube.half, Lanes{} + cube.dilated);
}

/// gaps[i + 2j]: from square i, j of the four children in a plane, the largest along the three axes that are
/// normal to an edge within this plane. p, q: the two coordinates of the plane.
ITS_INLINE void plane_gaps(const Lanes (&p)[3], const Lanes (&q)[3], const Cube& cube, Lanes (&gaps)[4]) {
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1, k = i == 0 ? 2 : i - 1;
        const Lanes ep = q[i] - q[j], eq = p[j] - p[i];  // normal of edge ij
        const Lanes on_edge = ep * p[i] + eq * q[i], opposite = ep * p[k] + eq * q[k];
        const Lanes low = smaller(on_edge, opposite), high = larger(on_edge, opposite);
        const Lanes radius = cube.dilated * (absolute(ep) + absolute(eq));
        for (int square = 0; square < 4; ++square) {
            const Lanes cp = ep * cube.half, cq = eq * cube.half;
            const Lanes g = gap(low, high, (square & 1 ? cp : -cp) + (square & 2 ? cq : -cq), radius);
            gaps[square] = i == 0 ? g : larger(gaps[square], g);
        }
    }
}

/// gaps[child]: along the triangle's normal.
ITS_INLINE void normal_gaps(const Lanes (&x)[3], const Lanes (&y)[3], const Lanes (&z)[3], const Cube& cube,
                            Lanes (&gaps)[8]) {
    const Lanes ux = x[1] - x[0], uy = y[1] - y[0], uz = z[1] - z[0];
    const Lanes vx = x[2] - x[0], vy = y[2] - y[0], vz = z[2] - z[0];
    const Lanes nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    // |computed n·x − exact| ≤ 16u·size·|u|₁|v|₁: n errs by at most 3u|u|₁|v|₁ per component, x ≤ size.
    const Lanes slack = 16 * unit_roundoff * cube.size * (absolute(ux) + absolute(uy) + absolute(uz)) *
                        (absolute(vx) + absolute(vy) + absolute(vz));
    const Lanes radius = cube.dilated * (absolute(nx) + absolute(ny) + absolute(nz)) + slack;
    const Lanes at = nx * x[0] + ny * y[0] + nz * z[0];
    for (int child = 0; child < 8; ++child)
        gaps[child] = gap(at, at,
                          (child & 1 ? nx : -nx) * cube.half + (child & 2 ? ny : -ny) * cube.half +
                              (child & 4 ? nz : -nz) * cube.half,
                          radius);
}

/// met[lane]: bits of the children that the triangle meets, by the separating axis theorem.
ITS_CLONES void test(const Batch& batch, const Cube& cube, std::uint8_t* met) {
    Lanes box_x[2], box_y[2], box_z[2], yz[4], xz[4], xy[4], normal[8], gaps[8];
    box_gaps(batch.x, cube, box_x);
    box_gaps(batch.y, cube, box_y);
    box_gaps(batch.z, cube, box_z);
    plane_gaps(batch.y, batch.z, cube, yz);
    plane_gaps(batch.x, batch.z, cube, xz);
    plane_gaps(batch.x, batch.y, cube, xy);
    normal_gaps(batch.x, batch.y, batch.z, cube, normal);
    for (int child = 0; child < 8; ++child) {
        const int i = child & 1, j = child >> 1 & 1, k = child >> 2;
        const Lanes box = larger(larger(box_x[i], box_y[j]), box_z[k]);
        const Lanes edges = larger(larger(yz[j + 2 * k], xz[i + 2 * k]), xy[i + 2 * j]);
        gaps[child] = larger(larger(box, edges), normal[child]);
    }
    for (int lane = 0; lane < lanes; ++lane) {
        unsigned bits = 0;
        for (int child = 0; child < 8; ++child) bits |= unsigned(gaps[child][lane] <= 0) << child;
        met[lane] = std::uint8_t(bits);
    }
}

}  // namespace

unsigned children_met(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& centre, double half,
                      double dilation, double size) {
    Batch batch;
    for (int lane = 0; lane < lanes; ++lane) batch.set(lane, a, b, c, centre);
    std::uint8_t met[lanes];
    test(batch, {half, half + dilation, size}, met);
    return met[0];
}

namespace {

constexpr std::uint64_t cell_grain = 256, pair_grain = 8192;

/// met[p]: the children of its cell that the triangle of pair p meets.
void test_pairs(const Voxels& above, std::span<const Vec3> positions, std::span<const Triangle> triangles,
                const Cube& cube, Stage& stage, std::vector<std::uint8_t>& met) {
    for_chunks(met.size(), pair_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        auto cell = std::uint64_t(std::upper_bound(above.offset.begin(), above.offset.end(), begin) -
                                  above.offset.begin() - 1);
        Vec3 centre;
        std::uint64_t cell_end = 0;  // of the pairs of the cell before
        Batch batch;
        std::uint8_t bits[lanes];
        for (std::uint64_t first = begin; first < end; first += lanes) {
            const std::uint64_t count = std::min<std::uint64_t>(lanes, end - first);
            for (std::uint64_t lane = 0; lane < lanes; ++lane) {
                const std::uint64_t pair = first + std::min(lane, count - 1);
                if (pair >= cell_end) {
                    while (above.offset[cell + 1] <= pair) ++cell;
                    cell_end = above.offset[cell + 1];
                    const Cell at = morton_decode(above.cell[cell]);
                    centre = {(2.0 * at[0] + 1) * 2 * cube.half, (2.0 * at[1] + 1) * 2 * cube.half,
                              (2.0 * at[2] + 1) * 2 * cube.half};
                }
                const Triangle& t = triangles[above.triangle[pair]];
                batch.set(int(lane), positions[t[0]], positions[t[1]], positions[t[2]], centre);
            }
            test(batch, cube, bits);
            std::copy(bits, bits + count, &met[first]);
        }
        stage.advance(end - begin);
    });
}

/// Running sums: v[i] becomes the sum of those before i, as v[i + 1] was the number at i.
void add_up(std::vector<std::uint64_t>& v) {
    for (std::size_t i = 1; i < v.size(); ++i) v[i] += v[i - 1];
}

/// One step down: the children of `above` that triangles meet.
Voxels descend(const Voxels& above, std::span<const Vec3> positions, std::span<const Triangle> triangles,
               const Cube& cube, Stage& stage) {
    const std::uint64_t count = above.cell.size();
    std::vector<std::uint8_t> met(above.triangle.size());
    test_pairs(above, positions, triangles, cube, stage, met);
    std::vector<std::uint64_t> cells_before(count + 1), pairs_before(count + 1);
    parallel_for(count, cell_grain, [&](std::uint64_t i) {
        unsigned any = 0;
        for (std::uint64_t p = above.offset[i]; p < above.offset[i + 1]; ++p) {
            any |= met[p];
            pairs_before[i + 1] += std::uint64_t(std::popcount(met[p]));
        }
        cells_before[i + 1] = std::uint64_t(std::popcount(any));
    });
    add_up(cells_before);
    add_up(pairs_before);

    Voxels below;
    below.cell.resize(cells_before[count]);
    below.offset.resize(cells_before[count] + 1);
    below.triangle.resize(pairs_before[count]);
    below.offset.back() = pairs_before[count];
    parallel_for(count, cell_grain, [&](std::uint64_t i) {
        std::uint64_t next[8] = {};  // first the number of the child's pairs, then where the next one goes
        for (std::uint64_t p = above.offset[i]; p < above.offset[i + 1]; ++p)
            for (unsigned bits = met[p]; bits != 0; bits &= bits - 1) ++next[std::countr_zero(bits)];
        std::uint64_t cell = cells_before[i], pair = pairs_before[i];
        for (std::uint64_t child = 0; child < 8; ++child) {
            if (next[child] == 0) continue;
            below.cell[cell] = above.cell[i] << 3 | child;
            below.offset[cell++] = pair;
            pair += std::exchange(next[child], pair);
        }
        for (std::uint64_t p = above.offset[i]; p < above.offset[i + 1]; ++p)
            for (unsigned bits = met[p]; bits != 0; bits &= bits - 1)
                below.triangle[next[std::countr_zero(bits)]++] = above.triangle[p];
    });
    return below;
}

}  // namespace

Voxels halve(const Voxels& above, std::span<const Vec3> positions, std::span<const Triangle> triangles,
             int level, int depth, double dilation) {
    Stage silent({}, {}, 0);
    return descend(above, positions, triangles, children_at(level, depth, dilation), silent);
}

Voxels voxelise(std::span<const Vec3> positions, std::span<const Triangle> triangles, int depth,
                double dilation, const Progress& progress,
                const std::function<void(int, std::uint64_t, std::uint64_t)>& before_level) {
    Voxels voxels{.cell = {0}, .offset = {0, triangles.size()}, .triangle = {}};
    voxels.triangle.resize(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) voxels.triangle[i] = std::uint32_t(i);
    Parts parts(progress);
    for (int level = depth; level >= 0; --level) {
        if (before_level) before_level(level, voxels.cell.size(), voxels.triangle.size());
        // At last pairs grow by a factor of 2 to 4 a level.
        Stage stage(parts.until(std::exp2(-level)), "octree", voxels.triangle.size());
        voxels = descend(voxels, positions, triangles, children_at(level, depth, dilation), stage);
    }
    return voxels;
}

}  // namespace its::octree
