#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "its/mesh.h"

namespace its::winding {

/// Exact crossings of triangles by rays in direction −x: triangles are binned by the squares of a grid across
/// the rays.
class XRays {
public:
    /// Both must outlive this.
    XRays(std::span<const Vec3> points, std::span<const Triangle> triangles);

    /// Signed crossings of the ray from p, which counts as displaced as in geometry/predicates.h: what a
    /// winding number gains from −x infinity to p. Odd iff the number of crossings is.
    int crossings(const Vec3& p) const;

    /// Of the bins.
    std::uint64_t memory_bytes() const {
        return first_.size() * sizeof(first_[0]) + index_.size() * sizeof(index_[0]);
    }

private:
    std::int64_t bin(int axis, double at) const;

    std::span<const Vec3> points_;
    std::span<const Triangle> triangles_;
    Box box_;
    std::int64_t side_ = 1;  ///< bins along y and along z
    std::vector<std::uint64_t> first_;
    std::vector<std::uint32_t> index_;
};

}  // namespace its::winding
