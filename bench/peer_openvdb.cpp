#include "peer_openvdb.h"

#include <oneapi/tbb/task_arena.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

namespace its::bench {

std::uint64_t openvdb_mesh_to_volume(const Mesh& mesh, int threads) {
    static const bool initialized = [] {
        openvdb::initialize();
        return true;
    }();
    (void)initialized;
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    for (const Vec3& v : mesh.vertices) points.emplace_back(float(v.x), float(v.y), float(v.z));
    for (const Triangle& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    oneapi::tbb::task_arena arena(threads);
    return arena.execute([&] {
        const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points,
                                                                                                 triangles);
        return openvdb::tools::meshToVolume<openvdb::FloatGrid>(
                   adapter, *openvdb::math::Transform::createLinearTransform(1), 3, 3)
            ->activeVoxelCount();
    });
}

}  // namespace its::bench
