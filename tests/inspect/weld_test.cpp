// Welding: corners nearer than a length become one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/query.h"
#include "its/shell.h"
#include "its/verify.h"
#include "its/weld.h"
#include "support/zoo.h"

namespace its {
namespace {

/// Each triangle with corners of its own, moved by less than `distance` on each axis.
Mesh cracked(const Mesh& mesh, double distance, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> off(-distance, distance);
    Mesh out;
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) {
            const Vec3& p = mesh.vertices[v];
            out.vertices.push_back({p.x + off(random), p.y + off(random), p.z + off(random)});
        }
        const auto n = std::uint32_t(out.vertices.size());
        out.triangles.push_back({n - 3, n - 2, n - 1});
    }
    return out;
}

/// By definition: all pairs, joined until nothing changes.
std::vector<std::uint32_t> clusters_by_pairs(const Mesh& mesh, double length) {
    std::vector<std::uint32_t> cluster(mesh.vertices.size());
    for (std::uint32_t i = 0; i < cluster.size(); ++i) cluster[i] = i;
    for (bool changed = true; changed;) {
        changed = false;
        for (std::uint32_t i = 0; i < cluster.size(); ++i)
            for (std::uint32_t j = 0; j < i; ++j)
                if (cluster[i] != cluster[j] && norm(mesh.vertices[i] - mesh.vertices[j]) < length) {
                    const std::uint32_t low = std::min(cluster[i], cluster[j]);
                    cluster[i] = cluster[j] = low;
                    changed = true;
                }
    }
    return cluster;
}

TEST(Weld, AgreesWithAllPairs) {
    for (const double length : {0.02, 0.1, 0.3, 1.0, 7.0})
        for (std::uint64_t seed = 0; seed < 4; ++seed) {
            const Mesh mesh = zoo::soup(60, seed);
            const Mesh welded = weld(mesh, length).mesh;
            const std::vector<std::uint32_t> cluster = clusters_by_pairs(mesh, length);
            ASSERT_EQ(welded.vertices, mesh.vertices);
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
                for (std::size_t k = 0; k < 3; ++k)
                    EXPECT_EQ(welded.triangles[t][k], cluster[mesh.triangles[t][k]]) << length << ' ' << seed;
        }
}

TEST(Weld, ClosesCracksAndWeldingAgainChangesNothing) {
    const Mesh solid = zoo::sphere({0, 0, 0}, 1, 3), mesh = cracked(solid, 1e-4, 1);
    EXPECT_NE(inspect(mesh).sign, SignRule::winding);
    const Welded welded = weld(mesh, 1e-3);
    EXPECT_EQ(welded.report.clusters, solid.vertices.size());
    EXPECT_EQ(welded.report.corners, 3 * solid.triangles.size());
    EXPECT_EQ(welded.report.degenerate, 0u);
    EXPECT_LT(welded.report.largest_move, 1e-3);
    const MeshReport report = inspect(welded.mesh);
    EXPECT_EQ(report.sign, SignRule::winding);
    EXPECT_EQ(report.vertices, solid.vertices.size());
    const Welded again = weld(welded.mesh, 1e-3);
    EXPECT_EQ(again.mesh.triangles, welded.mesh.triangles);
    EXPECT_EQ(again.report.corners, 0u);
}

TEST(Weld, ShellsAreOfTheWeldedMeshAndSayIt) {
    const Mesh mesh = cracked(zoo::box({0, 0, 0}, {1, 2, 3}), 1e-5, 3);
    const ThinShell shell = build(mesh, {.depth = 5, .weld = 1e-3});
    EXPECT_EQ(shell.info().weld, 1e-3);
    EXPECT_EQ(shell.info().sign, SignRule::winding);
    EXPECT_TRUE(shell.info().mesh_closed);
    EXPECT_EQ(Query(shell).classify({0.5, 1, 1.5}), Side::inside);
    const VerifyReport report = verify(shell, mesh, {.samples = 5000, .complete = true});
    for (const VerifyCheck& check : report.checks)
        EXPECT_TRUE(check.passed) << check.name << ": " << check.detail;
    EXPECT_FALSE(verify(shell, zoo::box({0, 0, 0}, {1, 2, 3}), {.samples = 100}).passed()) << "another mesh";
    EXPECT_NE(input_hash(mesh, {.depth = 5}), input_hash(mesh, {.depth = 5, .weld = 1e-3}));
}

TEST(Weld, TheVerifierJoinsTheSameCorners) {
    for (const double length : {0.05, 0.2, 0.6}) {
        const Mesh mesh = zoo::joined(zoo::soup(80, 5), zoo::sphere({0.5, 0.5, 0.5}, 0.4, 2));
        const ThinShell shell = build(mesh, {.depth = 3, .sign = SignRule::unsigned_rule, .weld = length});
        EXPECT_TRUE(verify(shell, mesh, {.samples = 500}).passed()) << length;
    }
}

TEST(Weld, RefusesWhatIsNoLength) {
    const Mesh mesh = zoo::tetrahedron();
    EXPECT_THROW(weld(mesh, -1), OptionError);
    EXPECT_THROW(weld(mesh, std::numeric_limits<double>::quiet_NaN()), OptionError);
    EXPECT_THROW(weld(mesh, std::numeric_limits<double>::infinity()), OptionError);
    EXPECT_THROW(weld(mesh, 1e-30), InputError) << "coordinates do not resolve it";
    EXPECT_THROW(build(mesh, {.weld = -1}), OptionError);
    EXPECT_EQ(weld(mesh, 0).mesh.triangles, mesh.triangles);
    const Welded all = weld(mesh, 100);
    EXPECT_EQ(all.report.clusters, 1u);
    EXPECT_EQ(all.report.degenerate, mesh.triangles.size());
}

}  // namespace
}  // namespace its
