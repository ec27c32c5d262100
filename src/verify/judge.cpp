#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <span>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "verify/checks.h"
#include "verify/weld.h"

namespace its {

bool VerifyReport::passed() const {
    return !checks.empty() && std::all_of(checks.begin(), checks.end(), [](const auto& c) { return c.passed; });
}

namespace verifier {

// 3 units for the conversion to lattice coordinates, 6 for each of the 6 planes of a cell: 39. Then at most
// 64 clips in coordinates of the cell, each 6 · 2⁻⁵³.
double piece_error(const Lattice& lattice, double width) {
    return 40 * lattice.ulp() / width + 64 * 6 * 0x1p-53;
}

// More than the 39 units that a vertex may be off.
double cell_dilation(const Lattice& lattice) {
    return 64 * lattice.ulp();
}

// A vertex that survives cutting by this is off by less than 3 + 12 · 6 = 75 units: the triangle meets the cell
// dilated by 111, less than the 132 that the file promises.
double certain_dilation(const Lattice& lattice) {
    return 36 * lattice.ulp();
}

// A piece is left when its bound is within a gap of an attained value that is inside the limit. The gap is
// coarse_gap plus the errors of both; |∂f/∂xᵢ| ≤ 1 for values of a distance, and those near M are at most 8
// cell widths; in larger cells all of it is as much larger, at most.
double proven_tolerance(const Lattice& lattice, double width) {
    return coarse_gap +
           width * (3 * piece_error(lattice) + 2 * 3 * (piece_error(lattice) + cell_dilation(lattice)) +
                    2 * 512 * 0x1p-53 * 8);
}

// A point of M as a caller gives it may be off by 4 roundings of its coordinates per axis; f has slopes of at
// most 1 along the axes: 12u·reach, which both ε and the attained value may have to allow for.
double tightness_tolerance(const Lattice& lattice) {
    return 1e-6 + 24 * 0x1p-53 * lattice.reach();
}

std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
    // SplitMix64's finalizer (Steele, Lea, Flood 2014), once for each word.
    const auto mix = [](std::uint64_t z) {
        z += 0x9e3779b97f4a7c15;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
        z = (z ^ z >> 27) * 0x94d049bb133111eb;
        return z ^ z >> 31;
    };
    return mix(mix(mix(seed) ^ stream) ^ counter);
}

std::string place(const Vec3& p) {
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", p.x, p.y, p.z);
}

namespace {

void check_usable(const Mesh& mesh) {
    if (mesh.triangles.empty()) throw InputError("verify: the mesh has no triangles");
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t]) {
            if (v >= mesh.vertices.size())
                throw InputError(fmt::format("verify: triangle {} uses vertex {}, which does not exist", t, v));
            if (!finite(mesh.vertices[v])) throw InputError(fmt::format("verify: vertex {} is not finite", v));
        }
}

void check_within_root(const Lattice& lattice, const Mesh& mesh) {
    const std::int64_t n = lattice.cells();
    const Vec3 low = lattice.position({0, 0, 0}), high = lattice.position({n, n, n});
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            for (int axis = 0; axis < 3; ++axis)
                if (mesh.vertices[v][axis] < low[axis] || mesh.vertices[v][axis] > high[axis])
                    throw InputError(
                        fmt::format("verify: vertex {} at {} is outside the shell's root cube; is this "
                                    "the mesh that the shell was built from?",
                                    v, place(mesh.vertices[v])));
}

Box bounds_of(const Mesh& mesh) {
    const Vec3& first = mesh.vertices[mesh.triangles[0][0]];
    Box box{first, first};
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            for (int axis = 0; axis < 3; ++axis) {
                box.min[axis] = std::min(box.min[axis], mesh.vertices[v][axis]);
                box.max[axis] = std::max(box.max[axis], mesh.vertices[v][axis]);
            }
    return box;
}

/// `auto` may have turned triangles around, by exchanging their second and third corners.
bool equal_but_for_turns(std::span<const Triangle> a, std::span<const Triangle> b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Triangle& s, const Triangle& t) {
        return s == t || s == Triangle{t[0], t[2], t[1]};
    });
}

}  // namespace

VerifyReport judge(const shell::ShellData& data, const Evaluation& value, const Mesh& given,
                   const VerifyOptions& options) {
    return run_call(options.run, "verify", [&](const Progress& progress) {
        VerifyReport report;
        Parts parts(progress);
        const std::optional<Arrays> arrays = check_structure(data, parts.until(0.05), report);
        if (!arrays) return report;  // the rest would read outside the arrays
        const double length = data.info.weld;
        check_usable(given);
        const Mesh after = length > 0 ? welded(given, length) : Mesh{};
        const Mesh& mesh = length > 0 ? after : given;
        check_within_root(arrays->view.lattice(), mesh);
        const bool same =
            data.mesh.vertices == mesh.vertices && equal_but_for_turns(mesh.triangles, data.mesh.triangles);
        Mesh directed = mesh;
        if (same) directed.triangles.assign(data.mesh.triangles.begin(), data.mesh.triangles.end());
        const Job job{*arrays,
                      arrays->view,
                      given,
                      mesh,
                      value,
                      options,
                      same,
                      directed,
                      bounds_of(mesh),
                      find_boundary(directed),
                      parts};
        check_description(job, report);
        check_samples(job, report);
        check_all_of_mesh(job, report);
        check_grid(job, report);
        check_space(job, report);
        return report;
    });
}

}  // namespace verifier
}  // namespace its
