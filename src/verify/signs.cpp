#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "verify/checks.h"

namespace its::verifier {
namespace {

/// Point–triangle pairs that the check may cost at most: about ten seconds on two cores.
constexpr std::uint64_t work_limit = 500'000'000;

/// Winding numbers closer to ½ than this are not decided: the sum's rounding for 10⁷ triangles is far less.
constexpr double undecided_winding = 1e-6;

double distance_to_segment(const Vec3& a, const Vec3& b) {  // from the origin
    const Vec3 d = b - a;
    const double length2 = dot(d, d);
    const double t = length2 > 0 ? std::clamp(-dot(a, d) / length2, 0.0, 1.0) : 0.0;
    // From the nearer end, so that the rounding is that of the shorter part.
    return t < 0.5 ? norm(a + t * d) : norm(b - (1 - t) * d);
}

/// Distance of the origin from the triangle: the least of its edges' and, where the foot of the
/// perpendicular is inside, of its plane's.
double distance_to_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double edges =
        std::min({distance_to_segment(a, b), distance_to_segment(b, c), distance_to_segment(c, a)});
    const Vec3 n = cross(b - a, c - a);
    const double length = norm(n);
    if (!(length > 0)) return edges;
    // The foot is inside where the origin is on the inner side of the three planes through the edges along n.
    const bool inside =
        dot(cross(b - a, n), a) >= 0 && dot(cross(c - b, n), b) >= 0 && dot(cross(a - c, n), c) >= 0;
    return inside ? std::min(edges, std::abs(dot(n, a)) / length) : edges;
}

/// A vertex seen from the grid point.
struct Seen {
    Vec3 at;
    double distance = 0;
};

/// Sums solid angles (Van Oosterom, Strackee 1983): half of a triangle's is the argument of base + i·triple.
/// Small arguments are added by multiplying complex numbers 1 + i·tan, as long as they stay below a radian in
/// all.
class SolidAngle {
public:
    void add(const Seen& a, const Seen& b, const Seen& c) {
        const double triple = dot(a.at, cross(b.at, c.at));
        const double base = a.distance * b.distance * c.distance + dot(a.at, b.at) * c.distance +
                            dot(b.at, c.at) * a.distance + dot(c.at, a.at) * b.distance;
        if (triple == 0) {
            if (base < 0)
                half_ += std::numbers::pi;  // the grid point is in the triangle: left out by the caller
        } else if (base > 8 * std::abs(triple)) {
            const double t = triple / base;
            const double x = x_ - y_ * t, y = y_ + x_ * t;
            x_ = x, y_ = y;
            turned_ += std::abs(t);
            if (turned_ > 1) flush();
        } else {
            half_ += std::atan2(triple, base);
        }
    }

    double winding() {
        flush();
        return half_ / (2 * std::numbers::pi);
    }

private:
    void flush() {
        half_ += std::atan2(y_, x_);
        x_ = 1, y_ = 0, turned_ = 0;
    }

    double half_ = 0, x_ = 1, y_ = 0, turned_ = 0;
};

/// Whether a ray from the origin crosses an odd number of triangles; in another direction for each try, until
/// none of their edges comes within rounding of it.
class Parity {
public:
    Parity(std::uint64_t seed, std::uint64_t point) : seed_(seed), point_(point) { turn(); }

    /// \return false if this direction will not do: turn() and begin anew.
    bool add(const Vec3& a, const Vec3& b, const Vec3& c) {
        // The ray's line meets the triangle if it is on one side of the planes through the origin and each
        // edge.
        const double sides[] = {side(a, b), side(b, c), side(c, a)};
        const double low = std::min({sides[0], sides[1], sides[2]}),
                     high = std::max({sides[0], sides[1], sides[2]});
        const double length = norm(a) + norm(b) + norm(c), margin = 64 * 0x1p-53 * length * length;
        if (low < -margin && high > margin) return true;
        for (const double s : sides)
            if (std::abs(s) <= margin) return false;
        // Before or behind the origin, which is not on the mesh: else it would be left out.
        const Vec3 n = cross(b - a, c - a);
        if (dot(n, a) * dot(n, direction_) > 0) odd_ = !odd_;
        return true;
    }

