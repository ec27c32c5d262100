#include "query/open_sides.h"

#include <algorithm>
#include <cmath>

#include "geometry/box.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "query/crossing.h"

namespace its::query {

using winding::Octants;

namespace {

/// Parts of F are expanded for cubes where each errs by less than this.
constexpr double tolerance = 0x1p-11;
/// Patches smaller than this part of a ball's radius are left whole until cubes are smaller.
constexpr double whole_patch = 1;
/// A function is taken if it is this good, and in the smallest cubes if it is of any use.
constexpr double good_error = 0x1p-7, useful_error = 0.25;
/// Cubes that need not be halved to find a leaf of the shell are halved to a depth between these such that
/// those around the boundary are not more, in a row along it, than:
constexpr int least_depth = 7, most_depth = 10;
constexpr double most_cubes = 10000;

// Numbers of a surface cell: bits 0–7 corners with n ≥ 1, then n of the lowest one plus an offset, at most
// most_number, and a bit that is always set.
constexpr std::uint32_t known = 1u << 31;
constexpr std::int64_t most_number = (1 << 22) - 1;

/// \param length  of the boundary, over the side of the root
int finest_for(double length) {
    int depth = most_depth;
    while (depth > least_depth && std::ldexp(length, depth) > most_cubes) --depth;
    return depth;
}

}  // namespace

std::uint32_t OpenSides::node_of(Kind kind, std::uint64_t number) {
    if (number > number_mask)
        throw MemoryError("sides of an open mesh: its boundary is too long for an index of 2²⁸ cubes");
    return std::uint32_t(kind) << kind_shift | std::uint32_t(number);
}

OpenSides::OpenSides(const QueryIndex& index)
    : winding_(index.shell.mesh.vertices, index.shell.mesh.triangles),
      bounds_(geometry::bounds(index.shell.mesh.vertices, index.shell.mesh.triangles)),
      side_(index.cells * index.width),
      finest_(finest_for(winding_.filling().boundary_length() / side_)),
      bits_(std::max(index.shell.octree.depth + 1, finest_)),
      grid_bits_(index.shell.octree.depth + 1 - index.level),
      fine_(std::ldexp(1.0, bits_ - index.shell.octree.depth - 1)),
      start_(std::size_t{index.side} * index.side * index.side + 1),
      cells_(index.shell.octree.surface_cells()) {
    const octree::Lattice& lattice = index.shell.lattice;
    slack_ = lattice.width * (lattice.mapping_error() + 4 * unit_roundoff * lattice.reach());
    numbers_ = std::make_unique<std::atomic<std::uint32_t>[]>(cells_);
    const Octants space(winding_.filling());
    octants_.assign(std::size_t(bits_), space);
    const Cube root{0, {}, {Below::divided, 0, 0, index.shell.octree.depth + 1}};
    fill_start(judge(index, root, space, -1), 0, {});
    octants_ = {};
}

OpenSides::Below OpenSides::below(const QueryIndex& index, std::uint64_t group, unsigned child, int level) {
    const LevelView& view = index.levels[std::size_t(level)];
    const bool marked = view.mask[group] >> child & 1;
    if (marked && level > 0) return {Below::divided, group, child, level};
    return {marked || is_surface(view, group, child) ? Below::surface : Below::empty, group, child, level};
}

OpenSides::Cube OpenSides::half_of(const QueryIndex& index, const Cube& cube, unsigned child) {
    Cube half{cube.depth + 1, {}, cube.below};
    for (unsigned axis = 0; axis < 3; ++axis) half.at[axis] = 2 * cube.at[axis] + (child >> axis & 1);
    if (cube.below.kind == Below::divided) {
        const std::uint64_t group = cube.depth == 0 ? 0
                                                    : rank(index.levels[std::size_t(cube.below.level)],
                                                           cube.below.group, cube.below.child);
        half.below = below(index, group, child, cube.below.level - 1);
    }
    return half;
}

bool OpenSides::meets_mesh(const QueryIndex& index, const Below& at) {
    if (at.kind == Below::empty) return false;
    if (at.kind == Below::surface) {
        const shell::TriangleList list = triangles_of(index, at.group, at.child, at.level);
        return list.begin() != list.end();
    }
    const std::uint64_t group = rank(index.levels[std::size_t(at.level)], at.group, at.child);
    for (unsigned child = 0; child < 8; ++child)
        if (meets_mesh(index, below(index, group, child, at.level - 1))) return true;
    return false;
}

Vec3 OpenSides::centre_of(const QueryIndex& index, int depth, const octree::Cell& at) const {
    const double side = std::ldexp(side_, -depth);
    Vec3 centre;
    for (int axis = 0; axis < 3; ++axis)
        centre[axis] = index.origin[axis] + (at[std::size_t(axis)] + 0.5) * side;
    return centre;
}

std::uint32_t OpenSides::halve(const QueryIndex& index, const Cube& cube, const Octants& from, int lane) {
    const double side = std::ldexp(side_, -cube.depth - 1);
    Octants::Cubes halves;
    halves.half = 0.5 * side + 2 * slack_;
    for (unsigned i = 0; i < 8; ++i) {
        const Cube half = half_of(index, cube, i);
        const Vec3 centre = centre_of(index, half.depth, half.at);
        halves.x[i] = centre.x;
        halves.y[i] = centre.y;
        halves.z[i] = centre.z;
    }
    Octants& octants = octants_[std::size_t(cube.depth)];
    octants.narrow(from, lane, halves, tolerance, cube.depth + 1 >= finest_ ? 0.0 : whole_patch * side);
    const std::uint64_t group = nodes_.size() / 8;
    nodes_.resize(nodes_.size() + 8);
    for (unsigned i = 0; i < 8; ++i) {
        const std::uint32_t node = judge(index, half_of(index, cube, i), octants, int(i));
        nodes_[8 * group + i] = node;
    }
    return node_of(halved, group);
}

/// With w_F within `spread` of its value at the centre, but for whole numbers, w = W − w_F keeps away from ½ +
/// Z if that does. Beyond M's bounds W = 0: inside ends there, unless w ≤ ½ anyway.
/// \param lane  of the cube; −1: the root
std::uint32_t OpenSides::judge(const QueryIndex& index, const Cube& cube, const Octants& octants, int lane) {
    if (winding_.filling().empty()) return node_of(steady);
    if (lane < 0) return halve(index, cube, octants, 0);
    const double half = 0.5 * std::ldexp(side_, -cube.depth);
    const Vec3 centre = centre_of(index, cube.depth, cube.at);
    bool within = true;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = centre[axis] - half - 2 * slack_, high = centre[axis] + half + 2 * slack_;
        if (high < bounds_.min[axis] || low > bounds_.max[axis]) return node_of(outside);
        within = within && low >= bounds_.min[axis] && high <= bounds_.max[axis];
    }
    const bool leaf = cube.below.kind != Below::divided,
               in_leaf = leaf && cube.depth + cube.below.level > index.shell.octree.depth + 1;
    const winding::WindingEstimate w = octants.at_centre(lane);
    const double spread = octants.variation(lane) + w.error + winding::decision_gap;
    const bool far = std::abs(w.value - (std::floor(w.value) + 0.5)) > spread,
               ends = !within && (!octants.clear(lane) || w.value - spread < -0.5);
    if (far && !ends && !in_leaf) return node_of(steady);
    const bool mesh = meets_mesh(index, cube.below);
    if (far && !ends) {  // n is known at the centre
        const double n = std::round(winding_.crossings(centre) - w.value);
        if (!mesh) return node_of(n >= 1 ? inside : outside);
        return add_number(cube, n) | with_mesh;
    }
    if (mesh && !leaf) return halve(index, cube, octants, lane);
    const Octants::Quadratic function = octants.quadratic(lane);
    if (function.error < good_error) return add_function(cube, function, centre, mesh);
    if (cube.depth < finest_) return halve(index, cube, octants, lane);
    if (function.error < useful_error) return add_function(cube, function, centre, mesh);
    return node_of(unknown) | (mesh ? with_mesh : 0);
}

