#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "verify/checks.h"

namespace its::verifier {
namespace {

/// What one chunk of samples found. Lattice units.
struct Tally {
    std::uint64_t samples = 0, outside = 0, wrong_value = 0, outside_local = 0, uncovered = 0;
    double low = infinity, high = -infinity;  ///< of the shipped f
    double margin = infinity;  ///< smallest distance to ε₁ or ε₂, point rounding allowed for
    double difference = 0;     ///< largest |shipped f − own f|
    double local_margin = infinity;
    Vec3 outside_at, local_at, difference_at;  ///< of the worst sample, mesh units

    void add(const Tally& o) {
        if (o.margin < margin) outside_at = o.outside_at;
        if (o.local_margin < local_margin) local_at = o.local_at;
        if (o.difference > difference) difference_at = o.difference_at;
        samples += o.samples, outside += o.outside, wrong_value += o.wrong_value;
        outside_local += o.outside_local, uncovered += o.uncovered;
        low = std::min(low, o.low), high = std::max(high, o.high);
        margin = std::min(margin, o.margin), local_margin = std::min(local_margin, o.local_margin);
        difference = std::max(difference, o.difference);
    }
};

class Sampler {
public:
    explicit Sampler(const Job& job)
        : job_(job),
          lattice_(job.view.lattice()),
          inner_(job.view.data().info.epsilon_inner / lattice_.width),
          outer_(job.view.data().info.epsilon_outer / lattice_.width),
          // γ; the division by w and the evaluation add less than 2⁻⁵¹ of a value ≤ 2^(K + 3).
          rounding_(job.view.data().info.rounding / lattice_.width) {}

    /// Looks at p, which is within `error` (per axis, mesh units) of M; exactly on M if that is zero.
    void sample(const Vec3& p, const Vec3& error, Tally& tally) const {
        ++tally.samples;
        const double shipped = job_.value(p) / lattice_.width;
        const Point3 x = to_lattice(lattice_, p);
        Cell cell;
        Point3 t;
        CellRange range[3];
        const bool exact = error == Vec3{};
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t i = locate(axis, p[axis]);
            cell[axis] = std::uint32_t(i);
            t[axis] = x[axis] - double(i);
            range[axis] = exact ? closed_cells(axis, i, p[axis]) : reach(x[axis], error[axis] / lattice_.width);
        }
        double corner[8];
        const CellEntry entry = job_.view.leaf(cell);
        job_.view.corners(cell, entry, corner);
        double width = 1;
        if (entry.marked && entry.level > 0) {
            width = std::ldexp(1.0, entry.level);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double low = width * double(cell[axis] >> entry.level);
                t[axis] = (1 / width) * (x[axis] - low);
            }
        }
        const double own = double(trilinear(corner, t));
        const double slack = displaced(corner, width, error);
        contain(p, shipped, slack, tally);
        const double difference = std::abs(shipped - own);
        if (!(difference <= rounding_ + 0x1p-51 * std::abs(own))) ++tally.wrong_value;
        if (difference > tally.difference) tally.difference = difference, tally.difference_at = p;
        local(p, own, slack + 0x1p-50 * std::abs(own), exact, range, tally);
    }

private:
    /// Cell with position(i) ≤ p < position(i + 1), exactly; the last one at the root's upper face.
    std::int64_t locate(int axis, double p) const {
        const std::int64_t last = std::int64_t(lattice_.cells()) - 1;
        std::int64_t i = std::int64_t(std::floor((p - lattice_.position(axis, 0)) / lattice_.width));
        i = std::clamp(i, std::int64_t{0}, last);
        while (i > 0 && lattice_.position(axis, i) > p) --i;
        while (i < last && lattice_.position(axis, i + 1) <= p) ++i;
        return i;
    }

    CellRange closed_cells(int axis, std::int64_t i, double p) const {
        return {i > 0 && lattice_.position(axis, i) == p ? i - 1 : i, i};
    }

    CellRange reach(const DoubleDouble& x, double error) const {
        const std::int64_t last = std::int64_t(lattice_.cells()) - 1;
        const double d = error + 4 * lattice_.ulp();
        return {std::clamp(std::int64_t(floor(x - d)), std::int64_t{0}, last),
                std::clamp(std::int64_t(floor(x + d)), std::int64_t{0}, last)};
    }

    /// How much f may differ between p and the point of M that it stands for. Twice the cell's slopes: the
    /// point may lie in a neighbour.
    double displaced(const double (&corner)[8], double width, const Vec3& error) const {
        const auto slope = slopes(corner);
        double sum = 0;
        for (int axis = 0; axis < 3; ++axis)
            sum += 2 * slope[std::size_t(axis)] / width * error[axis] / lattice_.width;
        return sum;
    }

