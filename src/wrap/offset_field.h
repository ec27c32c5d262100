#pragma once

#include <cstdint>

#include "distance/closest_point.h"
#include "its/inspect.h"
#include "mesh/arrays.h"
#include "winding/x_rays.h"

/// The function whose level sets wraps are cut from.
namespace its::wrapper {

/// The distance to M, negative inside: by exact winding numbers, or exact parities, where M is closed, and
/// nowhere else. It changes by no more than the way from one point to another.
class OffsetField {
public:
    /// \param mesh  must outlive this
    OffsetField(const mesh::Arrays& mesh, SignRule rule)
        : mesh_(mesh),
          rule_(rule),
          tree_(mesh.vertices, mesh.triangles),
          rays_(mesh.vertices, mesh.triangles) {}

    const distance::ClosestPointTree& tree() const { return tree_; }

    bool has_inside() const { return rule_ == SignRule::winding || rule_ == SignRule::even_odd; }

    /// Exact, for any point; of a point on M that of the displaced one.
    bool inside(const Vec3& p) const {
        if (!has_inside()) return false;
        const int crossings = rays_.crossings(p);
        return rule_ == SignRule::winding ? crossings >= 1 : crossings % 2 != 0;
    }

    /// The point of M that a search has found nearest to p.
    Vec3 nearest_point(const distance::Nearest& nearest, const Vec3& p) const;

private:
    mesh::Arrays mesh_;
    SignRule rule_;
    distance::ClosestPointTree tree_;
    winding::XRays rays_;
};

/// The rule for wraps of a mesh for which `chosen` is the rule for shells: holes are not filled, as a surface
/// across them would be far from M.
inline SignRule wrapping_rule(SignRule chosen) {
    return chosen == SignRule::generalized ? SignRule::unsigned_rule : chosen;
}

}  // namespace its::wrapper