/// w = W − w_F, scaled to t. Floats lose 2⁻²⁴ of each coefficient; computing t and the function takes some
/// roundings of doubles. |t| ≤ 1 but for the slack, and each coefficient of second order counts twice at most.
std::uint32_t OpenSides::add_function(const Cube& cube, const Octants::Quadratic& w, const Vec3& centre,
                                      bool mesh) {
    const double half = 0.5 * std::ldexp(side_, -cube.depth);
    Quadratic f{};
    f.depth = cube.depth;
    f.value = float(winding_.crossings(centre) - w.value);
    double most = std::abs(f.value);
    for (int k = 0; k < 3; ++k) {
        f.gradient[k] = float(-w.gradient[k] * half);
        most += std::abs(f.gradient[k]);
    }
    for (int k = 0; k < 6; ++k) {
        f.hessian[k] = float((k < 3 ? -0.5 : -1.0) * w.hessian[k] * (half * half));
        most += 2 * std::abs(f.hessian[k]);
    }
    f.error = float((w.error + 0x1p-22 * most) * (1 + 0x1p-20));
    functions_.push_back(f);
    return node_of(quadratic, functions_.size() - 1) | (mesh ? with_mesh : 0);
}

/// A whole number as a function: farther from ½ than its error.
std::uint32_t OpenSides::add_number(const Cube& cube, double number) {
    functions_.push_back({float(number), {}, {}, useful_error, cube.depth});
    return node_of(quadratic, functions_.size() - 1);
}

