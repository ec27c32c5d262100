#pragma once

#include <algorithm>

#include "its/mesh.h"
#include "picture/canvas.h"
#include "picture/rays.h"

namespace its::picture {

/// Looks along `forward`. In the plane at distance 1, a pixel is `pixel` wide and `corner` is the upper left
/// corner of the picture.
struct Camera {
    Vec3 eye, right, up, forward;
    Point2 corner;
    double pixel = 1;

    Ray through(const Point2& at) const;  ///< pixels, y downwards
    Point2 project(const Vec3& p) const;  ///< onto the plane at distance 1; y upwards
};

/// Looks at the origin from far away, without a place for the picture yet: see fit(). z is upwards.
/// \param azimuth, elevation  degrees, of the eye: from +x towards +y, above the plane of both
Camera orbit_camera(double azimuth, double elevation);

struct Extent {
    double low = 1e30, high = -1e30;
    void include(double v) { low = std::min(low, v), high = std::max(high, v); }
};

Extent extent_along(const Mesh& mesh, const Vec3& direction);

/// What a camera sees of a body, in the plane at distance 1.
struct Footprint {
    Extent x, y;
};

Footprint footprint(const Camera& camera, const Mesh& mesh);

/// Fits a body into a rectangle.
/// \param margin  around it, of its size
Camera fit(Camera camera, const Footprint& body, const PixelRect& rect, double margin);

}  // namespace its::picture
