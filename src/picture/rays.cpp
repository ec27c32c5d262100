#include "picture/rays.h"

#if ITS_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <algorithm>
#include <deque>
#include <string>

namespace its::picture {
namespace {

/// Embree reads 16 bytes for each vertex, hence the padding of its buffers; it does that by itself for those it
/// allocates.
struct Corner {
    float x, y, z;
};

/// Rejects hits outside of the body's half-space.
void keep_half_space(const RTCFilterFunctionNArguments* args) {
    const auto& kept = *static_cast<const HalfSpace*>(args->geometryUserPtr);
    const auto* ray = reinterpret_cast<const RTCRay*>(args->ray);  // N is 1: we shoot single rays only
    const double t = ray->tfar;
    const Vec3 at{ray->org_x + t * ray->dir_x, ray->org_y + t * ray->dir_y, ray->org_z + t * ray->dir_z};
    if (dot(kept.normal, at) > kept.limit) args->valid[0] = 0;
}

#if ITS_EMBREE == 3
void intersect(RTCScene scene, RTCRayHit& query) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &query);
}
void occlude(RTCScene scene, RTCRay& query) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, &query);
}
#else
void intersect(RTCScene scene, RTCRayHit& query) {
    rtcIntersect1(scene, &query);
}
void occlude(RTCScene scene, RTCRay& query) {
    rtcOccluded1(scene, &query);
}
#endif

RTCRay single_precision(const Ray& ray) {
    RTCRay r{};
    r.org_x = float(ray.origin.x), r.org_y = float(ray.origin.y), r.org_z = float(ray.origin.z);
    r.dir_x = float(ray.direction.x), r.dir_y = float(ray.direction.y), r.dir_z = float(ray.direction.z);
    r.tnear = float(ray.near), r.tfar = float(ray.far);
    r.mask = ~0u;
    return r;
}

}  // namespace

struct RayScene::Handles {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::deque<HalfSpace> kept;  // filters keep pointers to these

    ~Handles() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }

    void require(bool done) const {
        if (done) return;
        const RTCError error = rtcGetDeviceError(device);
        if (error == RTC_ERROR_OUT_OF_MEMORY) throw MemoryError("not enough memory to trace rays");
        throw Error("Embree cannot be used on this machine: error " + std::to_string(int(error)));
    }
    void require_no_error() const {
        const RTCError error = rtcGetDeviceError(device);
        if (error == RTC_ERROR_OUT_OF_MEMORY) throw MemoryError("not enough memory to trace rays");
        if (error != RTC_ERROR_NONE) throw Error("Embree failed: error " + std::to_string(int(error)));
    }
};

RayScene::RayScene() : handles_(std::make_unique<Handles>()) {
    // Not "threads=1": Embree would hold all of the process's parallel loops to one thread.
#ifdef ITS_SANITIZE_THREAD
    const char* const settings = "threads=1,isa=sse4.2";  // the sanitizer cannot see into Embree's threads
#else
    const char* const settings = "isa=sse4.2";
#endif
    handles_->device = rtcNewDevice(settings);
    handles_->require(handles_->device != nullptr);
    handles_->scene = rtcNewScene(handles_->device);
    handles_->require(handles_->scene != nullptr);
    rtcSetSceneFlags(handles_->scene, RTC_SCENE_FLAG_ROBUST);  // no gaps between triangles
}

RayScene::~RayScene() = default;

void RayScene::add(const Mesh& mesh, const HalfSpace& kept) {
    const RTCGeometry geometry = rtcNewGeometry(handles_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    handles_->require(geometry != nullptr);
    auto* const corners = static_cast<Corner*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Corner), mesh.vertices.size()));
    auto* const triangles = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), mesh.triangles.size()));
    if (!corners || !triangles) {
        rtcReleaseGeometry(geometry);
        throw MemoryError("not enough memory to trace rays");
    }
    std::transform(mesh.vertices.begin(), mesh.vertices.end(), corners, [](const Vec3& v) {
        return Corner{float(v.x), float(v.y), float(v.z)};
    });
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), triangles);
    if (kept.limit < 1e30) {
        rtcSetGeometryUserData(geometry, &handles_->kept.emplace_back(kept));
        rtcSetGeometryIntersectFilterFunction(geometry, keep_half_space);
        rtcSetGeometryOccludedFilterFunction(geometry, keep_half_space);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(handles_->scene, geometry);
    rtcReleaseGeometry(geometry);
    handles_->require_no_error();
}

void RayScene::commit() {
    rtcCommitScene(handles_->scene);
    handles_->require_no_error();
}

std::optional<RayHit> RayScene::nearest(const Ray& ray) const {
    RTCRayHit query{};
    query.ray = single_precision(ray);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    intersect(handles_->scene, query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return RayHit{query.ray.tfar, query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v};
}

bool RayScene::blocked(const Ray& ray) const {
    RTCRay query = single_precision(ray);
    occlude(handles_->scene, query);
    return query.tfar < 0;
}

}  // namespace its::picture
