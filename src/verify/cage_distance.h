#pragma once

#include <cstdint>

#include "its/mesh.h"
#include "verify/pairs.h"

/// How far a triangle is from M, proven.
namespace its::verifier {

class CageDistance {
public:
    /// \param mesh   M; it and its boxes must outlive this
    /// \param reach  the largest coordinate of M and of all triangles asked about
    CageDistance(const Mesh& mesh, const Boxes& boxes, double reach);

    /// A lower bound of the distance between a triangle and M, or `limit` if it is no less.
    double lower(const Corners& triangle, double limit) const;

    /// An upper bound of the distances of its points from M: at most `limit`, or too large by `excess` at most
    /// and not above `allowed`, if so much can be found out.
    double upper(const Corners& triangle, double limit, double excess, double allowed) const;
    double distance(const Vec3& p) const { return locate(p).distance; }

private:
    struct Located {
        Vec3 at;
        std::uint32_t nearest;
        double distance;
    };
    Located locate(const Vec3& p) const;
    double distance_to(std::uint32_t triangle, const Vec3& p) const;

    const Mesh& mesh_;
    const Boxes& boxes_;
    double rounding_;
};

}  // namespace its::verifier
