// Closed meshes of ITS_TEST_MESHES against CGAL; where the two differ, exact predicates over all triangles
// decide: CGAL counts crossings of a ray modulo 2, which is not the winding number where parts overlap.

#include <gtest/gtest.h>

#include <filesystem>

#include "base/parallel.h"
#include "cgal/cgal.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "query/oracle.h"
#include "shell/shell_data.h"
#include "support/zoo.h"

namespace its {
namespace {

/// Half of them uniform in the mesh's box, half within `off` of the surface per axis.
std::vector<Vec3> random_points(const Mesh& mesh, double off, std::size_t count) {
    std::mt19937_64 random(77);
    const auto unit = [&] { return double(random() >> 11) * 0x1p-53; };
    const Box box = octree::bounds(mesh);
    std::vector<Vec3> points(count);
    for (std::size_t i = 0; i < count; ++i) {
        if (i % 2 == 0) {
            for (int axis = 0; axis < 3; ++axis)
                points[i][axis] = box.min[axis] + unit() * (box.max[axis] - box.min[axis]);
            continue;
        }
        const Triangle& t = mesh.triangles[random() % mesh.triangles.size()];
        double s = unit(), r = unit();
        if (s + r > 1) s = 1 - s, r = 1 - r;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = mesh.vertices[t[0]][axis];
            points[i][axis] = a + s * (mesh.vertices[t[1]][axis] - a) + r * (mesh.vertices[t[2]][axis] - a) +
                              (2 * unit() - 1) * off;
        }
    }
    return points;
}

void compare(const Mesh& mesh, const cgal::Sides& peer, int depth, std::size_t count) {
    BuildOptions options;
    options.depth = depth;
    const Query query(build(mesh, options));
    if (query.shell().info().sign != SignRule::winding) return;
    const std::vector<Vec3> points = random_points(mesh, 1e-3 * query.shell().info().cell_width, count);
    std::vector<std::int8_t> codes(points.size());
    query.classify(points, codes);
    std::atomic<std::uint64_t> overruled = 0, wrong = 0;
    parallel_for(points.size(), 1024, [&](std::uint64_t i) {
        const Vec3& p = points[i];
        if (codes[i] == peer.side(p)) return;
        if (overruled++ < 200 && Side(codes[i]) != test::brute_force_side(mesh, p, SignRule::winding)) ++wrong;
    });
    EXPECT_EQ(wrong, 0u);
    if (overruled > 0)
        std::cout << "  depth " << depth << ": CGAL says otherwise for " << overruled << " of " << count
                  << " points; all triangles agree with us\n";
}

void compare_all(const std::vector<int>& depths, std::size_t count) {
    const auto files = zoo::real_mesh_files();
    if (files.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    int compared = 0;
    for (const std::string& file : files) {
        SCOPED_TRACE(file);
        const Mesh mesh = read_mesh(file).mesh;
        const cgal::Sides peer(mesh);
        if (!peer.usable()) continue;
        ++compared;
        for (const int depth : depths) compare(mesh, peer, depth, count);
    }
    EXPECT_GT(compared, 5);
}

TEST(RealMeshes, AgreeWithCgal) {
    compare_all({6}, 4'000);
}

TEST(SlowRealMeshes, ManyPointsAgreeWithCgal) {
    compare_all({4, 7, 9}, 400'000);
}

}  // namespace
}  // namespace its
