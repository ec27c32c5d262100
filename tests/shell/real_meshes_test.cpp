// Containment by massive sampling over every usable mesh of ITS_TEST_MESHES; nothing to do where it is not set.

#include <gtest/gtest.h>
#include <filesystem>
#include <random>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"
#include "its/shell.h"
#include "support/zoo.h"

namespace its {
namespace {

class RealMeshes : public testing::TestWithParam<int> {};

/// Samples uniform by area, from as many independent streams as there are chunks; returns the range of f.
std::pair<double, double> sampled_range(const ThinShell& shell, const Mesh& mesh, std::uint64_t count) {
    std::vector<double> area(mesh.triangles.size() + 1, 0);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        const Vec3 a = mesh.vertices[t[0]];
        area[i + 1] = area[i] + norm(cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a));
    }
    constexpr std::uint64_t grain = 10000;
    std::vector<std::pair<double, double>> ranges(chunk_count(count, grain), {1e300, -1e300});
    for_chunks(count, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        std::mt19937_64 random(chunk);
        std::uniform_real_distribution<double> unit(0, 1);
        auto& [least, most] = ranges[chunk];
        for (std::uint64_t i = begin; i < end; ++i) {
            const auto at = std::upper_bound(area.begin() + 1, area.end(), unit(random) * area.back());
            const auto index =
                std::min<std::size_t>(std::size_t(at - area.begin() - 1), mesh.triangles.size() - 1);
            const Triangle& t = mesh.triangles[index];
            double u = unit(random), v = unit(random);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            const Vec3 a = mesh.vertices[t[0]];
            const double f = shell.value(a + u * (mesh.vertices[t[1]] - a) + v * (mesh.vertices[t[2]] - a));
            least = std::min(least, f);
            most = std::max(most, f);
        }
    });
    std::pair<double, double> all{1e300, -1e300};
    for (const auto& [least, most] : ranges) all = {std::min(all.first, least), std::max(all.second, most)};
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) {
            const double f = shell.value(mesh.vertices[v]);
            all = {std::min(all.first, f), std::max(all.second, f)};
        }
    return all;
}

TEST_P(RealMeshes, LieInTheirShells) {
    const auto files = zoo::real_mesh_files();
    if (files.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    for (const std::string& file : files) {
        SCOPED_TRACE(file);
        const Mesh mesh = read_mesh(file).mesh;
        BuildOptions options;
        options.depth = GetParam();
        const ThinShell shell = build(mesh, options);
        const auto [least, most] = sampled_range(shell, mesh, 200'000);
        EXPECT_GE(least, shell.info().epsilon_inner);
        EXPECT_LE(most, shell.info().epsilon_outer);
        EXPECT_LE(shell.info().thickness(), 2 * std::sqrt(3.0) * shell.info().cell_width)
            << "f is 0 somewhere near";
    }
}

INSTANTIATE_TEST_SUITE_P(Depths, RealMeshes, testing::Values(4, 5, 6, 7, 8));

}  // namespace
}  // namespace its
