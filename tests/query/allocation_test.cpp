// Single queries take no memory: every operator new of this program is counted.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <random>
#include <vector>

#include "its/query.h"
#include "query/oracle.h"
#include "support/zoo.h"

namespace {
std::atomic<long> allocations = 0;
}

// Sanitizers have operators of their own, and must keep them.
#ifndef ITS_SANITIZED
// Never inlined: GCC would see free() take what some other operator new returned, and warn.
// NOLINTBEGIN(misc-definitions-in-headers)
[[gnu::noinline]] void* operator new(std::size_t size) {
    ++allocations;
    if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
    std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}
// NOLINTEND(misc-definitions-in-headers)
#endif

namespace its {
namespace {

TEST(Query, SingleCallsTakeNoMemory) {
#ifdef ITS_SANITIZED
    GTEST_SKIP() << "allocations are the sanitizer's";
#endif
    const Mesh mesh = zoo::torus(1.0, 0.35, 48, 20);
    BuildOptions options;
    options.depth = 5;
    const Query query(build(mesh, options));
    std::vector<Vec3> points = test::hard_points(query.shell(), mesh, 100, 1);
    std::erase_if(points, [](const Vec3& p) {  // there, exact predicates take big integers
        const auto tiny = [](double v) { return v != 0 && std::abs(v) < 1e-90; };
        return tiny(p.x) || tiny(p.y) || tiny(p.z);
    });
    ASSERT_GT(points.size(), 2000u);
    const long before = allocations;
    double sum = 0;
    for (const Vec3& p : points)
        sum += query.value(p) + query.gradient(p).x + query.signed_distance_bound(p).lower +
               double(query.classify(p)) + double(query.classify_shell(p));
    EXPECT_EQ(allocations - before, 0) << sum;
    const Query copy = query;  // NOLINT(performance-unnecessary-copy-initialization): copies share
    EXPECT_EQ(copy.classify({0, 0, 0}), Side::outside);
    EXPECT_EQ(allocations - before, 0);
}

TEST(Query, SingleCallsOnOpenMeshesTakeNoMemory) {
#ifdef ITS_SANITIZED
    GTEST_SKIP() << "allocations are the sanitizer's";
#endif
    Mesh mesh = zoo::torus(1.0, 0.35, 48, 20);
    mesh.triangles.erase(mesh.triangles.begin() + 100, mesh.triangles.begin() + 160);
    const Query query(build(mesh, {.depth = 5, .sign = SignRule::generalized}));
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> any(-1.5, 1.5);
    std::vector<Vec3> points = mesh.vertices;
    for (int i = 0; i < 3000; ++i) points.push_back({any(random), any(random), any(random)});
    const long before = allocations;
    double sum = 0;
    for (const Vec3& p : points)
        sum += double(query.classify(p)) + double(query.contains(p, true)) + query.winding_number(p).error;
    EXPECT_EQ(allocations - before, 0) << sum;
}

}  // namespace
}  // namespace its
