#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "display/colour.h"
#include "its/shell.h"
#include "picture/camera.h"
#include "picture/canvas.h"
#include "picture/rays.h"

/// Draws bodies in a studio: one soft key light, a bright dome, a white floor. The scene is in units of s, z
/// upwards.
namespace its::picture {

/// A body of the scene, in the scene's coordinates.
struct Body {
    Mesh mesh;
    Box bounds;
    CornerValues<Vec3> normals;
    Light colour;
};

/// What a cut shows where a body is solid. Called for a point in the plane of the body's cut; nothing: not
/// solid.
/// \param footprint  what a pixel covers there
using CutFace = std::function<std::optional<Light>(const Vec3& point, double footprint)>;

/// A body in one picture, and how it is cut there.
struct Exhibit {
    const Body* body = nullptr;
    HalfSpace kept = {};
    CutFace face = {};
};

/// Bodies on the floor, ready to be drawn.
class Studio {
public:
    /// \param floor  its height
    /// \param reach  from the z axis, what the floor's shadows fade out at
    Studio(std::vector<Exhibit> exhibits, const Vec3& key_light, double floor, double reach);

    /// The light that comes along the ray: that of the paper where there is neither a body nor its shadow.
    /// \param pixel  width of a pixel at distance 1
    /// \param shadow  strength of shadows on the floor, 0 to 1
    /// \param random  four numbers in [0, 1)
    Light trace(const Ray& ray, double pixel, double shadow, const std::array<double, 4>& random) const;

private:
    struct Surface {
        Vec3 point, normal, facing;  ///< facing: of the triangle, towards the ray
        Light colour;
        double distance = 0;
    };
    std::optional<Surface> nearest(const Ray& ray, double pixel) const;
    Surface shade_triangle(const Ray& ray, const RayHit& hit) const;
    std::optional<double> cut_distance(const Exhibit& exhibit, const Ray& ray) const;
    bool blocked(const Ray& ray) const;
    Light illuminate(const Surface& surface, const Vec3& view, const std::array<double, 4>& random) const;
    Vec3 key_direction(double r1, double r2) const;  ///< towards a random point of the key light's disc
    Light trace_floor(const Ray& ray, double shadow, const std::array<double, 4>& random) const;

    std::vector<Exhibit> exhibits_;
    RayScene rays_;
    Vec3 key_light_, key_side_, key_up_;
    double floor_, reach_;
};

/// Draws into a rectangle of the picture, up to `samples` rays a pixel, in parallel. Shadows fade out at its
/// edges.
/// \throws Cancelled.
void draw_studio(Image& image, const PixelRect& rect, const Studio& studio, const Camera& camera, int samples,
                 const Progress& progress, std::string_view stage);

}  // namespace its::picture
