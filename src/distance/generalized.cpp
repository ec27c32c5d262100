#include "distance/generalized.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "geometry/vec3.h"

namespace its {

namespace {

constexpr std::uint64_t cube_grain = 64;

/// Patches are expanded where each errs by less than this; measured, docs/design/signs.md.
/// First a rough look, which is enough for most cubes.
constexpr double rough_tolerance = 0x1p-6, tolerance = 0x1p-10;
/// Cubes share the surroundings of the cube this many levels above.
constexpr int common_levels = 2;
/// Of the points of a group together, and of one point.
constexpr double group_tolerance = 0x1p-13, point_tolerance = 0x1p-16;

/// Estimates decide only where they are this far from ½, beyond their error; all else is left to the sum over
/// the boundary, whose error is far smaller. So all groups that share a grid point agree on it.
constexpr double decision_gap = 0x1p-20;

/// Winding numbers from which the distance to where w = ½ is derived need no proof: an estimate is taken if its
/// bound is this, a finer one, whose error is far below its bound as a rule, if it is that.
constexpr double precise_enough = 0x1p-13, finer_enough = 0x1p-6;

/// With fewer edges their sum is cheaper than another estimate.
constexpr std::uint64_t few_edges = 32;

constexpr std::int32_t never = std::numeric_limits<std::int32_t>::max();

}  // namespace

/// A cube of level `level` ≥ 1, whose 27 points are 2^(level − 1) apart.
struct GeneralizedSigns::Cube {
    int level;
    Cell at;
    std::int64_t step() const { return std::int64_t{1} << (level - 1); }
    std::int64_t begin(int axis) const { return 2 * step() * at[std::size_t(axis)]; }
    std::int64_t end(int axis) const { return begin(axis) + 2 * step(); }
};

struct GeneralizedSigns::Scratch {
    Filling::Local local, finer, finest;
    Filling::Local::Points points;
    Filling::Local::Estimates estimates, finer_estimates;
    bool has_finer = false;

    Filling::Surroundings around;  ///< of the cube `ancestor`
    int ancestor_level = -1;
    std::uint64_t ancestor = 0;
};

/// The surroundings of the cube some levels above, found anew only when that changes.
const Filling::Surroundings& GeneralizedSigns::surroundings(const Cube& cube, Scratch& scratch) const {
    const int level = std::min(cube.level + common_levels, lattice_.depth + 1);
    const std::uint64_t code = morton_encode(cube.at) >> 3 * (level - cube.level);
    if (scratch.ancestor_level != level || scratch.ancestor != code) {
        const Cube above{level, morton_decode(code)};
        filling_.surround(centre(above), ball_radius(above), scratch.around);
        scratch.ancestor_level = level;
        scratch.ancestor = code;
    }
    return scratch.around;
}

double GeneralizedSigns::ball_radius(const Cube& cube) const {
    return 0.8660254037844387 * 2 * double(cube.step()) * lattice_.width * (1 + 0x1p-40);
}

Vec3 GeneralizedSigns::centre(const Cube& cube) const {
    return lattice_.position(
        {cube.begin(0) + cube.step(), cube.begin(1) + cube.step(), cube.begin(2) + cube.step()});
}

/// A corner of a finest cell in which inside and outside meet, and how far it is from where they do.
struct GeneralizedSigns::Near {
    std::uint64_t point;  ///< Morton code
    double distance;

