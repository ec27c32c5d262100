#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "its/mesh_file.h"
#include "its/shell.h"
#include "support/zoo.h"

namespace its {
namespace {

std::uint64_t peak_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::uint64_t(usage.ru_maxrss) * 1024;
}

/// The result of a function that is called in a process of its own, which leaves this one's memory as it is.
template <class F>
std::uint64_t in_a_process(F&& number) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) return 0;
    const pid_t child = fork();
    if (child == 0) {
        const std::uint64_t result = number();
        _exit(write(ends[1], &result, sizeof result) == sizeof result ? 0 : 1);
    }
    std::uint64_t result = 0;
    close(ends[1]);
    if (read(ends[0], &result, sizeof result) != sizeof result) result = 0;
    close(ends[0]);
    waitpid(child, nullptr, 0);
    return result;
}

/// What a build adds to the peak of a process that does nothing else.
std::uint64_t bytes_taken(const Mesh& mesh, int depth) {
    return in_a_process([&]() -> std::uint64_t {
        const std::uint64_t before = peak_bytes();
        const ThinShell shell = build(mesh, {.depth = depth, .run = {.threads = 1}});
        return shell.info().surface_cells > 0 ? peak_bytes() - before : 0;
    });
}

void expect_within_15_percent(const std::string& name, const Mesh& mesh) {
    constexpr int depth = 9;
    const double taken = double(bytes_taken(mesh, depth)),
                 estimate = double(in_a_process([&] { return estimate_memory(mesh, depth, {.threads = 1}); }));
    EXPECT_GT(estimate, 0.85 * taken) << name << " takes " << taken;
    EXPECT_LT(estimate, 1.15 * taken) << name << " takes " << taken;
}

Mesh turned_box() {
    Mesh mesh = zoo::box({-1, -0.3, -0.5}, {1, 0.3, 0.5});
    for (Vec3& v : mesh.vertices)
        v = {0.8 * v.x - 0.6 * v.y, 0.6 * v.x + 0.8 * v.y, 0.28 * v.x + 0.96 * v.z + 0.1 * v.y};
    return mesh;
}

/// Half of a sphere: the hole is as wide as the mesh.
Mesh bowl() {
    Mesh mesh = zoo::sphere({0.1, 0.2, 0.3}, 1, 5);
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.vertices[v].z > 0.5; });
    });
    return mesh;
}

/// Surfaces that are smooth, with flat faces that are not aligned with the lattice's planes, and that are;
/// there twice, with walls of a cell or so, with boundary, in pieces, and with a hole that cells close.
TEST(Memory, EstimatesAreWithin15PercentAtDepth9) {
#ifdef ITS_SANITIZED
    GTEST_SKIP() << "sanitizers take memory of their own";
#endif
    const Mesh torus = zoo::torus(1, 0.4, 96, 48), sphere = zoo::sphere({0.1, 0.2, 0.3}, 1, 5);
    const std::pair<const char*, Mesh> meshes[] = {
        {"sphere", sphere},
        {"torus", torus},
        {"box", turned_box()},
        {"plate", zoo::plate(0.5)},
        {"twice", zoo::joined(torus, torus)},
        {"walls", zoo::joined(sphere, zoo::reversed(zoo::sphere({0.1, 0.2, 0.3}, 0.996, 5)))},
        {"triangle", zoo::single_triangle()},
        {"soup", zoo::soup(4000, 7)},
        {"bowl", bowl()},
    };
    for (const auto& [name, mesh] : meshes) expect_within_15_percent(name, mesh);
}

TEST(SlowMemory, EstimatesOfRealMeshesAreWithin15PercentAtDepth9) {
#ifdef ITS_SANITIZED
    GTEST_SKIP() << "sanitizers take memory of their own";
#endif
    const std::vector<std::string> files = zoo::real_mesh_files();
    if (files.empty()) GTEST_SKIP() << "ITS_TEST_MESHES is not set";
    for (const std::string& file : files) {
        malloc_trim(0);  // what was freed would be taken again without being counted
        expect_within_15_percent(file, read_mesh(file).mesh);
    }
}

}  // namespace
}  // namespace its
