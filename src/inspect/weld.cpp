#include "its/weld.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "base/disjoint_sets.h"
#include "geometry/vec3.h"
#include "mesh/merged.h"
#include "mesh/scaled.h"

namespace its {

namespace {

/// Cells have sides a little over half of the length: points of one cell are nearer than it (√3/2), and points
/// that are nearer are at most two cells apart on each axis. Both hold with 2⁻¹⁰ to spare for the rounding of
/// p/side, which is below 2⁻¹² for less than 2⁴⁰ cells.
constexpr double cells_per_length = 2 / (1 + 0x1p-10);
constexpr double most_cells = 0x1p40;
constexpr std::int64_t reach = 2;

using Cell = std::array<std::int64_t, 3>;

struct CellHash {
    std::size_t operator()(const Cell& cell) const {
        std::uint64_t h = 0;
        for (const std::int64_t c : cell) {
            h = (h ^ std::uint64_t(c)) * 0x9e3779b97f4a7c15ull;
            h ^= h >> 29;
        }
        return std::size_t(h);
    }
};

/// The half of the cells around one that come after it, nearest first: then most of those that are far need no
/// look at their points, since nearer ones have connected them.
std::vector<Cell> neighbours() {
    std::vector<Cell> all;
    for (std::int64_t z = -reach; z <= reach; ++z)
        for (std::int64_t y = -reach; y <= reach; ++y)
            for (std::int64_t x = -reach; x <= reach; ++x)
                if (Cell{z, y, x} > Cell{0, 0, 0}) all.push_back({x, y, z});
    std::stable_sort(all.begin(), all.end(), [](const Cell& a, const Cell& b) {
        const auto square = [](const Cell& c) { return c[0] * c[0] + c[1] * c[1] + c[2] * c[2]; };
        return square(a) < square(b);
    });
    return all;
}

DisjointSets cluster(const std::vector<Vec3>& points, double length) {
    std::unordered_map<Cell, std::uint32_t, CellHash> number;
    std::vector<Cell> cells;
    std::vector<std::vector<std::uint32_t>> members;
    DisjointSets clusters(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        Cell cell;
        for (int axis = 0; axis < 3; ++axis)
            cell[std::size_t(axis)] = std::int64_t(std::floor(points[i][axis] / length * cells_per_length));
        const auto [it, fresh] = number.emplace(cell, std::uint32_t(cells.size()));
        if (fresh) {
            cells.push_back(cell);
            members.emplace_back();
        }
        members[it->second].push_back(i);
        clusters.join(members[it->second].front(), i);
    }
    const auto near = [&](std::uint32_t i, std::uint32_t j) { return norm(points[i] - points[j]) < length; };
    for (const Cell& offset : neighbours())
        for (std::size_t c = 0; c < cells.size(); ++c) {
            const auto other =
                number.find({cells[c][0] + offset[0], cells[c][1] + offset[1], cells[c][2] + offset[2]});
            if (other == number.end()) continue;
            const auto &here = members[c], &there = members[other->second];
            if (clusters.find(here.front()) == clusters.find(there.front())) continue;
            const bool touch = std::any_of(here.begin(), here.end(), [&](std::uint32_t i) {
                return std::any_of(there.begin(), there.end(), [&](std::uint32_t j) { return near(i, j); });
            });
            if (touch) clusters.join(here.front(), there.front());
        }
    return clusters;
}

void check_length(double largest, double length) {
    if (!(largest / length * cells_per_length < most_cells))
        throw InputError(fmt::format(
            "coordinates up to {:.3g} do not resolve a welding length of {:.3g}: it must be at least {:.3g}",
            largest, length, largest / most_cells * cells_per_length * (1 + 0x1p-10)));
}

}  // namespace

Welded weld(const MeshView& view, double length) {
    if (!(length >= 0) || !std::isfinite(length))
        throw OptionError(fmt::format("welding length {}: must be finite and at least 0", length));
    const Mesh mesh = to_mesh(view);
    Welded out{mesh, {.length = length}};
    const mesh::Scaled scaled(mesh);
    const mesh::Merged merged = mesh::merge(scaled.arrays());
    if (length == 0) return out;
    check_length(mesh::largest_coordinate(mesh), length);
    DisjointSets clusters = cluster(merged.points, scaled.scaling().in(length));
    // Of each position the first vertex that is there.
    std::vector<std::uint32_t> vertex(merged.points.size(), ~std::uint32_t{0});
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t& first = vertex[merged.triangles[t][k]];
            first = std::min(first, mesh.triangles[t][k]);
        }
    std::vector<std::uint32_t> stays(merged.points.size());  // of each cluster the lowest vertex
    for (std::uint32_t i = 0; i < stays.size(); ++i) {
        const std::uint32_t root = clusters.find(i);
        stays[root] = root == i ? vertex[i] : std::min(stays[root], vertex[i]);
    }
    std::vector<std::uint8_t> grown(merged.points.size());
    for (std::uint32_t i = 0; i < stays.size(); ++i) {
        const std::uint32_t root = clusters.find(i);
        if (root == i) continue;
        if (grown[root] == 0) ++out.report.clusters, ++out.report.corners;
        grown[root] = 1;
        ++out.report.corners;
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Triangle& corner = out.mesh.triangles[t];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t point = merged.triangles[t][k], root = clusters.find(point);
            if (grown[root] == 0) continue;  // as it is, whatever the vertices' numbers
            corner[k] = stays[root];
            const double move = norm(scaled.arrays().vertices[stays[root]] - merged.points[point]);
            out.report.largest_move = std::max(out.report.largest_move, scaled.scaling().out(move));
        }
        const auto& before = merged.triangles[t];
        if (mesh::repeats_corner(corner) && !mesh::repeats_corner(before)) ++out.report.degenerate;
    }
    return out;
}

}  // namespace its