void OpenSides::fill_start(std::uint32_t node, int depth, const octree::Cell& at) {
    if (depth < grid_bits_ && node >> kind_shift == halved) {
        const std::uint64_t group = node & number_mask;
        for (unsigned i = 0; i < 8; ++i)
            fill_start(nodes_[8 * group + i], depth + 1,
                       {2 * at[0] + (i & 1), 2 * at[1] + (i >> 1 & 1), 2 * at[2] + (i >> 2)});
        return;
    }
    const std::uint32_t size = 1u << (grid_bits_ - depth), n = 1u << grid_bits_;
    for (std::uint32_t z = 0; z < size; ++z)
        for (std::uint32_t y = 0; y < size; ++y) {
            const std::uint64_t row =
                (std::uint64_t{at[2] * size + z} * n + at[1] * size + y) * n + at[0] * size;
            std::fill_n(start_.begin() + std::ptrdiff_t(row), size, node);
        }
}

void OpenSides::settle(std::vector<std::uint32_t>& top) {
    for (std::size_t i = 0; i < start_.size(); ++i) {
        const auto kind = Kind(start_[i] >> kind_shift);
        if ((kind != outside && kind != inside) ||
            (top[i] & (QueryIndex::subdivided | QueryIndex::surface)) != 0)
            continue;
        top[i] = (top[i] & ~QueryIndex::inside) | (kind == inside ? QueryIndex::inside : 0u);
        start_[i] = node_of(steady);
    }
}

double OpenSides::value_at(const Quadratic& f, const Vec3& t) {
    const float* const h = f.hessian;
    return f.value + (f.gradient[0] + h[0] * t.x + h[3] * t.y + h[4] * t.z) * t.x +
           (f.gradient[1] + h[1] * t.y + h[5] * t.z) * t.y + (f.gradient[2] + h[2] * t.z) * t.z;
}

Side OpenSides::by_sum(const Vec3& point) const {
    const int side = winding_.above_half(point);
    return side == 0 ? Side::uncertain : side > 0 ? Side::inside : Side::outside;
}

