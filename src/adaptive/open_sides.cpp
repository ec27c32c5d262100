#include "adaptive/open_sides.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "base/progress.h"
#include "geometry/box.h"
#include "octree/voxelise.h"
#include "signs/generalized.h"

namespace its::adaptive {

namespace {

using winding::decision_gap;
// Each is tried where the one before does not decide; what none does is left to the sum over the boundary.
constexpr double tolerances[] = {0x1p-11, 0x1p-14, 0x1p-20};

}  // namespace

OpenSides::OpenSides(const mesh::Arrays& mesh, const octree::Lattice& lattice, int flip_level,
                     const Progress& progress, std::optional<winding::Filling> filling)
    : flip_level_(flip_level),
      triangles_of_mesh_(std::uint32_t(mesh.triangles.size())),
      bounds_(octree::bounds(mesh)),
      filling_(filling ? *std::move(filling) : winding::Filling(mesh)),
      closed_(mesh::copy_of(mesh)) {
    const auto first = std::uint32_t(closed_.vertices.size());
    closed_.vertices.insert(closed_.vertices.end(), filling_.surface().vertices.begin(),
                            filling_.surface().vertices.end());
    for (const Triangle& t : filling_.surface().triangles)
        closed_.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    if (filling_.empty()) return;

    const octree::Lattice coarse = octree::coarser(lattice, flip_level);
    std::vector<Vec3> positions;
    positions.reserve(mesh.vertices.size());
    for (const Vec3& v : mesh.vertices) positions.push_back(coarse.to_lattice(v));
    Parts parts(progress);
    octree::Voxels voxels =
        octree::voxelise(positions, mesh.triangles, coarse.depth, coarse.dilation(), parts.until(0.3));
    signs::GeneralizedSigns signs(mesh, coarse, voxels, parts.until(0.5), filling_);
    signs.add_flip_cells(voxels, parts.until(1));
    for (std::size_t i = 0; i < voxels.cell.size(); ++i)
        if (voxels.offset[i] == voxels.offset[i + 1]) flips_.push_back(voxels.cell[i]);
    holes_ = signs.holes();
}

bool OpenSides::flips_in(int level, std::uint64_t code) const {
    if (level < flip_level_) return false;
    const int shift = 3 * (level - flip_level_);
    const auto at = std::lower_bound(flips_.begin(), flips_.end(), code << shift);
    return at != flips_.end() && *at >> shift == code;
}

double OpenSides::to_flip(const std::array<std::uint64_t, 3>& point) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (holes_.empty()) return infinity;
    octree::Cell coarse;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if ((point[axis] & ((std::uint64_t{1} << flip_level_) - 1)) != 0) return infinity;
        coarse[axis] = std::uint32_t(point[axis] >> flip_level_);
    }
    return std::ldexp(holes_.distance(octree::morton_encode(coarse)), flip_level_);
}

/// w(M) > ½, w(M) = (crossings of M by the ray in direction −x) + boundary term; the crossings are those of M
/// and F but for F's.
bool OpenSides::decide_exactly(const Vec3& p, std::int32_t winding) const {
    const winding::WindingEstimate boundary = filling_.boundary_term(p);
    return double(winding - filling_.crossings(p)) + boundary.value - 0.5 > boundary.error;
}

std::uint32_t OpenSides::inside(std::span<const Vec3> points, std::span<const std::int32_t> winding) const {
    std::uint32_t bits = 0, open = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (geometry::contains(bounds_, points[i])) open |= 1u << i;
    if (filling_.empty()) {
        for (; open != 0; open &= open - 1)
            if (winding[std::size_t(std::countr_zero(open))] >= 1) bits |= open & -open;
        return bits;
    }
    for (const double tolerance : tolerances) {
        std::uint32_t left = 0;
        while (open != 0) {
            constexpr int block = winding::Filling::block;
            int which[block], count = 0;
            for (; open != 0 && count < block; open &= open - 1) which[count++] = std::countr_zero(open);
            winding::Filling::Points near;
            for (int j = 0; j < block; ++j) {
                const Vec3& p = points[std::size_t(which[std::min(j, count - 1)])];
                near.x[j] = p.x;
                near.y[j] = p.y;
                near.z[j] = p.z;
            }
            winding::Filling::Estimates estimates;
            filling_.winding(near, tolerance, estimates);
            for (int j = 0; j < count; ++j) {
                const double above = winding[std::size_t(which[j])] - estimates.value[j] - 0.5;
                if (!(std::abs(above) > estimates.error[j] + decision_gap))
                    left |= 1u << which[j];
                else if (above > 0)
                    bits |= 1u << which[j];
            }
        }
        open = left;
    }
    for (; open != 0; open &= open - 1) {
        const auto i = std::size_t(std::countr_zero(open));
        if (decide_exactly(points[i], winding[i])) bits |= 1u << i;
    }
    return bits;
}

}  // namespace its::adaptive
