#include "signs/generalized.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.h"
#include "base/progress.h"
#include "geometry/vec3.h"
#include "mesh/arrays.h"

namespace its::signs {

namespace {

constexpr std::uint64_t cube_grain = 64, flip_grain = 4;
/// As many make enough parts of work.
constexpr std::size_t many_cubes = 256;

/// Parts of F are expanded for cubes where each errs by less than this; measured, docs/design/signs.md.
constexpr double tolerance = 0x1p-11;
/// Patches smaller than this part of a ball's radius are left whole until cubes are smaller.
constexpr double whole_patch = 1;
/// For points that these estimates leave open: a first try, and a second.
constexpr double first_tolerance = 0x1p-14, second_tolerance = 0x1p-20;

/// Winding numbers from which the distance to where w = ½ is derived need no proof: an estimate is taken if its
/// bound is this, since its error is far below.
constexpr double precise_enough = 0x1p-4, precise_tolerance = 0x1p-13;

/// With fewer edges their sum is cheaper than another estimate.
constexpr std::uint64_t few_edges = 32;

constexpr std::int32_t never = std::numeric_limits<std::int32_t>::max();

}  // namespace

/// A cube of level `level` ≥ 1, whose 27 points are 2^(level − 1) apart.
struct GeneralizedSigns::Cube {
    int level;
    octree::Cell at;
    std::int64_t step() const { return std::int64_t{1} << (level - 1); }
    std::int64_t begin(int axis) const { return 2 * step() * at[std::size_t(axis)]; }
    std::int64_t end(int axis) const { return begin(axis) + 2 * step(); }
};

struct GeneralizedSigns::Scratch {
    explicit Scratch(const GeneralizedSigns& signs)
        : octants(std::size_t(signs.lattice_.depth) + 3, signs.space_),
          code(octants.size(), ~std::uint64_t{0}) {}

    std::vector<winding::Octants> octants;  ///< by level of the cube that they halve
    std::vector<std::uint64_t> code;        ///< which that is

