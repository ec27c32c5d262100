#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "verify/checks.h"
#include "verify/columns.h"
#include "verify/nearest.h"

namespace its::verifier {
namespace {

constexpr std::uint64_t group_grain = 256;

/// Pairs of grid point and boundary edge that a check which is not complete takes: some ten seconds on two
/// cores.
constexpr std::uint64_t most_pairs = 200'000'000;

/// LSCG solves f(g) = D(g) up to 10⁻¹² of the largest distance, which is below twice the root's side.
constexpr double lscg_tolerance = 2e-12;

using Index = std::array<std::int64_t, 3>;

/// Lattice coordinates of a group's point.
Index index_of(const View& view, int level, std::uint64_t group, int point) {
    const Cell parent = separate(view.data().octree.levels[std::size_t(level)].parent[group]);
    const int local[3] = {point % 3, point / 3 % 3, point / 9};
    Index index;
    for (std::size_t axis = 0; axis < 3; ++axis)
        index[axis] = (2 * std::int64_t(parent[axis]) + local[axis]) << level;
    return index;
}

enum class Side : std::uint8_t { outside, inside, undecided };

/// The side of lattice points by the shell's own rule, from the whole mesh.
class Rule {
public:
    explicit Rule(const Job& job)
        : job_(job),
          rule_(job.view.data().info.sign),
          columns_(rule_ == SignRule::unsigned_rule ? Mesh{} : job.directed, job.view.lattice(),
                   job.parts.until(0.6)) {}

    SignRule rule() const { return rule_; }
    /// The sides are whole numbers of crossings: those of all points are told at no cost.
    bool whole() const { return rule_ == SignRule::winding || rule_ == SignRule::even_odd; }

    /// The number that decides: it is inside where this is at least 1.
    std::int32_t number(const Index& at) const {
        if (!whole()) return 0;
        const std::int32_t sum = columns_.above(at[0], at[1], at[2]);
        return rule_ == SignRule::even_odd ? sum & 1 : sum;
    }

    Estimate winding(const Index& at) const {
        Estimate w = boundary_term(job_.boundary.edges, job_.view.lattice().position(at));
        w.value += columns_.above(at[0], at[1], at[2]);
        return w;
    }

    bool within_bounds(const Index& at) const {
        const Vec3 p = job_.view.lattice().position(at);
        for (int axis = 0; axis < 3; ++axis)
            if (p[axis] < job_.bounds.min[axis] || p[axis] > job_.bounds.max[axis]) return false;
        return true;
    }

    Side side(const Index& at) const {
        if (rule_ != SignRule::generalized) return number(at) >= 1 ? Side::inside : Side::outside;
        if (!within_bounds(at)) return Side::outside;
        const Estimate w = winding(at);
        if (!(std::abs(w.value - 0.5) > w.error)) return Side::undecided;
        return w.value > 0.5 ? Side::inside : Side::outside;
    }

private:
    const Job& job_;
    SignRule rule_;
    Columns columns_;
};

/// Where surface cells are of several levels: a point hangs if one of the cells of its level around it is not
/// there, and the leaf that covers that one is a surface cell. Its value is then the interpolation of the level
/// above, by means of two along x, then y, then z.
class Hanging {
public:
    explicit Hanging(const View& view) : view_(view) {}

    bool operator()(int level, const Index& at) const {
        if (!view_.adaptive() || level == view_.lattice().depth) return false;
        const std::int64_t cells = view_.lattice().cells();
        for (int around = 0; around < 8; ++around) {
            Cell finest;  // of the cell, the one at the point
            bool in_root = true;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const std::int64_t i = at[axis] - std::int64_t(around >> axis & 1);
                in_root = in_root && i >= 0 && i < cells;
                finest[axis] = std::uint32_t(i);
            }
            if (!in_root) continue;
            const CellEntry leaf = view_.leaf(finest);
            if (leaf.marked && leaf.level > level) return true;
        }
        return false;
    }