Side OpenSides::side(const QueryIndex& index, std::uint32_t node, const Vec3& point, const Vec3& u) const {
    const auto kind = Kind(node >> kind_shift);
    if (kind == outside || kind == inside) return kind == inside ? Side::inside : Side::outside;
    if (!geometry::contains(bounds_, point)) return Side::outside;

    const Quadratic* const f = kind == quadratic ? &functions_[node & number_mask] : nullptr;
    Vec3 centre = point;
    if (f != nullptr) {
        octree::Cell at = place_of(u);
        for (std::uint32_t& i : at) i >>= bits_ - f->depth;
        centre = centre_of(index, f->depth, at);
    }
    int crossings = 0;
    if (node & with_mesh) {
        const shell::MeshArrays& mesh = index.shell.mesh;
        const Place place = descend(index.levels.data(), 0, index.shell.octree.depth, finest_cell(u));
        if (place.marked)
            for (const std::uint32_t number : triangles_of(index, place.group, place.child, place.level)) {
                const Triangle& t = mesh.triangles[number];
                const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
                if (!boxes_meet(a, b, c, point, centre)) continue;
                const int side = geometry::orient3d(a, b, c, point);
                if (side == 0 && triangle_holds(a, b, c, point)) return Side::on_surface;
                if (f != nullptr) crossings += displaced_crossing(a, b, c, point, side, centre);
            }
    }
    if (f != nullptr) {
        const double above = value_at(*f, std::ldexp(2 / side_, f->depth) * (point - centre)) - crossings - 0.5;
        if (std::abs(above) > f->error) return above > 0 ? Side::inside : Side::outside;
    }
    return by_sum(point);
}

OpenSides::Numbers OpenSides::numbers(const QueryIndex& index, const SurfacePoint& at,
                                      std::uint64_t cell) const {
    const std::uint32_t stored = numbers_[cell].load(std::memory_order_relaxed);
    if (stored != 0) return {std::int64_t(stored >> 8 & ~(known >> 8)) - most_number, stored & 0xff};
    const Numbers found = find_numbers(index, at);
    if (std::abs(found.lowest) <= most_number)
        numbers_[cell].store(known | std::uint32_t(found.lowest + most_number) << 8 | found.inside,
                             std::memory_order_relaxed);
    return found;
}

/// From the lowest corner along x, then y, then z: whatever lies between corners is in the cell's list.
OpenSides::Numbers OpenSides::find_numbers(const QueryIndex& index, const SurfacePoint& at) const {
    const octree::Lattice& lattice = index.shell.lattice;
    const shell::MeshArrays& mesh = index.shell.mesh;
    const std::int64_t step = std::int64_t{1} << at.level;
    Vec3 position[2];
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < 2; ++i)
            position[i][axis] = lattice.position(axis, at.corner[std::size_t(axis)] + i * step);
    std::int64_t number[8] = {};
    for (const std::uint32_t triangle : triangles_of(index, at.group, at.child, at.level)) {
        const Triangle& t = mesh.triangles[triangle];
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        int gain[8] = {};  // from the lowest corner
        for (int to = 1; to < 8; ++to) {
            const int axis = to >> 2 != 0 ? 2 : to >> 1 != 0 ? 1 : 0, from = to & ~(1 << axis);
            const Vec3 start{position[from & 1].x, position[from >> 1 & 1].y, position[0].z};
            gain[to] = gain[from] + geometry::line_crossing(axis, a, b, c, start, position[1][axis]);
            number[to] += gain[to];
        }
    }
    Numbers found{winding_.rounded(position[0]), 0};
    for (unsigned c = 0; c < 8; ++c)
        if (found.lowest + number[c] >= 1) found.inside |= 1u << c;
    return found;
}

std::uint64_t OpenSides::memory_bytes() const {
    return sizeof(*this) + winding_.memory_bytes() + nodes_.size() * sizeof(nodes_[0]) +
           functions_.size() * sizeof(functions_[0]) + start_.size() * sizeof(start_[0]) + 4 * cells_;
}

}  // namespace its::query
