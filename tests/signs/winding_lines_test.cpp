#include "signs/winding_lines.h"

#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "cgal/cgal.h"
#include "distance/triangle_tree.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "support/zoo.h"

namespace its {
namespace {

struct Setting {
    Mesh mesh;
    octree::Lattice lattice;
    octree::Voxels voxels;
};

Setting setting(const Mesh& mesh, int depth) {
    Setting s{mesh, octree::make_lattice(octree::bounds(mesh), depth), {}};
    std::vector<Vec3> positions;
    for (const Vec3& v : mesh.vertices) positions.push_back(s.lattice.to_lattice(v));
    s.voxels = octree::voxelise(positions, mesh.triangles, s.lattice.depth, s.lattice.point_error(), {});
    return s;
}

/// Sum of signed solid angles over 4π (Van Oosterom and Strackee 1983).
double solid_angle_winding(const Mesh& mesh, const Vec3& p) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - p, b = mesh.vertices[t[1]] - p, c = mesh.vertices[t[2]] - p;
        const double la = norm(a), lb = norm(b), lc = norm(c);
        sum += 2 *
               std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (4 * std::numbers::pi);
}

int winding_at(const signs::WindingLines& lines, std::int64_t x, std::int64_t y, std::int64_t z) {
    std::int32_t w[3];
    lines.winding(x, y, z, 1, w);
    return w[0];
}

TEST(Winding, EqualsTheSolidAngleSumOffTheSurface) {
    for (const auto& entry : zoo::all()) {
        if (!entry.closed_oriented) continue;
        const Setting s = setting(entry.mesh, 4);
        const signs::WindingLines lines(s.mesh, s.lattice, s.voxels, {});
        const distance::TriangleTree tree = distance::make_triangle_tree(s.mesh.vertices, s.mesh.triangles, 1);
        std::mt19937_64 random(5);
        int compared = 0;
        for (int i = 0; i < 2000; ++i) {
            const std::int64_t x = std::int64_t(random() % 33), y = std::int64_t(random() % 33),
                               z = std::int64_t(random() % 33);
            const Vec3 p = s.lattice.position({x, y, z});
            double squared = 1;
            for (std::uint64_t t = 0; t < s.mesh.triangles.size(); ++t)
                squared =
                    std::min(squared, distance::squared_distance(tree.block[t / 8], t % 8, p.x, p.y, p.z));
            if (squared < 1e-16) continue;  // on M
            const double w = solid_angle_winding(s.mesh, p);
            ASSERT_EQ(winding_at(lines, x, y, z), std::lround(w))
                << entry.name << ' ' << x << ' ' << y << ' ' << z;
            ++compared;
        }
        EXPECT_GT(compared, 1000) << entry.name;
    }
}

TEST(Winding, OfAReversedMeshIsNegated) {
    const Mesh mesh = zoo::torus(1, 0.4, 24, 12);
    const Setting a = setting(mesh, 4), b = setting(zoo::reversed(mesh), 4);
    const signs::WindingLines forward(a.mesh, a.lattice, a.voxels, {}),
        backward(b.mesh, b.lattice, b.voxels, {});
    int inside = 0;
    for (int x = 0; x <= 32; ++x)
        for (int y = 0; y <= 32; ++y)
            for (int z = 0; z <= 32; ++z) {
                ASSERT_EQ(winding_at(forward, x, y, z), -winding_at(backward, x, y, z));
                inside += winding_at(forward, x, y, z);
            }
    EXPECT_GT(inside, 100);
}

TEST(Winding, OfABoxAlignedWithTheLatticeIsConsistent) {
    // Every face lies in a lattice plane, every edge on a lattice line. Grid points on the box may go either
    // way, by the same displacement everywhere: winding 1 on a box shifted by it.
    const Setting s = setting(zoo::box({0, 0, 0}, {1, 1, 1}), 3);
    const signs::WindingLines lines(s.mesh, s.lattice, s.voxels, {});
    int count = 0;
    for (int x = 0; x <= 16; ++x)
        for (int y = 0; y <= 16; ++y)
            for (int z = 0; z <= 16; ++z) {
                const int w = winding_at(lines, x, y, z);
                ASSERT_TRUE(w == 0 || w == 1);
                ASSERT_EQ(w, x >= 4 && x < 12 && y >= 4 && y < 12 && z >= 4 && z < 12);
                count += w;
            }
    EXPECT_EQ(count, 8 * 8 * 8);
}

/// Compares the signs of random lattice points around the mesh with CGAL's answer, if CGAL takes the mesh.
void compare_with_cgal(const Mesh& mesh, int depth) {
    const cgal::Sides sides(mesh);
    if (!sides.usable() || sides.self_intersects()) return;  // CGAL counts parity, we count windings

    const Setting s = setting(mesh, depth);
    const signs::WindingLines lines(s.mesh, s.lattice, s.voxels, {});
    std::mt19937_64 random(9);
    const std::int64_t low = std::int64_t{1} << (depth - 1), span = (std::int64_t{1} << depth) + 1;
    for (int i = 0; i < 20000; ++i) {
        const std::int64_t x = low + std::int64_t(random() % std::uint64_t(span)),
                           y = low + std::int64_t(random() % std::uint64_t(span)),
                           z = low + std::int64_t(random() % std::uint64_t(span));
        const Vec3 p = s.lattice.position({x, y, z});
        const int side = sides.side(p);
        if (side == 0) continue;
        ASSERT_EQ(winding_at(lines, x, y, z) >= 1, side < 0);
    }
}

TEST(Winding, AgreesWithCgalOnClosedMeshes) {
    for (const auto& entry : zoo::all()) {
        if (!entry.closed_oriented || inspect(entry.mesh).signed_volume < 0)
            continue;  // CGAL takes all as outward
        SCOPED_TRACE(entry.name);
        compare_with_cgal(entry.mesh, 5);
    }
}

TEST(Winding, AgreesWithCgalOnRealMeshes) {
    const auto files = zoo::real_mesh_files();
    if (files.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    int compared = 0;
    for (const std::string& file : files) {
        const Mesh mesh = read_mesh(file).mesh;
        const MeshReport report = inspect(mesh);
        if (report.sign != SignRule::winding || report.signed_volume < 0) continue;
        SCOPED_TRACE(file);
        compare_with_cgal(mesh, 7);
        ++compared;
    }
    EXPECT_GT(compared, 0);
}

}  // namespace
}  // namespace its