    /// Whether the value at the group's point is that interpolation, to the last bit.
    bool interpolates(int level, std::uint64_t group, int point) const {
        const shell::ShellData& data = view_.data();
        const Cell parent = separate(data.octree.levels[std::size_t(level)].parent[group]);
        const std::uint64_t above = view_.group(level + 1, {parent[0] >> 1, parent[1] >> 1, parent[2] >> 1});
        const int child = int(parent[0] & 1) + 2 * int(parent[1] & 1) + 4 * int(parent[2] & 1);
        double v[8];
        for (int c = 0; c < 8; ++c)
            v[c] = data.field.values[std::size_t(level) + 1]
                                    [points_of_group * above + std::uint64_t(group_point(child, c))];
        const int half[3] = {point % 3, point / 3 % 3, point / 9};
        int count = 8;
        for (const int along :
             half) {  // halves the list of values, which begins with those that differ along x
            for (int i = 0; i < count / 2; ++i)
                v[i] = along == 0 ? v[2 * i] : along == 2 ? v[2 * i + 1] : 0.5 * (v[2 * i] + v[2 * i + 1]);
            count /= 2;
        }
        return v[0] == data.field.values[std::size_t(level)][points_of_group * group + std::uint64_t(point)];
    }

private:
    const View& view_;
};

// Sides of cells.

struct SideTally {
    std::uint64_t bits = 0, wrong_bits = 0, numbers = 0, wrong_numbers = 0, mixed = 0;
    std::uint64_t corners = 0, wrong_corners = 0;  ///< of surface cells of several sizes
    /// Some grid point of a level with surface cells has a winding number other than 0 and 1.
    bool other_numbers = false;
    Vec3 wrong_at;
    std::uint64_t wrong() const { return wrong_bits + wrong_numbers + mixed + wrong_corners; }
};

/// The lowest corners of a group's cells, and the winding numbers of all its points on level 0.
void check_group_sides(const Job& job, const Rule& rule, int level, std::uint64_t group, SideTally& tally) {
    const shell::ShellData& data = job.view.data();
    const unsigned inside = data.sides.inside[std::size_t(level)][group];
    const bool surface = level < job.view.surface_levels();
    const unsigned mask = surface ? job.view.surface_bits(level, group) : 0u;
    std::uint64_t cell = surface ? job.view.first_surface(level, group) : 0;
    const auto wrong = [&](std::uint64_t& count, const Index& at) {
        if (tally.wrong() == 0) tally.wrong_at = job.view.lattice().position(at);
        ++count;
    };
    for (int child = 0; child < 8; ++child) {
        const Index at = index_of(job.view, level, group, group_point(child, 0));
        const std::int32_t number = rule.number(at);
        ++tally.bits;
        if ((inside >> child & 1) != unsigned(number >= 1)) wrong(tally.wrong_bits, at);
        if ((mask >> child & 1) == 0) continue;
        if (!data.sides.winding.empty()) {
            ++tally.numbers;
            if (data.sides.winding[cell] != number) wrong(tally.wrong_numbers, at);
        }
        if (job.view.adaptive() && rule.rule() != SignRule::generalized)
            for (int c = 0; c < 8; ++c) {
                const Index corner = index_of(job.view, level, group, group_point(child, c));
                ++tally.corners;
                if ((data.surface.corners_inside[cell] >> c & 1) != int(rule.number(corner) >= 1))
                    wrong(tally.wrong_corners, corner);
            }
        ++cell;
    }
    if (surface && rule.whole())
        for (int p = 0; p < points_of_group; ++p) {
            const std::int32_t number = rule.number(index_of(job.view, level, group, p));
            tally.other_numbers = tally.other_numbers || number < 0 || number > 1;
        }
}

/// Cells that neither have finer ones nor meet M (or the surface that fills its holes) have one side.
void check_one_side(const Job& job, int level, std::uint64_t group, double tolerance, SideTally& tally) {
    const shell::ShellData& data = job.view.data();
    const Hanging hanging(job.view);
    for (int child = 0; child < 8; ++child) {
        if (data.octree.levels[std::size_t(level)].mask[group] >> child & 1) continue;
        if (level < job.view.surface_levels() && (job.view.surface_bits(level, group) >> child & 1)) continue;
        bool above = false, below = false;
        for (int c = 0; c < 8; ++c) {
            const int point = group_point(child, c);
            if (hanging(level, index_of(job.view, level, group, point))) continue;  // its value has no side
            const double v =
                data.field.values[std::size_t(level)][points_of_group * group + std::uint64_t(point)];
            above = above || v > tolerance;
            below = below || v < -tolerance;
        }
        if (!above || !below) continue;
        if (tally.wrong() == 0)
            tally.wrong_at =
                job.view.lattice().position(index_of(job.view, level, group, group_point(child, 0)));
        ++tally.mixed;
    }
}

double value_tolerance(const Job& job) {
    const Lattice& lattice = job.view.lattice();
    return job.view.data().info.solver == Solver::direct ? distance_roundings * lattice.ulp()
                                                         : lscg_tolerance * double(lattice.cells());
}

SideTally tally_sides(const Job& job, const Rule& rule) {
    const octree::Octree& octree = job.view.data().octree;
    std::uint64_t total = 0;
    for (const octree::Level& level : octree.levels) total += level.parent.size();
    Stage stage(job.parts.until(0.7), "verify: sides", total);
    const double tolerance = value_tolerance(job);
    SideTally sum;
    for (int k = 0; k <= octree.depth; ++k) {
        const std::uint64_t groups = octree.levels[std::size_t(k)].parent.size();
        std::vector<SideTally> tallies(chunk_count(groups, group_grain));
        for_chunks(groups, group_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t g = begin; g < end; ++g) {
                check_group_sides(job, rule, k, g, tallies[chunk]);
                if (rule.rule() == SignRule::generalized) check_one_side(job, k, g, tolerance, tallies[chunk]);
            }
            stage.advance(end - begin);
        });
        for (const SideTally& t : tallies) {
            if (sum.wrong() == 0) sum.wrong_at = t.wrong_at;
            sum.bits += t.bits, sum.wrong_bits += t.wrong_bits;
            sum.corners += t.corners, sum.wrong_corners += t.wrong_corners;
            sum.numbers += t.numbers, sum.wrong_numbers += t.wrong_numbers, sum.mixed += t.mixed;
            sum.other_numbers = sum.other_numbers || t.other_numbers;
        }
    }
    return sum;
}