    winding::Octants::Points points;  ///< of inside_points()
    winding::Octants::Estimates estimates;
    std::int32_t of_mesh[octree::group_points], of_filling[octree::group_points];  ///< crossings before each
    std::uint32_t within;  ///< those in the bounding box
};

Vec3 GeneralizedSigns::centre(const Cube& cube) const {
    return lattice_.position(
        {cube.begin(0) + cube.step(), cube.begin(1) + cube.step(), cube.begin(2) + cube.step()});
}

/// Of its 27 points.
Vec3 GeneralizedSigns::position(const Cube& cube, int i) const {
    return lattice_.position({cube.begin(0) + cube.step() * (i % 3), cube.begin(1) + cube.step() * (i / 3 % 3),
                              cube.begin(2) + cube.step() * (i / 9)});
}

/// The cubes that halve a cube of level ≥ 2, and above it all that hold it, found anew only where that changes.
winding::Octants& GeneralizedSigns::octants(const Cube& cube, Scratch& scratch) const {
    const auto level = std::size_t(cube.level);
    const std::uint64_t code = octree::morton_encode(cube.at);
    winding::Octants& out = scratch.octants[level];
    if (scratch.code[level] == code) return out;
    const bool top = cube.level > lattice_.depth + 1;  // twice as wide as the root
    const winding::Octants& from =
        top ? space_ : octants({cube.level + 1, octree::morton_decode(code >> 3)}, scratch);
    winding::Octants::Cubes halves;
    halves.half = 0.5 * double(cube.step()) * lattice_.width;
    for (int i = 0; i < 8; ++i) {
        const Vec3 c = centre({cube.level - 1, octree::morton_decode(code << 3 | std::uint64_t(i))});
        halves.x[i] = c.x;
        halves.y[i] = c.y;
        halves.z[i] = c.z;
    }
    out.narrow(from, top ? 0 : int(code & 7), halves, tolerance,
               cube.level == 2 ? 0.0 : whole_patch * 2 * halves.half);
    scratch.code[level] = code;
    return out;
}

GeneralizedSigns::GeneralizedSigns(const mesh::Arrays& mesh, const octree::Lattice& lattice,
                                   const octree::Voxels& voxels, const Progress& progress,
                                   std::optional<winding::Filling> filling)
    : lattice_(lattice),
      filling_(filling ? *std::move(filling) : winding::Filling(mesh)),
      space_(filling_),
      mesh_lines_(mesh, lattice, voxels, Parts(progress).until(0.5)),
      filling_lines_(filling_.surface(), lattice, mesh_lines_, Parts(progress, 0.5).until(1)) {
    const Box box = octree::bounds(mesh);
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
GeneralizedSigns::Judgement GeneralizedSigns::judge(const winding::Octants& octants, int lane,
                                                    const Cube& cube) const {
    bool within = true, apart = false;
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t first = first_[std::size_t(axis)], last = last_[std::size_t(axis)];
        within = within && cube.begin(axis) >= first && cube.end(axis) <= last;
        apart = apart || cube.end(axis) < first || cube.begin(axis) > last;
    }
    if (apart) return {.decided = true, .may_flip = false, .threshold = never};
    const double variation = octants.variation(lane);
    if (!(variation < 0.5)) return {.decided = false, .may_flip = true, .threshold = 0};
    const winding::WindingEstimate w = octants.at_centre(lane);
    const double spread = variation + w.error + winding::decision_gap;
    const bool clear = octants.clear(lane);
    Judgement out;
    out.may_flip = !(std::abs(w.value - (std::floor(w.value) + 0.5)) > spread);
    out.decided = !out.may_flip && clear;
    out.threshold = std::int32_t(std::floor(w.value + 0.5));
    // At the side of the bounding box inside ends, should it reach so far: there W = 0 beyond.
    if (!within && (!clear || w.value - spread < -0.5)) out.may_flip = true;
    return out;
}

GeneralizedSigns::Judgements GeneralizedSigns::judge_halves(const Cube& cube, Scratch& scratch) const {
    const winding::Octants& halves = octants(cube, scratch);
    const std::uint64_t code = octree::morton_encode(cube.at);
    Judgements out;
    for (int i = 0; i < 8; ++i)
        out[std::size_t(i)] =
            judge(halves, i, {cube.level - 1, octree::morton_decode(code << 3 | std::uint64_t(i))});
    return out;
}

namespace {

/// Whether `estimate` tells on which side w = (crossings of M + F) − w_F is; `above` receives w − ½.
bool settles(const winding::WindingEstimate& estimate, std::int32_t crossings, double& above) {
    above = crossings - estimate.value - 0.5;
    return std::abs(above) > estimate.error + winding::decision_gap;
}

}  // namespace

/// w > ½ for what no estimate decides; w = (crossings of M) + boundary term.
bool GeneralizedSigns::decide_exactly(const Vec3& p, std::int32_t of_mesh) const {
    const winding::WindingEstimate boundary = filling_.boundary_term(p);
    return of_mesh + boundary.value - 0.5 > boundary.error;
}

/// Bit i is set if point i of the cube's 27 is in the bounding box, and inside(i, crossings of M and of F
/// before it).
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

/// Of a cube of level 1. Leaves estimates and crossings in `scratch`.
std::uint32_t GeneralizedSigns::inside_points(const Cube& cube, Scratch& scratch) const {
    const std::uint64_t code = octree::morton_encode(cube.at);
    winding::Octants::Points& points = scratch.points;
    for (int i = 0; i < winding::Octants::block; ++i) {
        const Vec3 p = position(cube, std::min(i, octree::group_points - 1));
        points.x[i] = p.x;
        points.y[i] = p.y;
        points.z[i] = p.z;
    }
    octants({cube.level + 1, octree::morton_decode(code >> 3)}, scratch)
        .at(int(code & 7), points, scratch.estimates);
    scratch.within = 0;
    std::uint32_t open = 0;
    std::uint32_t bits = select_points(cube, [&](int i, std::int32_t of_mesh, std::int32_t of_filling) {
        scratch.within |= 1u << i;
        scratch.of_mesh[i] = of_mesh;
        scratch.of_filling[i] = of_filling;
        double above = 0;
        if (!settles({scratch.estimates.value[i], scratch.estimates.error[i]}, of_mesh + of_filling, above))
            open |= 1u << i;
        return above > 0;
    });
    if (filling_.edges() > few_edges)
        for (const double accuracy : {first_tolerance, second_tolerance}) refine(accuracy, open, bits, scratch);
    for (int i = 0; i < octree::group_points; ++i) {
        if ((open >> i & 1) == 0) continue;
        const bool inside = decide_exactly({points.x[i], points.y[i], points.z[i]}, scratch.of_mesh[i]);
        bits = (bits & ~(1u << i)) | std::uint32_t(inside) << i;
    }
    return bits;
}

/// Estimates those of the points that are `open`, some at once, until they settle.
void GeneralizedSigns::refine(double accuracy, std::uint32_t& open, std::uint32_t& bits,
                              Scratch& scratch) const {
    std::uint32_t left = 0;
    while (open != 0) {
        int which[winding::Filling::block], count = 0;
        for (; open != 0 && count < winding::Filling::block; open &= open - 1)
            which[count++] = std::countr_zero(open);
        winding::Filling::Points points;
        for (int j = 0; j < winding::Filling::block; ++j) {
            const int i = which[std::min(j, count - 1)];
            points.x[j] = scratch.points.x[i];
            points.y[j] = scratch.points.y[i];
            points.z[j] = scratch.points.z[i];
        }
        winding::Filling::Estimates estimates;
        filling_.winding(points, accuracy, estimates);
        for (int j = 0; j < count; ++j) {
            const int i = which[j];
            scratch.estimates.value[i] = estimates.value[j];
            scratch.estimates.error[i] = estimates.error[j];
            double above = 0;
            if (!settles({estimates.value[j], estimates.error[j]}, scratch.of_mesh[i] + scratch.of_filling[i],
                         above))
                left |= 1u << i;
            bits = (bits & ~(1u << i)) | std::uint32_t(above > 0) << i;
        }
    }
    open = left;
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
    const Vec3 p = lattice_.position(at);
    double above = 0;
    if (settles(filling_.winding(p, first_tolerance), of_mesh[0] + of_filling[0], above)) return above > 0;
    return decide_exactly(p, of_mesh[0]);
}

/// The winding number of a point of inside_points(), precise enough to tell how far w = ½ is.
double GeneralizedSigns::precise_winding(int i, const Scratch& scratch) const {
    const std::int32_t crossings = scratch.of_mesh[i] + scratch.of_filling[i];
    if (scratch.estimates.error[i] <= precise_enough) return crossings - scratch.estimates.value[i];
    const Vec3 p{scratch.points.x[i], scratch.points.y[i], scratch.points.z[i]};
    const winding::WindingEstimate precise = filling_.winding(p, precise_tolerance);
    if (precise.error <= precise_enough) return crossings - precise.value;
    return scratch.of_mesh[i] + filling_.boundary_term(p).value;
}

/// Corners of the cube's finest cells in which a way without a triangle changes sides: across a triangle w
/// jumps by a whole number, along the rest of a cell's edge it changes by less than ½. `inside`: of
/// inside_points(). To first order w = ½ on a plane at |w − ½| / |∇w|, with the differences along the cell's
/// edges as the gradient.
void GeneralizedSigns::find_near(const Cube& cube, std::uint32_t inside, Scratch& scratch,
                                 std::vector<HolePoints::Point>& near) const {
    std::uint32_t corners[8] = {}, wanted = 0;
    for (int cell = 0; cell < 8; ++cell) {
        for (int c = 0; c < 8; ++c) corners[cell] |= 1u << octree::group_point(cell, c);
        if ((inside & corners[cell]) != 0 && (~inside & corners[cell]) != 0) wanted |= corners[cell];
    }
    wanted &= scratch.within;  // beyond the bounding box nothing is known
    double w[octree::group_points];
    for (int p = 0; p < octree::group_points; ++p)
        if (wanted >> p & 1) w[p] = precise_winding(p, scratch);
    double distance[octree::group_points];
    std::fill(std::begin(distance), std::end(distance), std::numeric_limits<double>::infinity());
    for (int cell = 0; cell < 8; ++cell) {
        if ((inside & corners[cell]) == 0 || (~inside & corners[cell]) == 0) continue;
        double squares[8] = {};
        bool hole = false;
        for (int c = 0; c < 8; ++c)
            for (const int axis : {1, 2, 4}) {
                const int p = octree::group_point(cell, c), q = octree::group_point(cell, c ^ axis);
                if ((wanted >> p & wanted >> q & 1) == 0) continue;
                const double change = w[p] - w[q];
                if (!(std::abs(change) < 0.5)) continue;
                squares[c] += change * change;
                hole = hole || ((inside >> p ^ inside >> q) & 1) != 0;
            }
        if (!hole) continue;
        for (int c = 0; c < 8; ++c) {
            const int p = octree::group_point(cell, c);
            if ((wanted >> p & 1) == 0) continue;
            const double above = std::abs(w[p] - 0.5);
            if (above == 0) distance[p] = 0;
            if (squares[c] > 0) distance[p] = std::min(distance[p], above / std::sqrt(squares[c]));
        }
    }
    for (int p = 0; p < octree::group_points; ++p)
        if (distance[p] < std::numeric_limits<double>::infinity())
            near.push_back({octree::morton_encode({std::uint32_t(cube.begin(0) + p % 3),
                                                   std::uint32_t(cube.begin(1) + p / 3 % 3),
                                                   std::uint32_t(cube.begin(2) + p / 9)}),
                            distance[p]});
}

struct GeneralizedSigns::Found {
    std::vector<FlipCubes> flips;
    std::vector<std::uint64_t> known_cube;
    std::vector<std::uint32_t> known_inside;
    std::vector<std::uint64_t> cells;
    std::vector<HolePoints::Point> near;
};

/// A cube of level 1 in which sides may change.
void GeneralizedSigns::visit_flip(const Cube& cube, Scratch& scratch, Found& found) const {
    const std::uint64_t code = octree::morton_encode(cube.at);
    const std::uint32_t bits = inside_points(cube, scratch);
    found.known_cube.push_back(code);
    found.known_inside.push_back(bits);
    find_near(cube, bits, scratch, found.near);
    for (int child = 0; child < 8; ++child) {
        unsigned corners = 0;
        for (int c = 0; c < 8; ++c) corners |= (bits >> octree::group_point(child, c) & 1) << c;
        if (corners != 0 && corners != 0xff) found.cells.push_back(code << 3 | std::uint64_t(child));
    }
}

/// A cube of level ≥ 2 in which sides may change, and those within it down to level `lowest`.
void GeneralizedSigns::descend(const Cube& cube, int lowest, Scratch& scratch, Found& found) const {
    if (cube.level == 1) return visit_flip(cube, scratch, found);
    const std::uint64_t code = octree::morton_encode(cube.at);
    const Judgements halves = judge_halves(cube, scratch);
    FlipCubes& flips = found.flips[std::size_t(cube.level)];
    flips.cube.push_back(code);
    flips.judged.push_back(halves);
    for (std::uint64_t i = 0; i < 8 && cube.level > lowest; ++i)
        if (halves[i].may_flip)
            descend({cube.level - 1, octree::morton_decode(code << 3 | i)}, lowest, scratch, found);
}

namespace {

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
    to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

/// From the root down: level by level while there are few cubes, then each cube's part of space by itself.
void GeneralizedSigns::find_flips(std::vector<std::uint64_t>& cells, std::vector<HolePoints::Point>& near,
                                  const Progress& progress) {
    const int top = lattice_.depth + 1;
    Parts parts(progress);
    flips_.assign(std::size_t(top) + 1, {});
    std::vector<std::uint64_t> cubes{0};
    for (int level = top; level >= 1 && !cubes.empty(); --level) {
        const bool last = level <= 2 || cubes.size() >= many_cubes;
        Stage stage(last ? parts.until(1) : parts.next(0.02), "signs, holes", cubes.size());
        std::vector<Found> found(chunk_count(cubes.size(), flip_grain));
        for_chunks(cubes.size(), flip_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            Scratch scratch(*this);
            found[chunk].flips.resize(flips_.size());
            for (std::uint64_t i = begin; i < end; ++i)
                descend({level, octree::morton_decode(cubes[i])}, last ? 1 : level, scratch, found[chunk]);
            stage.advance(end - begin);
        });
        for (const Found& part : found) {
            for (std::size_t l = 0; l < flips_.size(); ++l) {
                append(flips_[l].cube, part.flips[l].cube);
                append(flips_[l].judged, part.flips[l].judged);
            }
            append(known_cube_, part.known_cube);
            append(known_inside_, part.known_inside);
            append(cells, part.cells);
            append(near, part.near);
        }
        if (last) return;
        const FlipCubes& flips = flips_[std::size_t(level)];
        cubes.clear();
        for (std::size_t i = 0; i < flips.cube.size(); ++i)
            for (std::uint64_t half = 0; half < 8; ++half)
                if (flips.judged[i][half].may_flip) cubes.push_back(flips.cube[i] << 3 | half);
    }
}

void GeneralizedSigns::add_flip_cells(octree::Voxels& voxels, const Progress& progress) {
    if (filling_.empty()) return;
    std::vector<std::uint64_t> cubes;
    std::vector<HolePoints::Point> near;
    find_flips(cubes, near, progress);
    holes_ = HolePoints(std::move(near));

    octree::Voxels all;
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

/// Where a code is in a list in ascending order; its size if it is not there.
std::size_t GeneralizedSigns::find(const std::vector<std::uint64_t>& list, std::uint64_t code) {
    const auto it = std::lower_bound(list.begin(), list.end(), code);
    return it != list.end() && *it == code ? std::size_t(it - list.begin()) : list.size();
}

/// What is known of the cubes that halve one of level ≥ 2.
GeneralizedSigns::Judgements GeneralizedSigns::halves_of(const Cube& cube, const Judgement& judged,
                                                         Scratch& scratch) const {
    Judgements halves;
    halves.fill(judged);
    if (judged.decided) return halves;
    if (!flips_.empty()) {
        const FlipCubes& flips = flips_[std::size_t(cube.level)];
        const std::size_t index = find(flips.cube, octree::morton_encode(cube.at));
        if (index < flips.cube.size()) return flips.judged[index];
    }
    return judge_halves(cube, scratch);
}

/// Which points of a cube of level 1 are inside.
std::uint32_t GeneralizedSigns::finest_points(const Cube& cube, const Judgement& judged,
                                              Scratch& scratch) const {
    if (judged.decided) return points_above(cube, judged.threshold);
    const std::size_t index = find(known_cube_, octree::morton_encode(cube.at));
    if (index < known_cube_.size()) return known_inside_[index];
    return inside_points(cube, scratch);
}

/// Which points of a group are inside, from those of the groups below it. These tell it of the cells that they
/// refine. Any other cell of the group has one side, and the middle of the group for a corner.
std::uint32_t GeneralizedSigns::coarse_points(const octree::Octree& octree, int level, std::uint64_t group,
                                              const std::vector<std::uint32_t>& below) {
    const octree::Level& groups = octree.levels[std::size_t(level)];
    std::uint32_t bits = 0, refined = 0;
    for (std::uint64_t child = groups.first[group]; child < groups.first[group + 1]; ++child) {
        const int cell = int(octree.levels[std::size_t(level) - 1].parent[child] & 7);
        refined |= 1u << cell;
        for (int c = 0; c < 8; ++c) {
            const int corner = 2 * ((c & 1) + 3 * (c >> 1 & 1) + 9 * (c >> 2));
            bits |= (below[child] >> corner & 1) << octree::group_point(cell, c);
        }
    }
    constexpr int middle = octree::group_points / 2;
    if ((bits >> middle & 1) == 0) return bits;
    for (int cell = 0; cell < 8; ++cell)
        for (int c = 0; c < 8 && (refined >> cell & 1) == 0; ++c) bits |= 1u << octree::group_point(cell, c);
    return bits;
}

std::vector<std::uint32_t> GeneralizedSigns::find_finest(const octree::Octree& octree,
                                                         const Progress& progress) const {
    std::vector<std::uint32_t> bits(octree.levels[0].groups());
    std::vector<Judgement> judged(1);
    Parts parts(progress);
    for (int level = octree.depth; level >= 0; --level) {
        const octree::Level& groups = octree.levels[std::size_t(level)];
        std::vector<Judgement> below(level > 0 ? groups.first.back() : 0);
        Stage stage(parts.until(std::exp2(-2 * level)), "signs", groups.groups());
        for_chunks(groups.groups(), cube_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
            Scratch scratch(*this);
            for (std::uint64_t g = begin; g < end; ++g) {
                const Cube cube{level + 1, octree::morton_decode(groups.parent[g])};
                if (level == 0) {
                    bits[g] = finest_points(cube, judged[g], scratch);
                    continue;
                }
                const Judgements halves = halves_of(cube, judged[g], scratch);
                for (std::uint64_t child = groups.first[g]; child < groups.first[g + 1]; ++child)
                    below[child] = halves[octree.levels[std::size_t(level) - 1].parent[child] & 7];
            }
            stage.advance(end - begin);
        });
        judged = std::move(below);
    }
    return bits;
}

void GeneralizedSigns::apply(const octree::Octree& octree, std::vector<std::vector<double>>& distance,
                             const Progress& progress) const {
    Parts parts(progress);
    std::vector<std::uint32_t> bits = find_finest(octree, parts.until(0.8)), below;
    for (int level = 0; level <= octree.depth; ++level) {
        const octree::Level& groups = octree.levels[std::size_t(level)];
        if (level > 0) {
            below.swap(bits);
            bits.assign(groups.groups(), 0);
        }
        Stage stage(parts.next(level < octree.depth ? 0.75 : 1), "signs, all levels", groups.groups());
        for_chunks(groups.groups(), cube_grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t g = begin; g < end; ++g) {
                if (level > 0) bits[g] = coarse_points(octree, level, g, below);
                double* const d = &distance[std::size_t(level)][octree::group_points * g];
                holes_.shorten(octree::morton_decode(groups.parent[g]), level, d);
                for (int p = 0; p < octree::group_points; ++p)
                    if (bits[g] >> p & 1) d[p] = 0.0 - d[p];  // +0 stays +0
            }
            stage.advance(end - begin);
        });
    }
}

}  // namespace its::signs