    void contain(const Vec3& p, double shipped, double slack, Tally& tally) const {
        tally.low = std::min(tally.low, shipped);
        tally.high = std::max(tally.high, shipped);
        // The division by w is rounded; so are ε₁ and ε₂ in units of w.
        const double units = 0x1p-51 * std::abs(shipped);
        const double margin = std::min(outer_ - shipped, shipped - inner_) + slack + units;
        if (!(margin >= 0)) ++tally.outside;
        if (!(margin >= tally.margin)) tally.margin = margin, tally.outside_at = p;
    }

    /// A point of M must be within the local bounds of every closed cell that contains it; where rounding
    /// leaves open which one does, of some cell.
    void local(const Vec3& p, double f, double slack, bool exact, const CellRange (&range)[3],
               Tally& tally) const {
        const shell::SurfaceCells& surface = job_.view.data().surface;
        double worst = infinity, best = -infinity;
        for (std::int64_t z = range[2].low; z <= range[2].high; ++z)
            for (std::int64_t y = range[1].low; y <= range[1].high; ++y)
                for (std::int64_t x = range[0].low; x <= range[0].high; ++x) {
                    const CellEntry entry =
                        job_.view.leaf({std::uint32_t(x), std::uint32_t(y), std::uint32_t(z)});
                    if (!entry.marked) continue;
                    const double margin =
                        slack + std::min(surface.upper[entry.surface] - f, f - surface.lower[entry.surface]);
                    worst = std::min(worst, margin);
                    best = std::max(best, margin);
                }
        if (best == -infinity) {
            ++tally.uncovered;
            return;
        }
        const double margin = exact ? worst : best;
        if (!(margin >= 0)) ++tally.outside_local;
        if (margin < tally.local_margin) tally.local_margin = margin, tally.local_at = p;
    }

    const Job& job_;
    const Lattice& lattice_;
    double inner_, outer_, rounding_;
};

/// Per axis, the rounding of a point computed between corners of triangle t: differences, at most two products
/// and the sums come to less than 12 · 2⁻⁵³ of the largest coordinate.
Vec3 point_error(const Mesh& mesh, const Triangle& t) {
    Vec3 error;
    for (int axis = 0; axis < 3; ++axis) {
        double largest = 0;
        for (const std::uint32_t v : t) largest = std::max(largest, std::abs(mesh.vertices[v][axis]));
        error[axis] = 0x1p-49 * largest;
    }
    return error;
}

template <class F>
Tally in_chunks(const Job& job, const char* name, std::uint64_t count, std::uint64_t grain, F&& fn) {
    Stage stage(job.parts.next(0.05), name, count);
    Tally sum;
    const auto chunk = [&](std::uint64_t begin, std::uint64_t end) {
        Tally tally;
        for (std::uint64_t i = begin; i < end; ++i) fn(i, tally);
        stage.advance(end - begin);
        return tally;
    };
    fold_chunks(count, grain, chunk, [&](const Tally& tally) { sum.add(tally); });
    return sum;
}

Tally sample_area(const Job& job, const Sampler& sampler) {
    const Mesh& mesh = job.mesh;
    std::vector<double> until(mesh.triangles.size());
    double area = 0;
    for (std::size_t t = 0; t < until.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
        until[t] = area += norm(cross(q - p, r - p));
    }
    if (!(area > 0) || !std::isfinite(area)) return {};
    return in_chunks(job, "verify: samples", job.options.samples, 4096, [&](std::uint64_t i, Tally& tally) {
        const double at = random_unit(job.options.seed, 1, i) * area;
        const std::size_t t = std::min<std::size_t>(
            std::upper_bound(until.begin(), until.end(), at) - until.begin(), until.size() - 1);
        double s = random_unit(job.options.seed, 2, i), u = random_unit(job.options.seed, 3, i);
        if (s + u > 1) s = 1 - s, u = 1 - u;
        const auto& [a, b, c] = mesh.triangles[t];
        const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
        sampler.sample(p + s * (q - p) + u * (r - p), point_error(mesh, mesh.triangles[t]), tally);
    });
}

Tally sample_vertices(const Job& job, const Sampler& sampler) {
    std::vector<std::uint8_t> used(job.mesh.vertices.size());
    for (const Triangle& t : job.mesh.triangles)
        for (const std::uint32_t v : t) used[v] = 1;
    return in_chunks(job, "verify: vertices", used.size(), 4096, [&](std::uint64_t v, Tally& tally) {
        if (used[v]) sampler.sample(job.mesh.vertices[v], {}, tally);
    });
}

