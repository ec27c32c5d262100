#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/MeshToVolume.h>

#include "peer_inside.h"

namespace its::bench {

namespace {

class Sampler : public InsidePeer {
public:
    Sampler(const Mesh& mesh, double voxel) {
        openvdb::initialize();
        std::vector<openvdb::Vec3s> points;
        std::vector<openvdb::Vec3I> triangles;
        for (const Vec3& v : mesh.vertices)
            points.emplace_back(float(v.x / voxel), float(v.y / voxel), float(v.z / voxel));
        for (const Triangle& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
        const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points,
                                                                                                 triangles);
        grid_ = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
            adapter, *openvdb::math::Transform::createLinearTransform(voxel), 3, 3);
    }

    void classify(std::span<const Vec3> points, std::span<std::int8_t> out) const override {
        openvdb::FloatGrid::ConstAccessor accessor = grid_->getConstAccessor();
        const openvdb::tools::GridSampler<openvdb::FloatGrid::ConstAccessor, openvdb::tools::BoxSampler>
            sampler(accessor, grid_->transform());
        for (std::size_t i = 0; i < points.size(); ++i)
            out[i] = sampler.wsSample({points[i].x, points[i].y, points[i].z}) < 0 ? -1 : 1;
    }

private:
    openvdb::FloatGrid::Ptr grid_;
};

}  // namespace

std::unique_ptr<InsidePeer> openvdb_sampler(const Mesh& mesh, double voxel) {
    return std::make_unique<Sampler>(mesh, voxel);
}

}  // namespace its::bench
