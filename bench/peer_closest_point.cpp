#include "peer_closest_point.h"

#include <embree3/rtcore.h>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace its::bench {
namespace {

struct Float3 {
    float x, y, z;
    friend Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Float3 operator*(float s, Float3 a) { return {s * a.x, s * a.y, s * a.z}; }
    friend float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
};

/// Closest point of a triangle by the Voronoi regions of its corners, edges and face, single precision as is
/// all of Embree.
Float3 closest_on_triangle(Float3 p, Float3 a, Float3 b, Float3 c) {
    const Float3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const float d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
                d6 = dot(ac, cp);
    if (d1 <= 0 && d2 <= 0) return a;
    if (d3 >= 0 && d4 <= d3) return b;
    if (d6 >= 0 && d5 <= d6) return c;
    const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    const float denominator = 1 / (va + vb + vc);
    return a + vb * denominator * ab + vc * denominator * ac;
}

class EmbreeIndex : public PeerIndex {
public:
    explicit EmbreeIndex(const Mesh& mesh) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        vertices_ = static_cast<Float3*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Float3), mesh.vertices.size()));
        triangles_ = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), mesh.triangles.size()));
        for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
            vertices_[i] = {float(mesh.vertices[i].x), float(mesh.vertices[i].y), float(mesh.vertices[i].z)};
        std::copy(mesh.triangles.begin(), mesh.triangles.end(), triangles_);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
        rtcCommitScene(scene_);
    }
    ~EmbreeIndex() override {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    EmbreeIndex(const EmbreeIndex&) = delete;
    EmbreeIndex& operator=(const EmbreeIndex&) = delete;

    double distance(const Vec3& p) const override {
        RTCPointQuery query{};
        query.x = float(p.x);
        query.y = float(p.y);
        query.z = float(p.z);
        query.radius = std::numeric_limits<float>::infinity();
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(scene_, &query, &context, visit, const_cast<EmbreeIndex*>(this));
        return query.radius;
    }

private:
    static bool visit(RTCPointQueryFunctionArguments* arguments) {
        const auto& self = *static_cast<const EmbreeIndex*>(arguments->userPtr);
        const Triangle& t = self.triangles_[arguments->primID];
        const Float3 p{arguments->query->x, arguments->query->y, arguments->query->z};
        const Float3 d =
            closest_on_triangle(p, self.vertices_[t[0]], self.vertices_[t[1]], self.vertices_[t[2]]) - p;
        const float length = std::sqrt(dot(d, d));
        if (length >= arguments->query->radius) return false;
        arguments->query->radius = length;
        return true;
    }

    RTCDevice device_;
    RTCScene scene_;
    Float3* vertices_ = nullptr;
    Triangle* triangles_ = nullptr;
};

class CgalIndex : public PeerIndex {
    using Kernel = CGAL::Simple_cartesian<double>;
    using Triangles = std::vector<Kernel::Triangle_3>;
    using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;

public:
    explicit CgalIndex(const Mesh& mesh) {
        const auto point = [](const Vec3& v) { return Kernel::Point_3(v.x, v.y, v.z); };
        for (const Triangle& t : mesh.triangles) {
            const Kernel::Triangle_3 triangle(point(mesh.vertices[t[0]]), point(mesh.vertices[t[1]]),
                                              point(mesh.vertices[t[2]]));
            if (!triangle.is_degenerate()) triangles_.push_back(triangle);
        }
        tree_.rebuild(triangles_.cbegin(), triangles_.cend());
        tree_.accelerate_distance_queries();
    }
    double distance(const Vec3& p) const override {
        return std::sqrt(tree_.squared_distance(Kernel::Point_3(p.x, p.y, p.z)));
    }

private:
    Triangles triangles_;
    CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree_;
};

template <class Index>
std::shared_ptr<PeerIndex> make(const Mesh& mesh) {
    return std::make_shared<Index>(mesh);
}

}  // namespace

std::vector<PeerClosestPoint> closest_point_peers() {
    return {{"Embree point query", make<EmbreeIndex>}, {"CGAL AABB tree", make<CgalIndex>}};
}

}  // namespace its::bench
