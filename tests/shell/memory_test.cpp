#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

#include "its/shell.h"
#include "support/zoo.h"

namespace its {
namespace {

std::uint64_t peak_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::uint64_t(usage.ru_maxrss) * 1024;
}

/// What a build adds to the peak of a process that does nothing else.
std::uint64_t bytes_taken(const Mesh& mesh, int depth) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) return 0;
    const pid_t child = fork();
    if (child == 0) {
        const std::uint64_t before = peak_bytes();
        const ThinShell shell = build(mesh, {.depth = depth, .run = {.threads = 1}});
        const std::uint64_t taken = shell.info().surface_cells > 0 ? peak_bytes() - before : 0;
        _exit(write(ends[1], &taken, sizeof taken) == sizeof taken ? 0 : 1);
    }
    std::uint64_t taken = 0;
    close(ends[1]);
    if (read(ends[0], &taken, sizeof taken) != sizeof taken) taken = 0;
    close(ends[0]);
    waitpid(child, nullptr, 0);
    return taken;
}

/// Closed surfaces, smooth and with flat faces that are not aligned with the lattice's planes.
TEST(Memory, EstimatesAreWithin15PercentAtDepth9) {
#ifdef ITS_SANITIZED
    GTEST_SKIP() << "sanitizers take memory of their own";
#endif
    Mesh turned = zoo::box({-1, -0.3, -0.5}, {1, 0.3, 0.5});
    for (Vec3& v : turned.vertices)
        v = {0.8 * v.x - 0.6 * v.y, 0.6 * v.x + 0.8 * v.y, 0.28 * v.x + 0.96 * v.z + 0.1 * v.y};
    const std::pair<const char*, Mesh> meshes[] = {
        {"sphere", zoo::sphere({0.1, 0.2, 0.3}, 1, 5)}, {"torus", zoo::torus(1, 0.4, 96, 48)}, {"box", turned}};
    for (const auto& [name, mesh] : meshes) {
        const double estimate = double(estimate_memory(mesh, 9)), taken = double(bytes_taken(mesh, 9));
        EXPECT_GT(estimate, 0.85 * taken) << name << " takes " << taken;
        EXPECT_LT(estimate, 1.15 * taken) << name << " takes " << taken;
    }
}

}  // namespace
}  // namespace its
