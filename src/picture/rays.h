#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "geometry/vec3.h"
#include "its/mesh.h"

/// Rays against triangles, by Embree.
namespace its::picture {

struct Ray {
    Vec3 origin, direction;  ///< the direction is a unit vector
    double near = 0, far = 1e30;

    Vec3 at(double t) const { return origin + t * direction; }
};

/// Where a ray meets a triangle.
struct RayHit {
    double distance = 0;
    std::uint32_t body = 0;      ///< in the order of RayScene::add()
    std::uint32_t triangle = 0;  ///< of that body
    double u = 0, v = 0;         ///< weights of its second and third corner
};

/// What is kept of a body: the points with normal·x ≤ limit.
struct HalfSpace {
    Vec3 normal;
    double limit = 1e30;
};

/// Bodies of triangles in single precision: coordinates should be near 1. The structure is built by one thread
/// and for one set of instructions, so that the same rays give the same bits on every machine.
class RayScene {
public:
    RayScene();
    ~RayScene();
    RayScene(const RayScene&) = delete;
    RayScene& operator=(const RayScene&) = delete;

    /// Adds a body, copied; rays do not see what is outside of `kept`.
    void add(const Mesh& mesh, const HalfSpace& kept = {});
    /// To be called after all bodies are added; from then on rays may be shot by any number of threads.
    void commit();

    std::optional<RayHit> nearest(const Ray& ray) const;
    bool blocked(const Ray& ray) const;

private:
    struct Handles;
    std::unique_ptr<Handles> handles_;
};

}  // namespace its::picture
