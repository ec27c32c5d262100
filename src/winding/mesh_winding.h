#pragma once

#include <cstdint>
#include <span>

#include "its/mesh.h"
#include "mesh/arrays.h"
#include "winding/filling.h"
#include "winding/x_rays.h"

/// The winding number of a mesh around any point.
namespace its::winding {

/// Bound on the error of MeshWinding::at() that is aimed at; points nearer to an edge of the boundary than some
/// 2⁻⁶⁴ of its length have larger ones, as they say.
inline constexpr double winding_error = 1e-10;

/// Crossings by one ray and a sum over the boundary (docs/design/signs.md), with bins for the rays and a tree
/// of the boundary. Members may be called from any number of threads and allocate nothing.
class MeshWinding {
public:
    /// Both spans must outlive this.
    /// \param cycle  the mesh is known to be a cycle in space, whose winding numbers are whole
    MeshWinding(std::span<const Vec3> vertices, std::span<const Triangle> triangles, bool cycle = false);

    /// The winding number of the point, displaced as in geometry/predicates.h; of a point off M its own. Time
    /// proportional to the boundary. Error 0: it is whole.
    WindingEstimate at(const Vec3& p) const;

    /// Whether that is above ½: 1, or −1: below; 0: at() does not tell either.
    int above_half(const Vec3& p) const;

    /// The nearest whole number of the displaced point's. Precondition: it is not within 2⁻²⁰ of halfway
    /// between two.
    std::int64_t rounded(const Vec3& p) const;

    const Filling& filling() const { return filling_; }
    /// Signed crossings of M and of F before a point, a whole number that changes at their triangles only.
    int crossings(const Vec3& p) const { return of_mesh_.crossings(p) + of_filling_.crossings(p); }

    std::uint64_t memory_bytes() const;

private:
    bool far(const Vec3& p) const;
    /// The first of some ever better values that accept(value) takes, or else at(p).
    template <class Accept>
    WindingEstimate estimate(const Vec3& p, Accept&& accept) const;

    std::uint64_t triangles_;
    Filling filling_;
    XRays of_mesh_, of_filling_;
    Vec3 centre_;
    double size_;  ///< the longest side of M's bounds
};

}  // namespace its::winding