void check_sides(const Job& job, const Rule& rule, VerifyReport& report) {
    const SideTally sum = tally_sides(job, rule);
    const bool unnumbered = sum.other_numbers && job.view.data().sides.winding.empty();
    VerifyCheck check{"G3 sides of cells",
                      sum.wrong() == 0 && !unnumbered,
                      true,
                      sum.bits + sum.numbers + sum.corners,
                      sum.wrong() + std::uint64_t(unnumbered),
                      0,
                      ""};
    if (sum.wrong() > 0)
        check.detail = fmt::format(
            "{} sides and {} winding numbers of lowest corners and {} sides of others are wrong, "
            "{} cells that do not meet M have two sides; first at {}",
            sum.wrong_bits, sum.wrong_numbers, sum.wrong_corners, sum.mixed, place(sum.wrong_at));
    else if (unnumbered)
        check.detail = "winding numbers other than 0 and 1, and none stored for surface cells";
    else if (rule.whole())
        check.detail = fmt::format("all {} cells, {} winding numbers: exact crossings of vertical lines with M",
                                   sum.bits, sum.numbers);
    else
        check.detail = fmt::format("all {} cells have none, as the sign rule says", sum.bits);
    report.checks.push_back(check);
}

// Values of grid points.

struct ValueTally {
    std::uint64_t hanging = 0, wrong_hanging = 0;
    std::uint64_t signs = 0, wrong_sign = 0, undecided = 0, distances = 0, wrong_distance = 0, holes = 0;
    double winding_gap = infinity;  ///< least |winding − ½| among decided signs
    double nearest_wrong = 0;       ///< largest |value| of a wrong sign
    double distance_error = 0;
    Vec3 wrong_at, distance_at, hanging_at;

