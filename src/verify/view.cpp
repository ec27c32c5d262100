#include "verify/view.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace its::verifier {

View::View(const shell::ShellData& data) : data_(data), lattice_(data.lattice) {
    const std::vector<octree::Level>& levels = data.octree.levels;
    first_.resize(levels.size() > 1 && levels[1].leaf.size() > 0 ? levels.size() : 1);
    std::uint64_t before = 0;
    for (int k = 0; k < int(first_.size()); ++k) {
        std::vector<std::uint64_t>& first = first_[std::size_t(k)];
        const std::uint64_t groups = levels[std::size_t(k)].parent.size();
        first.reserve(groups + 1);
        for (std::uint64_t g = 0; g < groups; ++g) {
            first.push_back(before);
            before += std::uint64_t(std::popcount(surface_bits(k, g)));
        }
        first.push_back(before);
    }
}

unsigned View::surface_bits(int level, std::uint64_t group) const {
    const octree::Level& l = data_.octree.levels[std::size_t(level)];
    if (level == 0) return l.mask[group];
    return adaptive() ? l.leaf[group] : 0u;
}

std::uint64_t View::group(int level, const Cell& parent) const {
    const Array<std::uint64_t>& codes = data_.octree.levels[level].parent;
    const std::uint64_t code = interleave(parent);
    const auto it = std::lower_bound(codes.begin(), codes.end(), code);
    return it != codes.end() && *it == code ? std::uint64_t(it - codes.begin()) : no_group;
}

CellEntry View::cell_of(std::uint64_t group, const Cell& cell, int level) const {
    CellEntry entry;
    entry.group = group;
    entry.level = level;
    entry.child = int(cell[0] & 1) + 2 * int(cell[1] & 1) + 4 * int(cell[2] & 1);
    if (entry.group == no_group) return entry;
    const unsigned mask = surface_bits(level, group);
    entry.marked = mask >> entry.child & 1;
    entry.surface =
        first_surface(level, group) + std::uint64_t(std::popcount(mask & ((1u << entry.child) - 1)));
    return entry;
}

CellEntry View::leaf(const Cell& finest) const {
    if (!adaptive()) return cell(finest);
    for (int k = 0; k < surface_levels(); ++k) {
        const std::uint64_t found =
            group(k, {finest[0] >> (k + 1), finest[1] >> (k + 1), finest[2] >> (k + 1)});
        if (found != no_group) return cell_of(found, {finest[0] >> k, finest[1] >> k, finest[2] >> k}, k);
    }
    return {};
}

bool View::stored(int level, const std::array<std::int64_t, 3>& g, double& value) const {
    // The groups that touch g have parent (g − 1) >> 1 or g >> 1 on each axis: the same where g is odd.
    const std::int64_t parents = std::int64_t{1} << (data_.octree.depth - level);
    for (int side = 0; side < 8; ++side) {
        Cell parent;
        int index = 0, stride = 1;
        bool valid = true;
        for (int axis = 0; axis < 3; ++axis, stride *= 3) {
            const bool upper = side >> axis & 1;
            if (upper && (g[axis] & 1)) valid = false;  // already seen from the lower side
            const std::int64_t p = upper ? g[axis] >> 1 : (g[axis] - 1) >> 1;
            if (p < 0 || p >= parents) valid = false;
            parent[axis] = std::uint32_t(p);
            index += stride * int(g[axis] - 2 * p);
        }
        if (!valid) continue;
        const std::uint64_t found = group(level, parent);
        if (found == no_group) continue;
        value = data_.field.values[level][points_of_group * found + index];
        return true;
    }
    return false;
}

DoubleDouble View::sum_from(int level, const Point3& x) const {
    const std::int64_t cells = std::int64_t{2} << (data_.octree.depth - level);
    std::array<std::int64_t, 3> low;
    Point3 t;
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::clamp(std::int64_t(floor(x[axis])), std::int64_t{0}, cells - 1);
        t[axis] = x[axis] - double(low[axis]);
    }
    double value[8];
    unsigned known = 0;
    for (int c = 0; c < 8; ++c)
        if (stored(level, {low[0] + (c & 1), low[1] + (c >> 1 & 1), low[2] + (c >> 2)}, value[c]))
            known |= 1u << c;
    // Without a grid point, no hat of this level reaches the cell. Level `depth` has all 27 points of the root.
    if (known == 0 && level < data_.octree.depth)
        return sum_from(level + 1, {0.5 * x[0], 0.5 * x[1], 0.5 * x[2]});
    DoubleDouble sum;
    for (int c = 0; c < 8; ++c) {
        DoubleDouble weight = 1;
        Point3 corner;
        for (int axis = 0; axis < 3; ++axis) {
            const int upper = c >> axis & 1;
            weight = weight * (upper ? t[axis] : 1 - t[axis]);
            corner[axis] = 0.5 * double(low[axis] + upper);
        }
        if (weight.high != 0)
            sum = sum + weight * (known >> c & 1 ? DoubleDouble(value[c]) : sum_from(level + 1, corner));
    }
    return sum;
}

void View::corners(const Cell& cell, const CellEntry& entry, double (&out)[8]) const {
    for (int c = 0; c < 8; ++c) {
        if (entry.marked || (entry.group != no_group && entry.level == 0)) {
            out[c] = data_.field.values[std::size_t(entry.level)][points_of_group * entry.group +
                                                                  std::uint64_t(group_point(entry.child, c))];
        } else {
            const Point3 corner = {cell[0] + double(c & 1), cell[1] + double(c >> 1 & 1),
                                   cell[2] + double(c >> 2)};
            out[c] = double(sum_from(0, corner));
        }
    }
}

DoubleDouble trilinear(const double (&corner)[8], const Point3& t) {
    DoubleDouble sum;
    for (int c = 0; c < 8; ++c) {
        const DoubleDouble x = c & 1 ? t[0] : 1 - t[0];
        const DoubleDouble y = c >> 1 & 1 ? t[1] : 1 - t[1];
        const DoubleDouble z = c >> 2 ? t[2] : 1 - t[2];
        sum = sum + x * y * z * corner[c];
    }
    return sum;
}

std::array<double, 3> slopes(const double (&corner)[8]) {
    std::array<double, 3> out = {};
    for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < 8; ++c)
            if (!(c >> axis & 1)) out[axis] = std::max(out[axis], std::abs(corner[c | 1 << axis] - corner[c]));
    return out;
}

Point3 to_lattice(const Lattice& lattice, const Vec3& p) {
    Point3 out;
    const DoubleDouble cells_per_unit = inverse(lattice.width);
    for (int axis = 0; axis < 3; ++axis)
        out[axis] = cells_per_unit * exact_sum(p[axis], -lattice.position(axis, 0));
    return out;
}

}  // namespace its::verifier
