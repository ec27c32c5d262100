#include "picture/camera.h"

#include <cmath>
#include <numbers>

#include "geometry/vec3.h"

namespace its::picture {

namespace {

constexpr double eye_distance = 4.2;  // a long lens, for a scene of size 1

}  // namespace

Ray Camera::through(const Point2& at) const {
    const double x = corner.x + at.x * pixel, y = corner.y - at.y * pixel;
    const Vec3 direction = forward + x * right + y * up;
    return {eye, (1 / norm(direction)) * direction};
}

Point2 Camera::project(const Vec3& p) const {
    const Vec3 v = p - eye;
    const double depth = dot(v, forward);
    return {dot(v, right) / depth, dot(v, up) / depth};
}

Camera orbit_camera(double azimuth, double elevation) {
    const double a = azimuth * std::numbers::pi / 180, e = elevation * std::numbers::pi / 180;
    Camera camera;
    camera.forward = {-std::cos(a) * std::cos(e), -std::sin(a) * std::cos(e), -std::sin(e)};
    camera.eye = -eye_distance * camera.forward;
    camera.right = {-std::sin(a), std::cos(a), 0};
    camera.up = cross(camera.right, camera.forward);
    return camera;
}

Extent extent_along(const Mesh& mesh, const Vec3& direction) {
    Extent extent;
    for (const Vec3& v : mesh.vertices) extent.include(dot(direction, v));
    return extent;
}

Footprint footprint(const Camera& camera, const Mesh& mesh) {
    Footprint f;
    for (const Vec3& v : mesh.vertices) {
        const Point2 p = camera.project(v);
        f.x.include(p.x), f.y.include(p.y);
    }
    return f;
}

Camera fit(Camera camera, const Footprint& f, const PixelRect& rect, double margin) {
    camera.pixel =
        std::max((f.x.high - f.x.low) / rect.width, (f.y.high - f.y.low) / rect.height) * (1 + 2 * margin);
    camera.corner = {0.5 * (f.x.low + f.x.high - camera.pixel * rect.width),
                     0.5 * (f.y.low + f.y.high + camera.pixel * rect.height)};
    return camera;
}

}  // namespace its::picture
