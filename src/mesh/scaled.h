#pragma once

#include <vector>

#include "geometry/scaling.h"
#include "mesh/arrays.h"

/// Meshes of any size as meshes of common sizes.
namespace its::mesh {

/// The largest magnitude among the coordinates of vertices that triangles use.
/// \throws as require_usable()
double largest_coordinate(const Arrays& mesh);

/// A mesh times a power of two, exactly; the caller's own arrays where its size is common.
class Scaled {
public:
    /// \throws as require_usable(); InputError if a coordinate is so small beside the largest that no power of
    /// two keeps both
    explicit Scaled(const Arrays& mesh);
    /// By this power of two; digits below the least double are rounded.
    Scaled(const Arrays& mesh, geometry::Scaling scaling);
    Scaled(const Scaled&) = delete;
    Scaled& operator=(const Scaled&) = delete;

    const Arrays& arrays() const { return arrays_; }
    const geometry::Scaling& scaling() const { return scaling_; }

private:
    void scale(const Arrays& mesh);

    geometry::Scaling scaling_;
    std::vector<Vec3> vertices_;
    Arrays arrays_;
};

}  // namespace its::mesh
