#pragma once

#include <cstdint>

#include "geometry/vec3.h"

/// Bernstein–Bézier bounds of eight triangles at a time.
namespace its::geometry {

/// Triangles in local coordinates of their cells, with the cells' corner values.
struct alignas(64) FanBatch {
    static constexpr int lanes = 8;
    double corner[8][lanes];
    double p[3][lanes], q[3][lanes], r[3][lanes];
    double lower[lanes], upper[lanes], least[lanes], most[lanes];  ///< as in Bounds
    std::uint64_t tag[lanes];                                      ///< the caller's
    int size = 0;

    bool full() const { return size == lanes; }
    void add(const double* value, const Vec3& a, const Vec3& b, const Vec3& c, std::uint64_t number) {
        for (int i = 0; i < 8; ++i) corner[i][size] = value[i];
        for (int axis = 0; axis < 3; ++axis) {
            p[axis][size] = a[axis];
            q[axis][size] = b[axis];
            r[axis][size] = c[axis];
        }
        tag[size++] = number;
    }
    Vec3 vertex(const double (&v)[3][lanes], int i) const { return {v[0][i], v[1][i], v[2][i]}; }
};

/// The Bernstein hulls of all lanes; those past the end get some numbers.
void bound(FanBatch& batch);

}  // namespace its::geometry
