#include <gtest/gtest.h>
#include <map>
#include <random>

#include "distance/grid_distance.h"
#include "distance/triangle_tree.h"
#include "geometry/vec3.h"
#include "octree/lattice.h"
#include "octree/voxelise.h"
#include "support/zoo.h"

namespace its {
namespace {

using Real = long double;

/// Distance to a triangle in extended precision: the interior's foot where it lies inside, else the nearest
/// edge.
Real exact_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto segment = [&](const Vec3& s, const Vec3& e) {
        Real dd = 0, pd = 0;
        for (int i = 0; i < 3; ++i) {
            const Real d = Real(e[i]) - s[i];
            dd += d * d;
            pd += (Real(p[i]) - s[i]) * d;
        }
        const Real t = dd > 0 ? std::clamp<Real>(pd / dd, 0, 1) : 0;
        Real sum = 0;
        for (int i = 0; i < 3; ++i) {
            const Real d = Real(p[i]) - s[i] - t * (Real(e[i]) - s[i]);
            sum += d * d;
        }
        return std::sqrt(sum);
    };
    Real best = std::min({segment(a, b), segment(b, c), segment(c, a)});
    Real ab[3], ac[3], ap[3], n[3];
    for (int i = 0; i < 3; ++i) {
        ab[i] = Real(b[i]) - a[i];
        ac[i] = Real(c[i]) - a[i];
        ap[i] = Real(p[i]) - a[i];
    }
    const auto cross3 = [](const Real* u, const Real* v, Real* w) {
        w[0] = u[1] * v[2] - u[2] * v[1];
        w[1] = u[2] * v[0] - u[0] * v[2];
        w[2] = u[0] * v[1] - u[1] * v[0];
    };
    const auto dot3 = [](const Real* u, const Real* v) { return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]; };
    cross3(ab, ac, n);
    const Real nn = dot3(n, n);
    if (nn <= 0) return best;
    Real w[3];
    cross3(ap, ac, w);
    const Real s = dot3(w, n) / nn;
    cross3(ab, ap, w);
    const Real t = dot3(w, n) / nn;
    if (s >= 0 && t >= 0 && s + t <= 1) best = std::min(best, std::abs(dot3(ap, n)) / std::sqrt(nn));
    return best;
}

struct Setting {
    octree::Lattice lattice;
    std::vector<Vec3> positions;
    octree::Octree octree;
};

Setting setting(const Mesh& mesh, int depth) {
    Setting s{octree::make_lattice(octree::bounds(mesh), depth), {}, {}};
    for (const Vec3& v : mesh.vertices) s.positions.push_back(s.lattice.to_lattice(v));
    s.octree = octree::make_octree(
        s.lattice.depth,
        octree::voxelise(s.positions, mesh.triangles, s.lattice.depth, s.lattice.point_error(), {}).cell);
    return s;
}

Vec3 position(const octree::Octree& octree, int level, std::uint64_t group, int point) {
    const octree::Cell at = octree::morton_decode(octree.levels[level].parent[group]);
    const double step = std::ldexp(1.0, level);
    return {step * (2.0 * at[0] + point % 3), step * (2.0 * at[1] + point / 3 % 3),
            step * (2.0 * at[2] + point / 9)};
}

void compare_with_brute_force(const Mesh& mesh, int depth, int samples) {
    const Setting s = setting(mesh, depth);
    const auto distance = distance::grid_distances(s.octree, s.positions, mesh.triangles, {});
    std::mt19937_64 random(3);
    for (int k = 0; k <= depth; ++k) {
        const std::uint64_t groups = s.octree.levels[k].groups();
        ASSERT_EQ(distance[k].size(), octree::group_points * groups);
        for (int i = 0; i < samples; ++i) {
            const std::uint64_t group = random() % groups;
            const int point = int(random() % octree::group_points);
            const Vec3 p = position(s.octree, k, group, point);
            Real expected = std::numeric_limits<Real>::infinity();
            for (const Triangle& t : mesh.triangles)
                expected = std::min(expected,
                                    exact_distance(p, s.positions[t[0]], s.positions[t[1]], s.positions[t[2]]));
            // docs/design/distance.md proves 42u × the size of the coordinates; a fifth of it is seldom
            // reached.
            ASSERT_NEAR(distance[k][octree::group_points * group + point], double(expected),
                        8 * unit_roundoff * s.lattice.cells())
                << "level " << k << " group " << group << " point " << point;
        }
    }
}

TEST(GridDistance, AgreesWithBruteForceOnTheZoo) {
    for (const auto& entry : zoo::all()) {
        SCOPED_TRACE(entry.name);
        const int samples = entry.mesh.triangles.size() > 5000 ? 10 : 100;
        for (const int depth : {0, 3, 6}) compare_with_brute_force(entry.mesh, depth, samples);
    }
}

TEST(GridDistance, AgreesWithBruteForceOnSlivers) {
    // Needles, near-degenerate and degenerate triangles of all sizes in one soup.
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> unit(-1, 1);
    Mesh mesh;
    for (std::uint32_t i = 0; i < 200; ++i) {
        const Vec3 a{unit(random), unit(random), unit(random)}, d{unit(random), unit(random), unit(random)};
        const double thin = std::pow(10.0, -double(i % 18));
        mesh.vertices.push_back(a);
        mesh.vertices.push_back(a + 0.3 * d);
        mesh.vertices.push_back(a + (0.3 * unit(random)) * d +
                                thin * Vec3{unit(random), unit(random), unit(random)});
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    compare_with_brute_force(mesh, 6, 300);
}

TEST(GridDistance, EqualPositionsHaveEqualBits) {
    for (const auto& entry : zoo::all()) {
        const Setting s = setting(entry.mesh, 5);
        const auto distance = distance::grid_distances(s.octree, s.positions, entry.mesh.triangles, {});
        std::map<std::array<double, 3>, double> known;
        for (int k = 0; k <= 5; ++k)
            for (std::uint64_t group = 0; group < s.octree.levels[k].groups(); ++group)
                for (int point = 0; point < octree::group_points; ++point) {
                    const Vec3 p = position(s.octree, k, group, point);
                    const double d = distance[k][octree::group_points * group + point];
                    const auto [it, is_new] = known.emplace(std::array{p.x, p.y, p.z}, d);
                    ASSERT_EQ(it->second, d) << entry.name << " level " << k;
                }
    }
}

}  // namespace
}  // namespace its
