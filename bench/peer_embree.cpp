#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "peer_inside.h"

namespace its::bench {

namespace {

struct Float3 {
    float x, y, z;
};
Float3 operator-(Float3 a, Float3 b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
float dot(Float3 a, Float3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Float3 cross(Float3 a, Float3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Float3 along(Float3 a, float t, Float3 d) {
    return {a.x + t * d.x, a.y + t * d.y, a.z + t * d.z};
}

/// A committed scene with one triangle geometry.
class Scene {
public:
    Scene(const Mesh& mesh, RTCFilterFunctionN filter, RTCPointQueryFunction query, void* user)
        : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* const v = static_cast<Float3*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Float3), mesh.vertices.size()));
        for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
            v[i] = {float(mesh.vertices[i].x), float(mesh.vertices[i].y), float(mesh.vertices[i].z)};
        auto* const t = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), mesh.triangles.size()));
        std::copy(mesh.triangles.begin(), mesh.triangles.end(), t);
        if (filter) rtcSetGeometryOccludedFilterFunction(geometry, filter);
        if (query) rtcSetGeometryPointQueryFunction(geometry, query);
        rtcSetGeometryUserData(geometry, user);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
        rtcCommitScene(scene_);
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
    ~Scene() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    RTCScene get() const { return scene_; }

private:
    RTCDevice device_;
    RTCScene scene_;
};

struct CountingContext {
    RTCIntersectContext context;
    int hits;
};

void count_hit(const RTCFilterFunctionNArguments* args) {
    ++reinterpret_cast<CountingContext*>(args->context)->hits;
    args->valid[0] = 0;  // go on
}

class Parity : public InsidePeer {
public:
    explicit Parity(const Mesh& mesh) : scene_(mesh, count_hit, nullptr, nullptr) {}

    void classify(std::span<const Vec3> points, std::span<std::int8_t> out) const override {
        for (std::size_t i = 0; i < points.size(); ++i) {
            CountingContext counting;
            rtcInitIntersectContext(&counting.context);
            counting.hits = 0;
            RTCRay ray{};
            ray.org_x = float(points[i].x);
            ray.org_y = float(points[i].y);
            ray.org_z = float(points[i].z);
            ray.dir_x = 0.0123f;  // a direction that hits few edges of models with axis-parallel faces
            ray.dir_y = 0.0456f;
            ray.dir_z = 1.0f;
            ray.tfar = std::numeric_limits<float>::infinity();
            ray.mask = ~0u;
            rtcOccluded1(scene_.get(), &counting.context, &ray);
            out[i] = counting.hits & 1 ? -1 : 1;
        }
    }

private:
    Scene scene_;
};

/// Closest point of a triangle (Ericson, Real-Time Collision Detection).
Float3 closest_on(Float3 p, Float3 a, Float3 b, Float3 c) {
    const Float3 ab = b - a, ac = c - a, ap = p - a;
    const float d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const Float3 bp = p - b;
    const float d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return along(a, d1 / (d1 - d3), ab);
    const Float3 cp = p - c;
    const float d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return along(a, d2 / (d2 - d6), ac);
    const float va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return along(b, (d4 - d3) / ((d4 - d3) + (d5 - d6)), c - b);
    const float scale = 1 / (va + vb + vc);
    return along(along(a, vb * scale, ab), vc * scale, ac);
}

struct Search {
    const Mesh* mesh;
    Float3 point;
    float squared;
    unsigned triangle;
    Float3 nearest;
};

Float3 vertex(const Mesh& mesh, std::uint32_t i) {
    return {float(mesh.vertices[i].x), float(mesh.vertices[i].y), float(mesh.vertices[i].z)};
}

bool visit_triangle(RTCPointQueryFunctionArguments* args) {
    auto& search = *static_cast<Search*>(args->userPtr);
    const Triangle& t = search.mesh->triangles[args->primID];
    const Float3 at = closest_on(search.point, vertex(*search.mesh, t[0]), vertex(*search.mesh, t[1]),
                                 vertex(*search.mesh, t[2]));
    const Float3 apart = search.point - at;
    const float squared = dot(apart, apart);
    if (squared >= search.squared) return false;
    search.squared = squared;
    search.triangle = args->primID;
    search.nearest = at;
    args->query->radius = std::sqrt(squared);
    return true;
}

class PointQuery : public InsidePeer {
public:
    explicit PointQuery(const Mesh& mesh) : mesh_(mesh), scene_(mesh, nullptr, visit_triangle, nullptr) {}

    void classify(std::span<const Vec3> points, std::span<std::int8_t> out) const override {
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Float3 p{float(points[i].x), float(points[i].y), float(points[i].z)};
            Search search{&mesh_, p, std::numeric_limits<float>::infinity(), 0, {}};
            RTCPointQuery query{p.x, p.y, p.z, 0.0f, std::numeric_limits<float>::infinity()};
            RTCPointQueryContext context;
            rtcInitPointQueryContext(&context);
            rtcPointQuery(scene_.get(), &query, &context, nullptr, &search);
            const Triangle& t = mesh_.triangles[search.triangle];
            const Float3 a = vertex(mesh_, t[0]);
            const Float3 normal = cross(vertex(mesh_, t[1]) - a, vertex(mesh_, t[2]) - a);
            out[i] = dot(normal, p - search.nearest) < 0 ? -1 : 1;
        }
    }

private:
    const Mesh& mesh_;
    Scene scene_;
};

}  // namespace

std::unique_ptr<InsidePeer> embree_parity(const Mesh& mesh) {
    return std::make_unique<Parity>(mesh);
}
std::unique_ptr<InsidePeer> embree_point_query(const Mesh& mesh) {
    return std::make_unique<PointQuery>(mesh);
}

}  // namespace its::bench
