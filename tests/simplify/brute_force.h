#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "geometry/vec3.h"
#include "its/mesh.h"

/// Distances by the plainest means, sharing no code with the library.
namespace its::brute_force {

/// Distance from p to triangle abc (Ericson 2005, by the Voronoi regions of its features), in extended
/// precision.
template <class Real = long double>
double distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    struct V {
        Real x, y, z;
    };
    const auto sub = [](const V& u, const V& v) { return V{u.x - v.x, u.y - v.y, u.z - v.z}; };
    const auto dot3 = [](const V& u, const V& v) { return u.x * v.x + u.y * v.y + u.z * v.z; };
    const auto wide = [](const Vec3& v) { return V{v.x, v.y, v.z}; };
    const V q = wide(p), corner[3] = {wide(a), wide(b), wide(c)};
    Real best = 1e300;
    for (int k = 0; k < 3; ++k) {
        const V &u = corner[k], &v = corner[(k + 1) % 3];
        const V d = sub(v, u), w = sub(q, u);
        const Real length = dot3(d, d);
        Real t = length > 0 ? dot3(w, d) / length : Real(0);
        t = t < 0 ? Real(0) : t > 1 ? Real(1) : t;
        const V r = {w.x - t * d.x, w.y - t * d.y, w.z - t * d.z};
        best = dot3(r, r) < best ? dot3(r, r) : best;
    }
    const V ab = sub(corner[1], corner[0]), ac = sub(corner[2], corner[0]), ap = sub(q, corner[0]);
    const Real d00 = dot3(ab, ab), d01 = dot3(ab, ac), d11 = dot3(ac, ac), d20 = dot3(ap, ab),
               d21 = dot3(ap, ac), den = d00 * d11 - d01 * d01;
    if (den > 0) {
        const Real s = (d11 * d20 - d01 * d21) / den, t = (d00 * d21 - d01 * d20) / den;
        if (s >= 0 && t >= 0 && s + t <= 1) {
            const V r = {ap.x - s * ab.x - t * ac.x, ap.y - s * ab.y - t * ac.y, ap.z - s * ab.z - t * ac.z};
            best = dot3(r, r) < best ? dot3(r, r) : best;
        }
    }
    return double(std::sqrt((long double)best));
}

inline double distance(const Vec3& p, const Mesh& mesh) {
    double best = 1e300;
    for (const Triangle& t : mesh.triangles)
        best =
            std::min(best, distance<double>(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
    return best;
}

/// fn(point) for corners, edge midpoints and `count` random points of the mesh.
template <class F>
void for_points(const Mesh& mesh, int count, unsigned seed, F&& fn) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<double> area = {0};
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
        area.push_back(area.back() + norm(cross(b - a, c - a)));
        fn(a);
        fn(0.5 * (a + b));
        fn(0.5 * (b + c));
        fn(0.5 * (c + a));
    }
    for (int i = 0; i < count; ++i) {
        const double at = unit(random) * area.back();
        const auto k = std::size_t(std::upper_bound(area.begin() + 1, area.end() - 1, at) - area.begin() - 1);
        const Triangle& t = mesh.triangles[k];
        double u = unit(random), v = unit(random);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const Vec3 a = mesh.vertices[t[0]];
        fn(a + u * (mesh.vertices[t[1]] - a) + v * (mesh.vertices[t[2]] - a));
    }
}

}  // namespace its::brute_force