    void turn() {
        odd_ = false;
        ++tries_;
        for (int axis = 0; axis < 3; ++axis)
            direction_[axis] = 2 * random_unit(seed_, 20 + tries_ * 3 + std::uint64_t(axis), point_) - 1;
    }
    bool odd() const { return odd_; }
    std::uint64_t tries() const { return tries_; }

private:
    double side(const Vec3& a, const Vec3& b) const { return dot(direction_, cross(a, b)); }

    std::uint64_t seed_, point_, tries_ = 0;
    Vec3 direction_;
    bool odd_ = false;
};

constexpr std::uint64_t most_rays = 8;

struct Tally {
    std::uint64_t signs = 0, wrong_sign = 0, undecided = 0, distances = 0, wrong_distance = 0, holes = 0;
    double winding_gap = infinity;  ///< least |winding − ½| among decided signs
    double nearest_wrong = 0;       ///< largest distance of a wrong sign, mesh units
    double distance_error = 0;      ///< mesh units
    Vec3 wrong_at, distance_at;
};

struct GridPoint {
    int level = 0;
    std::uint64_t group = 0;
    int point = 0;
};

/// Half of the samples on level 0, the others on a level chosen evenly; within a level evenly by group.
/// LSCG's sums are distances only where all levels are counted: on level 0.
GridPoint choose(const shell::ShellData& data, std::uint64_t seed, std::uint64_t i) {
    GridPoint out;
    const auto below = [&](std::uint64_t stream, std::uint64_t n) {
        return std::min(std::uint64_t(random_unit(seed, stream, i) * double(n)), n - 1);
    };
    if (data.info.solver == Solver::direct && random_bits(seed, 10, i) & 1)
        out.level = int(below(11, data.octree.levels.size()));
    out.group = below(12, data.octree.levels[out.level].groups());
    out.point = int(below(13, octree::group_points));
    return out;
}

enum class Side : std::uint8_t { outside, inside, undecided };

Side side_by_rays(const Job& job, const Vec3& p, std::uint64_t sample) {
    for (Parity parity(job.options.seed, sample); parity.tries() <= most_rays; parity.turn()) {
        const bool good =
            std::all_of(job.mesh.triangles.begin(), job.mesh.triangles.end(), [&](const Triangle& t) {
                return parity.add(job.mesh.vertices[t[0]] - p, job.mesh.vertices[t[1]] - p,
                                  job.mesh.vertices[t[2]] - p);
            });
        if (good) return parity.odd() ? Side::inside : Side::outside;
    }
    return Side::undecided;
}

/// By the shell's own rule, from the whole mesh.
Side side_of(const Job& job, const Vec3& p, std::uint64_t sample, double winding) {
    const SignRule rule = job.view.data().info.sign;
    if (rule == SignRule::unsigned_rule) return Side::outside;
    if (rule == SignRule::even_odd) return side_by_rays(job, p, sample);
    if (rule == SignRule::generalized) {
        for (int axis = 0; axis < 3; ++axis)
            if (p[axis] < job.bounds.min[axis] || p[axis] > job.bounds.max[axis]) return Side::outside;
    }
    if (std::abs(winding - 0.5) <= undecided_winding) return Side::undecided;
    return winding > 0.5 ? Side::inside : Side::outside;
}

/// \param reach  of each triangle, the longer edge at its first corner, rounded up
double winding_at(const Job& job, const Vec3& p) {
    SolidAngle angle;
    const auto see = [&](std::uint32_t v) {
        const Vec3 d = job.directed.vertices[v] - p;
        return Seen{d, norm(d)};
    };
    for (const Triangle& t : job.directed.triangles) angle.add(see(t[0]), see(t[1]), see(t[2]));
    return angle.winding();
}

/// generalized: whether the point is a corner of a finest cell that has both sides: then the value may be the
/// distance to where they meet.
bool next_to_hole(const Job& job, const std::array<std::int64_t, 3>& index) {
    const octree::Lattice& lattice = job.view.data().lattice;
    if (job.view.data().info.sign != SignRule::generalized) return false;
    unsigned above = 0, below = 0;  // of the 27 points around: at least, at most ½
    for (int i = 0; i < 27; ++i) {
        const std::array<std::int64_t, 3> at{index[0] + i % 3 - 1, index[1] + i / 3 % 3 - 1,
                                             index[2] + i / 9 - 1};
        const double w = winding_at(job, lattice.position(at));
        const bool inside = w >= 0.5 - undecided_winding, outside = w <= 0.5 + undecided_winding;
        above |= unsigned(inside) << i;
        below |= unsigned(outside) << i;
    }
    for (int cell = 0; cell < 8; ++cell) {
        unsigned corners = 0;
        for (int c = 0; c < 8; ++c) corners |= 1u << octree::group_point(cell, c);
        if ((above & corners) != 0 && (below & corners) != 0) return true;
    }
    return false;
}

void check_point(const Job& job, const std::vector<double>& reach, const GridPoint& at, std::uint64_t sample,
                 Tally& tally) {
    const shell::ShellData& data = job.view.data();
    const double w = data.lattice.width;
    const octree::Cell parent = octree::morton_decode(data.octree.levels[at.level].parent[at.group]);
    const int local[3] = {at.point % 3, at.point / 3 % 3, at.point / 9};
    std::array<std::int64_t, 3> index;
    for (int axis = 0; axis < 3; ++axis)
        index[axis] = (2 * std::int64_t(parent[axis]) + local[axis]) << at.level;
    const Vec3 p = data.lattice.position(index);
    const double stored = data.field.values[at.level][octree::group_points * at.group + at.point] * w;

    std::vector<Seen> seen(job.mesh.vertices.size());
    for (std::size_t v = 0; v < seen.size(); ++v) {
        seen[v].at = job.mesh.vertices[v] - p;
        seen[v].distance = norm(seen[v].at);
    }
    double distance = infinity;
    SolidAngle angle;
    const bool with_sign = data.info.sign != SignRule::unsigned_rule;
    const bool with_winding = with_sign && data.info.sign != SignRule::even_odd;
    for (std::size_t t = 0; t < job.mesh.triangles.size(); ++t) {
        const auto& [i, j, k] = job.directed.triangles[t];
        const Seen &a = seen[i], &b = seen[j], &c = seen[k];
        // No point of the triangle is farther from its first corner than the longer of the two edges there.
        if (a.distance - reach[t] <= distance)
            distance = std::min(distance, distance_to_triangle(a.at, b.at, c.at));
        if (with_winding) angle.add(a, b, c);
    }
    const double tolerance = distance_tolerance * w * data.lattice.cells();
    if (data.info.solver == Solver::direct) {
        ++tally.distances;
        double error = std::abs(std::abs(stored) - distance);
        if (std::abs(stored) < distance - tolerance && next_to_hole(job, index)) ++tally.holes, error = 0;
        if (!(error <= tolerance)) ++tally.wrong_distance;
        if (error > tally.distance_error) tally.distance_error = error, tally.distance_at = p;
    }
    const double winding = angle.winding();
    const Side side = side_of(job, p, sample, winding);
    if (with_sign && (distance <= tolerance || side == Side::undecided)) {
        ++tally.undecided;  // on M, or on the border of "inside"
        return;
    }
    ++tally.signs;
    if (with_winding) tally.winding_gap = std::min(tally.winding_gap, std::abs(winding - 0.5));
    if (side == Side::inside ? !(stored < 0) : !(stored >= 0)) {
        ++tally.wrong_sign;
        if (distance >= tally.nearest_wrong) tally.nearest_wrong = distance, tally.wrong_at = p;
    }
}

std::vector<double> reaches(const Mesh& mesh) {
    std::vector<double> out(mesh.triangles.size());
    for (std::size_t t = 0; t < out.size(); ++t) {
        const auto& [i, j, k] = mesh.triangles[t];
        const Vec3& a = mesh.vertices[i];
        out[t] = std::max(norm(mesh.vertices[j] - a), norm(mesh.vertices[k] - a)) * (1 + 0x1p-40);
    }
    return out;
}

Tally check_points(const Job& job, std::uint64_t samples) {
    Stage stage(job.options.progress, "verify: signs", samples);
    std::vector<Tally> tallies(samples);
    const std::vector<double> reach = reaches(job.mesh);
    parallel_for(samples, 1, [&](std::uint64_t i) {
        check_point(job, reach, choose(job.view.data(), job.options.seed, i), i, tallies[i]);
        stage.advance(1);
    });
    Tally sum;
    for (const Tally& t : tallies) {
        sum.signs += t.signs, sum.wrong_sign += t.wrong_sign, sum.undecided += t.undecided;
        sum.distances += t.distances, sum.wrong_distance += t.wrong_distance, sum.holes += t.holes;
        sum.winding_gap = std::min(sum.winding_gap, t.winding_gap);
        if (t.nearest_wrong > sum.nearest_wrong) sum.nearest_wrong = t.nearest_wrong, sum.wrong_at = t.wrong_at;
        if (t.distance_error > sum.distance_error)
            sum.distance_error = t.distance_error, sum.distance_at = t.distance_at;
    }
    return sum;
}

}  // namespace