    void add(const ValueTally& t) {
        if (wrong_hanging == 0) hanging_at = t.hanging_at;
        hanging += t.hanging, wrong_hanging += t.wrong_hanging;
        signs += t.signs, wrong_sign += t.wrong_sign, undecided += t.undecided;
        distances += t.distances, wrong_distance += t.wrong_distance, holes += t.holes;
        winding_gap = std::min(winding_gap, t.winding_gap);
        if (t.nearest_wrong > nearest_wrong) nearest_wrong = t.nearest_wrong, wrong_at = t.wrong_at;
        if (t.distance_error > distance_error) distance_error = t.distance_error, distance_at = t.distance_at;
    }
};

/// Which of `count` points are looked at: `samples` parts of equal size, one point of each at random.
class Selection {
public:
    Selection(std::uint64_t count, std::uint64_t samples, std::uint64_t seed)
        : count_(count), samples_(std::min(count, samples)), seed_(seed) {}

    std::uint64_t samples() const { return samples_; }
    bool operator()(std::uint64_t i) const {
        if (samples_ == count_) return true;
        const double part = double(count_) / double(samples_);
        const auto stratum = std::uint64_t(double(i) / part);
        const auto at = [&](std::uint64_t s) { return std::uint64_t(std::ceil(double(s) * part)); };
        // Rounding may put i beside its part; then the part that it lies in by the same arithmetic.
        const std::uint64_t s = i < at(stratum) ? stratum - 1 : i >= at(stratum + 1) ? stratum + 1 : stratum;
        const std::uint64_t begin = at(s), size = at(s + 1) - begin;
        return i - begin == std::min(std::uint64_t(random_unit(seed_, 12, s) * double(size)), size - 1);
    }

private:
    std::uint64_t count_, samples_, seed_;
};

class Values {
public:
    Values(const Job& job, const Rule& rule)
        : job_(job),
          rule_(rule),
          lattice_(job.view.lattice()),
          hanging_(job.view),
          nearest_(job.mesh),
          tolerance_(value_tolerance(job)) {}

    double tolerance() const { return tolerance_; }

    /// \param selected  to be compared with the distance; and for its winding number, if this costs
    void check(int level, std::uint64_t group, int point, bool selected, ValueTally& tally) const {
        const Index at = index_of(job_.view, level, group, point);
        if (hanging_(level, at)) {
            ++tally.hanging;
            if (!hanging_.interpolates(level, group, point) && tally.wrong_hanging++ == 0)
                tally.hanging_at = lattice_.position(at);
            return;
        }
        const double stored = value(level, group, point, at);
        if (rule_.rule() != SignRule::generalized || selected) check_sign(at, stored, tally);
        if (selected) check_distance(at, stored, tally);
    }

private:
    /// The sum of all levels at the point. The direct solver's sums from any level on are distances; LSCG's are
    /// where no finer level is left out.
    double value(int level, std::uint64_t group, int point, const Index& at) const {
        const shell::ShellData& data = job_.view.data();
        if (level > 0 && data.info.solver == Solver::lscg)
            return double(job_.view.value({double(at[0]), double(at[1]), double(at[2])}));
        return data.field.values[std::size_t(level)][points_of_group * group + std::uint64_t(point)];
    }