    friend auto operator<=>(const Near&, const Near&) = default;  // NOLINT(modernize-use-nullptr): its own
};

struct GeneralizedSigns::Judgement {
    bool decided = false;  ///< inside is where the crossings of M + F are above `threshold`, in all of the cube
    bool may_flip = false;  ///< two points of the cube with no triangle between them may be on different sides
    std::int32_t threshold = 0;
};

GeneralizedSigns::GeneralizedSigns(const Mesh& mesh, const Lattice& lattice, const Voxels& voxels,
                                   const Progress& progress)
    : lattice_(lattice),
      filling_(mesh),
      mesh_lines_(mesh, lattice, voxels, progress),
      filling_lines_(filling_.surface(), lattice, mesh_lines_, progress) {
    const Box box = bounds(mesh);
    for (int axis = 0; axis < 3; ++axis) {
        std::int64_t first = 0, last = lattice.cells();
        while (first < last && lattice.position(axis, first) < box.min[axis]) ++first;
        while (last > first && lattice.position(axis, last) > box.max[axis]) --last;
        first_[std::size_t(axis)] = first;
        last_[std::size_t(axis)] = last;
    }
}

/// The winding number w of M along the way from the cube's centre to a point of it, with no triangle of M
/// between, is w(centre) ± variation. If that does not reach ½ modulo 1, no way changes sides. If moreover F
/// stays away, w_F itself lies between two half-integers, k − ½ and k + ½, and W − w_F > ½ is W > k for whole
/// W.
GeneralizedSigns::Judgement GeneralizedSigns::judge(const Cube& cube, Scratch& scratch) const {
    Judgement out;
    bool within = true, apart = false;
    for (int axis = 0; axis < 3; ++axis) {
        within = within && cube.begin(axis) >= first_[std::size_t(axis)] &&
                 cube.end(axis) <= last_[std::size_t(axis)];
        apart =
            apart || cube.end(axis) < first_[std::size_t(axis)] || cube.begin(axis) > last_[std::size_t(axis)];
    }
    if (apart) return {.decided = true, .may_flip = false, .threshold = never};
    const Vec3 centre = this->centre(cube);
    const double radius = ball_radius(cube);
    for (const double accuracy : {rough_tolerance, tolerance}) {
        filling_.localise(centre, radius, accuracy, surroundings(cube, scratch), scratch.local);
        const WindingEstimate w = scratch.local.at(centre);
        const double spread = scratch.local.variation() + w.error + decision_gap;
        const double off_half = std::abs(w.value - (std::floor(w.value) + 0.5));
        out.may_flip = !(off_half > spread);
        out.decided = !out.may_flip && scratch.local.clear();
        out.threshold = std::int32_t(std::floor(w.value + 0.5));
        // At the side of the bounding box inside ends, should it reach so far: there W = 0 beyond.
        if (!within && (!scratch.local.clear() || w.value - spread < -0.5)) out.may_flip = true;
        if (out.decided && !out.may_flip) break;
        // Where what is near varies too much a closer look, whose estimates err less, is of no use.
        if (cube.level > 1 && spread - 3 * w.error > off_half + w.error) break;
    }
    return out;
}

/// Finer estimates of a group's points, made when the first of them asks.
WindingEstimate GeneralizedSigns::finer_estimate(const Cube& cube, int i, Scratch& scratch) const {
    if (!scratch.has_finer) {
        filling_.localise(centre(cube), ball_radius(cube), group_tolerance, surroundings(cube, scratch),
                          scratch.finer);
        scratch.finer.at(scratch.points, scratch.finer_estimates);
        scratch.has_finer = true;
    }
    return {scratch.finer_estimates.value[i], scratch.finer_estimates.error[i]};
}

WindingEstimate GeneralizedSigns::finest_estimate(const Vec3& p, Filling::Local& local) const {
    filling_.localise(p, 0, point_tolerance, local);
    return local.at(p);
}

/// Whether `estimate` tells on which side w = (crossings of M + F) − w_F is; `above` receives w − ½.
bool GeneralizedSigns::settles(const WindingEstimate& estimate, std::int32_t crossings, double& above) {
    above = crossings - estimate.value - 0.5;
    return std::abs(above) > estimate.error + decision_gap;
}

/// w > ½ for what no estimate decides; w = (crossings of M) + boundary term.
bool GeneralizedSigns::decide_exactly(const Vec3& p, std::int32_t of_mesh) const {
    const WindingEstimate boundary = filling_.boundary_term(p);
    return of_mesh + boundary.value - 0.5 > boundary.error;
}

/// Bit i is set if point i of the cube's 27 is in the bounding box and inside(i, its position, crossings of M
/// and of F before it).
template <class F>
std::uint32_t GeneralizedSigns::select_points(const Cube& cube, F&& inside) const {
    std::uint32_t bits = 0;
    const std::int64_t step = cube.step();
    for (int row = 0; row < 9; ++row) {
        const std::int64_t x = cube.begin(0), y = cube.begin(1) + step * (row % 3),
                           z = cube.begin(2) + step * (row / 3);
        if (y < first_[1] || y > last_[1] || z < first_[2] || z > last_[2]) continue;
        std::int32_t of_mesh[3], of_filling[3];
        mesh_lines_.winding(x, y, z, step, of_mesh);
        filling_lines_.winding(x, y, z, step, of_filling);
        for (int i = 0; i < 3; ++i) {
            if (x + i * step < first_[0] || x + i * step > last_[0]) continue;
            if (inside(3 * row + i, of_mesh[i], of_filling[i])) bits |= 1u << (3 * row + i);
        }
    }
    return bits;
}

std::uint32_t GeneralizedSigns::inside_points(const Cube& cube, Scratch& scratch) const {
    Filling::Local::Points& points = scratch.points;
    for (int i = 0; i < Filling::Local::block; ++i) {
        const int p = std::min(i, group_points - 1);
        points.x[i] = lattice_.position(0, cube.begin(0) + cube.step() * (p % 3));
        points.y[i] = lattice_.position(1, cube.begin(1) + cube.step() * (p / 3 % 3));
        points.z[i] = lattice_.position(2, cube.begin(2) + cube.step() * (p / 9));
    }
    scratch.local.at(points, scratch.estimates);
    scratch.has_finer = false;
    const bool few = filling_.edges() <= few_edges;
    return select_points(cube, [&](int i, std::int32_t of_mesh, std::int32_t of_filling) {
        const std::int32_t crossings = of_mesh + of_filling;
        double above = 0;
        if (settles({scratch.estimates.value[i], scratch.estimates.error[i]}, crossings, above))
            return above > 0;
        const Vec3 p{points.x[i], points.y[i], points.z[i]};
        if (!few && (settles(finer_estimate(cube, i, scratch), crossings, above) ||
                     settles(finest_estimate(p, scratch.finest), crossings, above)))
            return above > 0;
        return decide_exactly(p, of_mesh);
    });
}

/// \return whether the cube is one of add_flip_cells(), and then which of its points are inside.
bool GeneralizedSigns::recall(const Cube& cube, std::uint32_t& bits) const {
    if (cube.level > 1) return false;
    const std::uint64_t code = morton_encode(cube.at);
    const auto it = std::lower_bound(known_cube_.begin(), known_cube_.end(), code);
    if (it == known_cube_.end() || *it != code) return false;
    bits = known_inside_[std::size_t(it - known_cube_.begin())];
    return true;
}

/// The points that M + F winds around more than `threshold` times.
std::uint32_t GeneralizedSigns::points_above(const Cube& cube, std::int32_t threshold) const {
    if (threshold == never) return 0;
    return select_points(cube, [&](int, std::int32_t of_mesh, std::int32_t of_filling) {
        return of_mesh + of_filling > threshold;
    });
}

bool GeneralizedSigns::inside(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const std::array<std::int64_t, 3> at{x, y, z};
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (at[axis] < first_[axis] || at[axis] > last_[axis]) return false;
    std::int32_t of_mesh[3], of_filling[3];
    mesh_lines_.winding(x, y, z, 1, of_mesh);
    filling_lines_.winding(x, y, z, 1, of_filling);
    Scratch scratch;
    const Vec3 p = lattice_.position(at);
    double above = 0;
    filling_.localise(p, 0, tolerance, scratch.local);
    if (settles(scratch.local.at(p), of_mesh[0] + of_filling[0], above)) return above > 0;
    return decide_exactly(p, of_mesh[0]);
}

/// The winding number of a point, precise enough to tell how far w = ½ is.
double GeneralizedSigns::precise_winding(const Cube& cube, int i, std::int32_t of_mesh, std::int32_t of_filling,
                                         Scratch& scratch) const {
    if (scratch.estimates.error[i] <= precise_enough) return of_mesh + of_filling - scratch.estimates.value[i];
    const Vec3 p{scratch.points.x[i], scratch.points.y[i], scratch.points.z[i]};
    if (filling_.edges() > few_edges) {
        const WindingEstimate finer = finer_estimate(cube, i, scratch);
        if (finer.error <= finer_enough) return of_mesh + of_filling - finer.value;
        const WindingEstimate finest = finest_estimate(p, scratch.finest);
        if (finest.error <= finer_enough) return of_mesh + of_filling - finest.value;
    }
    return of_mesh + filling_.boundary_term(p).value;
}

/// Corners of the cube's finest cells that have both sides; `inside`: of inside_points(), which has left
/// estimates in `scratch`. To first order w = ½ on a plane at |w − ½| / |∇w|, with the differences along the
/// cell's edges as the gradient. Across a triangle w jumps by a whole number, across the rest of an edge it
/// changes by less than ½.
void GeneralizedSigns::find_near(const Cube& cube, std::uint32_t inside, Scratch& scratch,
                                 std::vector<Near>& near) const {
    std::uint32_t corners[8] = {}, wanted = 0;
    for (int cell = 0; cell < 8; ++cell) {
        for (int c = 0; c < 8; ++c) corners[cell] |= 1u << group_point(cell, c);
        if ((inside & corners[cell]) != 0 && (~inside & corners[cell]) != 0) wanted |= corners[cell];
    }
    if (wanted == 0) return;
    double w[group_points];
    std::uint32_t known = 0;  // what is not is beyond the bounding box
    select_points(cube, [&](int i, std::int32_t of_mesh, std::int32_t of_filling) {
        if ((wanted >> i & 1) == 0) return false;
        w[i] = precise_winding(cube, i, of_mesh, of_filling, scratch);
        known |= 1u << i;
        return false;
    });
    for (int cell = 0; cell < 8; ++cell) {
        if ((inside & corners[cell]) == 0 || (~inside & corners[cell]) == 0) continue;
        for (int c = 0; c < 8; ++c) {
            const int p = group_point(cell, c);
            if ((known >> p & 1) == 0) continue;
            double squares = 0;
            for (const int axis : {1, 2, 4}) {
                const int q = group_point(cell, c ^ axis);
                const double change = (known >> q & 1) != 0 ? w[p] - w[q] : 0.0;
                if (std::abs(change) < 0.5) squares += change * change;
            }
            const double above = std::abs(w[p] - 0.5);
            if (squares > 0 || above == 0)
                near.push_back({morton_encode({std::uint32_t(cube.begin(0) + p % 3),
                                               std::uint32_t(cube.begin(1) + p / 3 % 3),
                                               std::uint32_t(cube.begin(2) + p / 9)}),
                                above == 0 ? 0.0 : above / std::sqrt(squares)});
        }
    }
}

/// Keeps the least distance of each point.
void GeneralizedSigns::remember(std::vector<Near>& near) {
    std::sort(near.begin(), near.end());
    for (const Near& n : near) {
        if (!hole_point_.empty() && hole_point_.back() == n.point) continue;
        hole_point_.push_back(n.point);
        hole_distance_.push_back(n.distance);
        hole_filter_[filter_place(n.point)] = true;
    }
}

std::size_t GeneralizedSigns::filter_place(std::uint64_t point) {
    return std::size_t((point * 0x9e3779b97f4a7c15ull) >> (64 - filter_bits));
}

/// The distance of a lattice point from where w = ½, in a cell that it is a corner of; infinity if it is of
/// none.
double GeneralizedSigns::hole_distance(std::uint64_t point) const {
    if (!hole_filter_[filter_place(point)]) return std::numeric_limits<double>::infinity();
    const auto it = std::lower_bound(hole_point_.begin(), hole_point_.end(), point);
    if (it == hole_point_.end() || *it != point) return std::numeric_limits<double>::infinity();
    return hole_distance_[std::size_t(it - hole_point_.begin())];
}

void GeneralizedSigns::add_flip_cells(Voxels& voxels, const Progress& progress) {
    if (filling_.empty()) return;
    struct Found {
        std::vector<std::uint64_t> cell, cube;
        std::vector<std::uint32_t> inside;
        std::vector<Near> near;
    };
    std::vector<std::uint64_t> cubes{0};
    std::vector<Near> near;
    for (int level = lattice_.depth + 1; level >= 1; --level) {
        Stage stage(progress, "signs, holes", cubes.size());
        std::vector<Found> found(chunk_count(cubes.size(), cube_grain));
        for_chunks(cubes.size(), cube_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            Scratch scratch;
            for (std::uint64_t i = begin; i < end; ++i) {
                const Cube cube{level, morton_decode(cubes[i])};
                if (!judge(cube, scratch).may_flip) continue;
                const std::uint32_t bits = level == 1 ? inside_points(cube, scratch) : 0;
                if (level == 1) {
                    found[chunk].cube.push_back(cubes[i]);
                    found[chunk].inside.push_back(bits);
                    find_near(cube, bits, scratch, found[chunk].near);
                }
                for (int child = 0; child < 8; ++child) {
                    unsigned corners = 0;
                    for (int c = 0; c < 8; ++c) corners |= (bits >> group_point(child, c) & 1) << c;
                    if (level > 1 || (corners != 0 && corners != 0xff))
                        found[chunk].cell.push_back(cubes[i] << 3 | std::uint64_t(child));
                }
            }
            stage.advance(end - begin);
        });
        cubes.clear();
        for (const Found& part : found) {
            cubes.insert(cubes.end(), part.cell.begin(), part.cell.end());
            known_cube_.insert(known_cube_.end(), part.cube.begin(), part.cube.end());
            known_inside_.insert(known_inside_.end(), part.inside.begin(), part.inside.end());
            near.insert(near.end(), part.near.begin(), part.near.end());
        }
    }
    remember(near);

