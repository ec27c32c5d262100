#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "verify/checks.h"

namespace its::verifier {
namespace {

/// A point of the box twice the root's size, in lattice units; every other one inside the root.
Vec3 random_point(const Lattice& lattice, std::uint64_t seed, std::uint64_t i) {
    const double side = lattice.cells();
    Vec3 p;
    for (int axis = 0; axis < 3; ++axis) {
        const double unit = random_unit(seed, 20 + std::uint64_t(axis), i);
        p[axis] = i & 1 ? side * unit : side * (2 * unit - 0.5);
    }
    return p;
}

/// f by its definition: the sum of the levels in the root cube; outside, the value at the nearest point of the
/// cube plus the distance to it. Lattice units.
double own_value(const View& view, const Vec3& point) {
    Point3 x = to_lattice(view.lattice(), point);
    const DoubleDouble last = view.lattice().cells();
    DoubleDouble squared;
    for (DoubleDouble& c : x) {
        const DoubleDouble inside = c < 0.0 ? 0.0 : last < c ? last : c;
        squared = squared + (c - inside) * (c - inside);
        c = inside;
    }
    return double(view.value(x) + (squared.high > 0 ? square_root(squared) : 0.0));
}

}  // namespace

void check_space(const Job& job, VerifyReport& report) {
    const Lattice& lattice = job.view.lattice();
    const std::uint64_t samples = std::min<std::uint64_t>(job.options.samples, 10'000);
    // A sum over K + 2 levels of interpolations, each with less than 32 roundings of values that are below four
    // times the root's side.
    const double tolerance = 32 * (lattice.depth + 2) * 4 * lattice.ulp();
    Stage stage(job.parts.until(1), "verify: evaluation", samples);
    std::vector<double> difference(samples);
    parallel_for(samples, 64, [&](std::uint64_t i) {
        const Vec3 p = lattice.from_lattice(random_point(lattice, job.options.seed, i));
        difference[i] = std::abs(job.value(p) / lattice.width - own_value(job.view, p));
        stage.advance(1);
    });
    std::uint64_t worst = 0, violations = 0;
    for (std::uint64_t i = 0; i < samples; ++i) {
        if (!(difference[i] <= tolerance)) ++violations;
        if (!(difference[i] <= difference[worst])) worst = i;
    }
    const double largest = samples ? difference[worst] : 0.0;
    const Vec3 at = lattice.from_lattice(random_point(lattice, job.options.seed, worst));
    report.checks.push_back(
        {"evaluation in space", violations == 0, false, samples, violations,
         (tolerance - largest) * lattice.width,
         fmt::format("points in and around the root cube: shipped and own f differ by at most {:.3g} "
                     "at {}",
                     largest * lattice.width, place(at))});
}

}  // namespace its::verifier