/// Lattice planes strictly between a and b, both lattice coordinates: first and number.
std::pair<std::int64_t, std::int64_t> planes_between(double a, double b) {
    const std::int64_t first = std::int64_t(std::floor(std::min(a, b))) + 1;
    const std::int64_t last = std::int64_t(std::ceil(std::max(a, b))) - 1;
    return {first, std::max<std::int64_t>(last - first + 1, 0)};
}

/// Edge midpoints, and every `stride`-th crossing of an edge with the lattice planes.
Tally sample_edges(const Job& job, const Sampler& sampler, std::uint64_t stride) {
    const Lattice& lattice = job.view.lattice();
    return in_chunks(job, "verify: edges", job.mesh.triangles.size(), 64, [&](std::uint64_t t, Tally& tally) {
        const Triangle& triangle = job.mesh.triangles[t];
        const Vec3 error = point_error(job.mesh, triangle);
        for (int side = 0; side < 3; ++side) {
            const Vec3 &a = job.mesh.vertices[triangle[side]], &b = job.mesh.vertices[triangle[(side + 1) % 3]];
            sampler.sample(a + 0.5 * (b - a), error, tally);
            const Vec3 la = lattice.to_lattice(a), lb = lattice.to_lattice(b);
            for (int axis = 0; axis < 3; ++axis) {
                const auto [first, number] = planes_between(la[axis], lb[axis]);
                for (std::int64_t i = first; i < first + number; i += std::int64_t(stride)) {
                    const double plane = lattice.position(axis, i);
                    const double s = (plane - a[axis]) / (b[axis] - a[axis]);
                    if (!(s >= 0 && s <= 1)) continue;  // a plane through an end, but for rounding
                    Vec3 p = a + s * (b - a);
                    p[axis] = plane;
                    sampler.sample(p, error, tally);
                }
            }
        }
    });
}

std::uint64_t count_crossings(const Job& job) {
    const Lattice& lattice = job.view.lattice();
    std::uint64_t count = 0;
    for (const Triangle& t : job.mesh.triangles)
        for (int side = 0; side < 3; ++side) {
            const Vec3 a = lattice.to_lattice(job.mesh.vertices[t[side]]);
            const Vec3 b = lattice.to_lattice(job.mesh.vertices[t[(side + 1) % 3]]);
            for (int axis = 0; axis < 3; ++axis)
                count += std::uint64_t(planes_between(a[axis], b[axis]).second);
        }
    return count;
}

}  // namespace

void check_samples(const Job& job, VerifyReport& report) {
    const Sampler sampler(job);
    const std::uint64_t crossings = count_crossings(job);
    // At most four crossings a sample, or 1,000.
    const std::uint64_t quarter = std::max<std::uint64_t>(job.options.samples, 250);
    const std::uint64_t stride = std::max<std::uint64_t>(chunk_count(chunk_count(crossings, 4), quarter), 1);
    Tally sum = sample_vertices(job, sampler);
    sum.add(sample_edges(job, sampler, stride));
    const std::uint64_t special = sum.samples;
    sum.add(sample_area(job, sampler));

    const double w = job.width();
    report.sampled_min = sum.low * w;
    report.sampled_max = sum.high * w;
    const std::string edges = stride == 1 ? "all" : fmt::format("one in {} of the", stride);
    report.checks.push_back(
        {"G1 containment, sampled", sum.outside == 0, false, sum.samples, sum.outside, sum.margin * w,
         fmt::format("{} points uniform by area, {} vertices, edge midpoints and {} lattice "
                     "crossings of edges; closest to a bound at {}",
                     sum.samples - special, special, edges, place(sum.outside_at))});
    const double rounding = job.view.data().info.rounding;
    report.checks.push_back({"G1 evaluation", sum.wrong_value == 0, false, sum.samples, sum.wrong_value,
                             rounding - sum.difference * w,
                             fmt::format("shipped f against own f: largest difference {:.3g} at {}; "
                                         "γ = {:.3g}",
                                         sum.difference * w, place(sum.difference_at), rounding)});
    const std::uint64_t violations = sum.outside_local + sum.uncovered;
    report.checks.push_back({"local bounds, sampled", violations == 0, false, sum.samples, violations,
                             sum.local_margin * w,
                             fmt::format("{} samples outside the bounds of their cell, {} in no marked cell; "
                                         "closest to a bound at {}",
                                         sum.outside_local, sum.uncovered, place(sum.local_at))});
}

}  // namespace its::verifier
