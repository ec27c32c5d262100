#include "wrap/offset_field.h"

#include "geometry/vec3.h"

namespace its::wrapper {

Vec3 OffsetField::nearest_point(const distance::Nearest& nearest, const Vec3& p) const {
    const std::array<double, 3> weight = tree_.barycentric(nearest, p);
    const Triangle& t = mesh_.triangles[nearest.triangle];
    const Vec3& a = mesh_.vertices[t[0]];
    return a + weight[1] * (mesh_.vertices[t[1]] - a) + weight[2] * (mesh_.vertices[t[2]] - a);
}

}  // namespace its::wrapper