    void check_sign(const Index& at, double stored, ValueTally& tally) const {
        const bool negative = stored < 0;
        if (std::abs(stored) <= tolerance_ && rule_.rule() != SignRule::unsigned_rule) {
            ++tally.undecided;  // on M
            return;
        }
        const Side side = rule_.side(at);
        if (side == Side::undecided) {
            ++tally.undecided;
            return;
        }
        ++tally.signs;
        if (negative == (side == Side::inside)) return;
        ++tally.wrong_sign;
        if (!(std::abs(stored) < tally.nearest_wrong))
            tally.nearest_wrong = std::abs(stored), tally.wrong_at = lattice_.position(at);
    }

    void check_distance(const Index& at, double stored, ValueTally& tally) const {
        const Vec3 p = lattice_.position(at);
        const double w = lattice_.width, claimed = std::abs(stored);
        ++tally.distances;
        double distance = nearest_.distance(p, (claimed + tolerance_) * w) / w;
        if (distance == infinity) distance = nearest_.distance(p, infinity) / w;
        double error = std::abs(claimed - distance);
        if (error <= tolerance_) {
            tally.distance_error = std::max(tally.distance_error, error);
            return;
        }
        if (claimed < distance && next_to_hole(at)) {
            ++tally.holes;
            return;
        }
        ++tally.wrong_distance;
        if (error >= tally.distance_error) tally.distance_error = error, tally.distance_at = p;
    }

    /// Generalized: whether the point is a corner of a cell with an edge along which the winding number
    /// passes ½ where M does not: then |value| is the distance to there, to first order, and at most D.
    bool next_to_hole(const Index& at) const {
        if (rule_.rule() != SignRule::generalized || !rule_.within_bounds(at)) return false;
        if (!job_.view.adaptive()) return next_to_hole(at, 1);
        // Holes may be closed by larger cells.
        for (std::int64_t step = 1; step < lattice_.cells(); step *= 2) {
            if (next_to_hole(at, step)) return true;
            if (((at[0] | at[1] | at[2]) & step) != 0) break;
        }
        return false;
    }

    bool next_to_hole(const Index& at, std::int64_t step) const {
        Estimate w[27];
        bool known[27];
        for (int i = 0; i < 27; ++i) {
            const Index near{at[0] + step * (i % 3 - 1), at[1] + step * (i / 3 % 3 - 1),
                             at[2] + step * (i / 9 - 1)};
            bool inside = true;
            for (const std::int64_t c : near) inside = inside && c >= 0 && c <= lattice_.cells();
            known[i] = inside && rule_.within_bounds(near);
            if (known[i]) w[i] = rule_.winding(near);
        }
        for (int cell = 0; cell < 8; ++cell)
            for (int corner = 0; corner < 8; ++corner)
                for (const int axis : {1, 2, 4}) {
                    const int p = group_point(cell, corner), q = group_point(cell, corner ^ axis);
                    if (!known[p] || !known[q]) continue;
                    const double error = w[p].error + w[q].error + 1e-9;
                    if (std::abs(w[p].value - w[q].value) >= 0.5 + error) continue;
                    if ((w[p].value <= 0.5 + error) != (w[q].value <= 0.5 - error)) return true;
                }
        return false;
    }

    const Job& job_;
    const Rule& rule_;
    const Lattice& lattice_;
    Hanging hanging_;
    Nearest nearest_;
    double tolerance_;
};

ValueTally tally_values(const Job& job, const Values& values, const Selection& selected) {
    const octree::Octree& octree = job.view.data().octree;
    Stage stage(job.parts.until(0.95), "verify: values", job.arrays.grid_points);
    ValueTally sum;
    std::uint64_t before = 0;
    for (int k = 0; k <= octree.depth; ++k) {
        const std::vector<std::uint32_t>& own = job.arrays.own_points[std::size_t(k)];
        const std::uint64_t chunks = chunk_count(own.size(), group_grain);
        std::vector<std::uint64_t> first(chunks);  // number of the first point of each chunk
        for (std::uint64_t g = 0; g < own.size(); ++g) {
            if (g % group_grain == 0) first[g / group_grain] = before;
            before += std::uint64_t(std::popcount(own[g]));
        }
        std::vector<ValueTally> tallies(chunks);
        for_chunks(own.size(), group_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            std::uint64_t number = first[chunk];
            for (std::uint64_t g = begin; g < end; ++g)
                for (std::uint32_t bits = own[g]; bits != 0; bits &= bits - 1, ++number)
                    values.check(k, g, std::countr_zero(bits), selected(number), tallies[chunk]);
            stage.advance(number - first[chunk]);
        });
        for (const ValueTally& t : tallies) sum.add(t);
    }
    return sum;
}

