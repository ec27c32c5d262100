#include <oneapi/tbb/task_arena.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include "peer_surfaces.h"

namespace its::bench {

PeerSurface volume_to_mesh(const Mesh& mesh, double voxel, double level, int threads, double& build_seconds,
                           float half_width) {
    openvdb::initialize();
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    for (const Vec3& v : mesh.vertices) points.emplace_back(float(v.x), float(v.y), float(v.z));
    for (const Triangle& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    std::vector<openvdb::Vec3s> vertices;
    std::vector<openvdb::Vec3I> faces;
    std::vector<openvdb::Vec4I> quads;
    PeerSurface result;
    oneapi::tbb::task_arena arena(threads);
    arena.execute([&] {
        const Timer build;
        const auto grid =
            openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles, half_width);
        build_seconds = build.seconds().processor;
        const Timer timer;
        openvdb::tools::volumeToMesh(*grid, vertices, faces, quads, level, 0.0);
        result.seconds = timer.seconds();
    });
    for (const auto& v : vertices) result.mesh.vertices.push_back({v.x(), v.y(), v.z()});
    for (const auto& t : faces) result.mesh.triangles.push_back({t[0], t[1], t[2]});
    for (const auto& q : quads) {
        result.mesh.triangles.push_back({q[0], q[1], q[2]});
        result.mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    return result;
}

}  // namespace its::bench
