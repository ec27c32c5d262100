#include "winding/mesh_winding.h"

#include <algorithm>
#include <cmath>

#include "geometry/box.h"

namespace its::winding {

namespace {

/// Estimates are asked for with these errors of their parts, one after the other; measured.
constexpr double tolerances[] = {0x1p-9, 0x1p-16};
/// With fewer edges their sum is cheaper than an estimate.
constexpr std::uint64_t few_edges = 32;

/// So many of its longest sides away the mesh has no angle to speak of: each triangle's solid angle is at most
/// its area, below size², over the square of the distance, at least (2⁴⁰ − 2)²·size².
constexpr double far_sizes = 0x1p40;

}  // namespace

MeshWinding::MeshWinding(std::span<const Vec3> vertices, std::span<const Triangle> triangles, bool cycle)
    : triangles_(triangles.size()),
      filling_(cycle ? mesh::Merged{} : mesh::merge(mesh::Arrays{vertices, triangles})),
      of_mesh_(vertices, triangles),
      of_filling_(filling_.surface().vertices, filling_.surface().triangles) {
    const Box box = geometry::bounds(vertices, triangles);
    centre_ = 0.5 * box.min + 0.5 * box.max;
    size_ = std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
}

bool MeshWinding::far(const Vec3& p) const {
    double most = 0;
    for (int axis = 0; axis < 3; ++axis) most = std::max(most, std::abs(0.5 * p[axis] - 0.5 * centre_[axis]));
    return most > 0.5 * far_sizes * size_;
}

WindingEstimate MeshWinding::at(const Vec3& p) const {
    if (filling_.empty()) return {double(of_mesh_.crossings(p)), 0};
    if (far(p)) return {0, 0x1p-80 * double(triangles_)};
    WindingEstimate boundary = filling_.boundary_term(p);
    if (boundary.error > 0.5 * winding_error) boundary = filling_.precise_boundary_term(p);
    const double value = double(of_mesh_.crossings(p)) + boundary.value;
    return {value, boundary.error + unit_roundoff * std::abs(value)};
}

template <class Accept>
WindingEstimate MeshWinding::estimate(const Vec3& p, Accept&& accept) const {
    if (filling_.edges() > few_edges && !far(p)) {
        const int whole = crossings(p);
        for (const double tolerance : tolerances) {
            const WindingEstimate of_filling = filling_.winding(p, tolerance);
            const WindingEstimate found{double(whole) - of_filling.value, of_filling.error + decision_gap};
            if (accept(found)) return found;
        }
    }
    return at(p);
}

int MeshWinding::above_half(const Vec3& p) const {
    if (filling_.empty()) return of_mesh_.crossings(p) >= 1 ? 1 : -1;
    const auto decides = [](const WindingEstimate& w) { return std::abs(w.value - 0.5) > w.error; };
    const WindingEstimate w = estimate(p, decides);
    if (!decides(w)) return 0;
    return w.value > 0.5 ? 1 : -1;
}

std::int64_t MeshWinding::rounded(const Vec3& p) const {
    if (filling_.empty()) return of_mesh_.crossings(p);
    const auto decides = [](const WindingEstimate& w) {
        return std::abs(w.value - std::round(w.value)) + w.error < 0.5;
    };
    return std::llround(estimate(p, decides).value);
}

std::uint64_t MeshWinding::memory_bytes() const {
    return sizeof(*this) + filling_.memory_bytes() + of_mesh_.memory_bytes() + of_filling_.memory_bytes();
}

}  // namespace its::winding