    Voxels all;
    all.cell.reserve(voxels.cell.size() + cubes.size());
    std::set_union(voxels.cell.begin(), voxels.cell.end(), cubes.begin(), cubes.end(),
                   std::back_inserter(all.cell));
    all.offset.reserve(all.cell.size() + 1);
    std::size_t old = 0;
    for (const std::uint64_t cell : all.cell) {
        all.offset.push_back(voxels.offset[old]);
        if (old < voxels.cell.size() && voxels.cell[old] == cell) ++old;
    }
    all.offset.push_back(voxels.offset[old]);
    all.triangle = std::move(voxels.triangle);
    voxels = std::move(all);
}

void GeneralizedSigns::shorten(const Cube& cube, double* distance) const {
    for (int p = 0; p < group_points; ++p) {
        const std::uint64_t code = morton_encode({std::uint32_t(cube.begin(0) + cube.step() * (p % 3)),
                                                  std::uint32_t(cube.begin(1) + cube.step() * (p / 3 % 3)),
                                                  std::uint32_t(cube.begin(2) + cube.step() * (p / 9))});
        distance[p] = std::min(distance[p], hole_distance(code));
    }
}

void GeneralizedSigns::apply(const Octree& octree, std::vector<std::vector<double>>& distance,
                             const Progress& progress) const {
    std::vector<Judgement> judged(1);
    for (int level = octree.depth; level >= 0; --level) {
        const Level& groups = octree.levels[std::size_t(level)];
        std::vector<Judgement> below(groups.first.back());
        Stage stage(progress, "signs", groups.groups());
        for_chunks(groups.groups(), cube_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
            Scratch scratch;
            for (std::uint64_t g = begin; g < end; ++g) {
                const Cube cube{level + 1, morton_decode(groups.parent[g])};
                std::uint32_t bits = 0;
                if (judged[g].decided || !recall(cube, bits)) {
                    if (!judged[g].decided) judged[g] = judge(cube, scratch);
                    bits = judged[g].decided ? points_above(cube, judged[g].threshold)
                                             : inside_points(cube, scratch);
                }
                double* const d = &distance[std::size_t(level)][group_points * g];
                if (!hole_point_.empty()) shorten(cube, d);
                for (int p = 0; p < group_points; ++p)
                    if (bits >> p & 1) d[p] = 0.0 - d[p];  // +0 stays +0
                for (std::uint64_t child = groups.first[g]; level > 0 && child < groups.first[g + 1]; ++child)
                    below[child] = judged[g];
            }
            stage.advance(end - begin);
        });
        judged = std::move(below);
    }
}

}  // namespace its
