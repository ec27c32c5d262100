#include <algorithm>
#include <limits>
#include <mutex>
#include <utility>

#include "base/parallel.h"
#include "geometry/far.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "shell/access.h"

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

struct ThinShell::Data {
    Data(ShellData arrays, const BuildSeconds& build_seconds)
        : shell(std::move(arrays)), seconds(build_seconds) {}

    ShellData shell;
    BuildSeconds seconds;
    mutable std::once_flag copied;
    mutable Mesh copy;  ///< of the mesh, made at the first call that asks for it
};

ThinShell shell::Access::make(ShellData data, const BuildSeconds& seconds) {
    return ThinShell(std::make_shared<const ThinShell::Data>(std::move(data), seconds));
}

const ShellData& shell::Access::data(const ThinShell& shell) {
    return shell.data_->shell;
}

ThinShell::ThinShell(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

const ShellInfo& ThinShell::info() const {
    return data_->shell.info;
}

const BuildSeconds& ThinShell::build_seconds() const {
    return data_->seconds;
}

MeshView ThinShell::mesh_view() const {
    const MeshArrays& mesh = data_->shell.mesh;
    return {ArrayView(std::span(mesh.vertices)), ArrayView(std::span(mesh.triangles))};
}

const Mesh& ThinShell::mesh() const {
    std::call_once(data_->copied, [&] { data_->copy = to_mesh(mesh_view()); });
    return data_->copy;
}

double ThinShell::value(const Vec3& point) const {
    if (!finite(point)) return std::numeric_limits<double>::quiet_NaN();
    const Vec3 u = data_->shell.lattice.to_lattice(point);
    const Vec3 in = clamped(u, data_->shell.lattice.cells());
    const field::TrilinearCell cell = field::locate(data_->shell.octree, data_->shell.field, in);
    const double inner = geometry::trilinear(cell.value, local(cell, in));
    const double width = data_->shell.lattice.width;
    if (!geometry::far_beyond(u)) return width * (inner + norm(u - in));
    return width * inner + geometry::norm_at_any_size(geometry::beyond(point, data_->shell.info.root));
}

Vec3 ThinShell::gradient(const Vec3& point) const {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (!finite(point)) return {nan, nan, nan};
    const Vec3 u = data_->shell.lattice.to_lattice(point);
    const Vec3 in = clamped(u, data_->shell.lattice.cells());
    const field::TrilinearCell cell = field::locate(data_->shell.octree, data_->shell.field, in);
    Vec3 gradient;
    geometry::trilinear_with_gradient(cell.value, local(cell, in), gradient);
    gradient = (1.0 / cell.width) * gradient;
    // Outside: f(clamp(u)) no longer changes along an axis that is clamped; the distance does.
    geometry::set_beyond(gradient,
                         geometry::far_beyond(u) ? geometry::beyond(point, data_->shell.info.root) : u - in);
    return gradient;
}

std::uint64_t ThinShell::grid_points(const Run& run) const {
    return with_threads(run.threads, [&] {
        return data_->shell.grid_points > 0 ? data_->shell.grid_points
                                            : octree::count_grid_points(data_->shell.octree);
    });
}

}  // namespace its