void check_signs(const Job& job, VerifyReport& report) {
    const shell::ShellData& data = job.view.data();
    const std::uint64_t allowed = std::max<std::uint64_t>(work_limit / job.mesh.triangles.size(), 1);
    const std::uint64_t samples = std::min(job.options.sign_samples, allowed);
    const Tally sum = check_points(job, samples);
    const std::string capped = samples < job.options.sign_samples
                                   ? fmt::format(" (of {} asked: too many triangles)", job.options.sign_samples)
                                   : std::string();

    VerifyCheck signs{"G3 signs", sum.wrong_sign == 0, sum.signs, sum.wrong_sign, -sum.nearest_wrong, ""};
    if (data.info.sign == SignRule::unsigned_rule)
        signs.detail = fmt::format("unsigned: {} grid points{} have values ≥ 0", sum.signs, capped);
    else if (data.info.sign == SignRule::even_odd)
        signs.detail =
            fmt::format("{} grid points{}, each by a ray in a direction of its own; {} on M left out",
                        sum.signs, capped, sum.undecided);
    else
        signs.detail = fmt::format(
            "{} grid points{}; {} on M or at winding number ½ left out; the winding number "
            "nearest to ½ differs by {:.3g}",
            sum.signs, capped, sum.undecided, sum.signs ? sum.winding_gap : 0.0);
    if (sum.wrong_sign > 0) signs.detail += fmt::format("; wrong at {}", place(sum.wrong_at));
    report.checks.push_back(signs);

    const double tolerance = distance_tolerance * data.lattice.width * data.lattice.cells();
    VerifyCheck distances{"G3 distances",     sum.wrong_distance == 0,        sum.distances,
                          sum.wrong_distance, tolerance - sum.distance_error, ""};
    distances.detail =
        data.info.solver == Solver::direct
            ? fmt::format("|f| of grid points{} against all triangles: largest difference {:.3g} at {}", capped,
                          sum.distance_error, place(sum.distance_at))
            : "not compared: LSCG solves for the distances to its own tolerance";
    if (sum.holes > 0)
        distances.detail += fmt::format("; {} shortened where a hole is filled next to them", sum.holes);
    report.checks.push_back(distances);
}

}  // namespace its::verifier