/// "all 5,000 grid points", or how many and how likely one wrong value is seen.
std::string extent(std::uint64_t tested, std::uint64_t all) {
    if (tested == all) return fmt::format("all {} grid points", all);
    return fmt::format("{} of {} grid points, at random: a single wrong value is seen with probability {:.3g}",
                       tested, all, double(tested) / double(all));
}

std::uint64_t samples_of(const Job& job) {
    const std::uint64_t all = job.arrays.grid_points;
    if (job.options.complete) return all;
    std::uint64_t samples = std::min(all, job.options.grid_samples);
    if (job.view.data().info.sign == SignRule::generalized && !job.boundary.edges.empty())
        samples = std::min(samples, most_pairs / job.boundary.edges.size() + 1);
    return samples;
}

void check_values(const Job& job, const Rule& rule, VerifyReport& report) {
    const std::uint64_t all = job.arrays.grid_points;
    const Values values(job, rule);
    const Selection selected(all, samples_of(job), job.options.seed);
    const ValueTally sum = tally_values(job, values, selected);
    const double w = job.width();

    const bool all_signs = rule.rule() != SignRule::generalized || selected.samples() == all;
    VerifyCheck signs{"G3 signs",     sum.wrong_sign == 0,    all_signs, sum.signs,
                      sum.wrong_sign, -sum.nearest_wrong * w, ""};
    signs.detail = extent(all_signs ? all : selected.samples(), all);
    if (rule.rule() == SignRule::unsigned_rule)
        signs.detail += ": values ≥ 0";
    else
        signs.detail +=
            fmt::format("; {} on M{} left out", sum.undecided, rule.whole() ? "" : " or at winding number ½");
    if (sum.wrong_sign > 0) signs.detail += fmt::format("; wrong at {}", place(sum.wrong_at));
    report.checks.push_back(signs);

    if (job.view.adaptive()) {
        VerifyCheck hanging{
            "hanging points", sum.wrong_hanging == 0, true, sum.hanging, sum.wrong_hanging, 0, ""};
        hanging.detail = fmt::format(
            "{} grid points beside larger surface cells, all have the value of the level above", sum.hanging);
        if (sum.wrong_hanging > 0)
            hanging.detail = fmt::format(
                "{} of {} grid points beside larger surface cells do not have the value "
                "of the level above, first at {}",
                sum.wrong_hanging, sum.hanging, place(sum.hanging_at));
        report.checks.push_back(hanging);
    }

    VerifyCheck distances{"G3 distances",
                          sum.wrong_distance == 0,
                          selected.samples() == all,
                          sum.distances,
                          sum.wrong_distance,
                          (values.tolerance() - sum.distance_error) * w,
                          ""};
    distances.detail =
        fmt::format("{}; largest difference {:.3g}", extent(selected.samples(), all), sum.distance_error * w);
    if (sum.wrong_distance > 0) distances.detail += fmt::format(" at {}", place(sum.distance_at));
    if (sum.holes > 0)
        distances.detail += fmt::format("; {} next to filled holes have less, as they may", sum.holes);
    report.checks.push_back(distances);
}

}  // namespace

void check_grid(const Job& job, VerifyReport& report) {
    const Rule rule(job);
    check_sides(job, rule, report);
    check_values(job, rule, report);
}

}  // namespace its::verifier
