#include <algorithm>
#include <limits>
#include <mutex>
#include <utility>

#include "base/parallel.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "shell/shell_data.h"

namespace its {
using namespace shell;

namespace {

/// The nearest point of the root cube, in lattice coordinates.
Vec3 clamped(const Vec3& u, double cells) {
    return {std::clamp(u.x, 0.0, cells), std::clamp(u.y, 0.0, cells), std::clamp(u.z, 0.0, cells)};
}

Vec3 local(const field::TrilinearCell& cell, const Vec3& u) {
    return (1.0 / cell.width) * (u - cell.corner);
}

}  // namespace

/// What is made at the first call that asks for it.
struct ThinShell::Lazy {
    std::once_flag mesh_made;
    Mesh mesh;
};

ThinShell::ThinShell(std::shared_ptr<const ShellData> data)
    : data_(std::move(data)), lazy_(std::make_shared<Lazy>()) {}

const ShellInfo& ThinShell::info() const {
    return data_->info;
}
const Mesh& ThinShell::mesh() const {
    std::call_once(lazy_->mesh_made, [&] {
        const MeshArrays& mesh = data_->mesh;
        lazy_->mesh = {{mesh.vertices.begin(), mesh.vertices.end()},
                       {mesh.triangles.begin(), mesh.triangles.end()}};
    });
    return lazy_->mesh;
}

double ThinShell::value(const Vec3& point) const {
    if (!finite(point)) return std::numeric_limits<double>::quiet_NaN();
    const Vec3 u = data_->lattice.to_lattice(point);
    const Vec3 in = clamped(u, data_->lattice.cells());
    const field::TrilinearCell cell = field::locate(data_->octree, data_->field, in);
    return data_->lattice.width * (geometry::trilinear(cell.value, local(cell, in)) + norm(u - in));
}

Vec3 ThinShell::gradient(const Vec3& point) const {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (!finite(point)) return {nan, nan, nan};
    const Vec3 u = data_->lattice.to_lattice(point);
    const Vec3 in = clamped(u, data_->lattice.cells());
    const field::TrilinearCell cell = field::locate(data_->octree, data_->field, in);
    Vec3 gradient;
    geometry::trilinear_with_gradient(cell.value, local(cell, in), gradient);
    gradient = (1.0 / cell.width) * gradient;
    // Outside: f(clamp(u)) no longer changes along an axis that is clamped; the distance does.
    const Vec3 away = u - in;
    const double distance = norm(away);
    if (distance == 0) return gradient;
    for (int axis = 0; axis < 3; ++axis)
        gradient[axis] = away[axis] == 0 ? gradient[axis] : away[axis] / distance;
    return gradient;
}

std::uint64_t ThinShell::grid_points(const Run& run) const {
    return with_threads(run.threads, [&] {
        return data_->grid_points > 0 ? data_->grid_points : octree::count_grid_points(data_->octree);
    });
}

}  // namespace its
