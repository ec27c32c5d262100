#include "simplify/intersections.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/box.h"
#include "geometry/vec3.h"

namespace its::simplifier {

namespace {

NumberedTriangle numbered(const Complex& mesh, std::uint32_t t) {
    const Triangle& c = mesh.triangle(t);
    return {c, {mesh.position(c[0]), mesh.position(c[1]), mesh.position(c[2])}};
}

Box box_of(const std::array<Vec3, 3>& corner) {
    return geometry::bounds(corner);
}

std::uint64_t key(std::uint64_t cell, int level) {
    std::uint64_t h = (cell ^ std::uint64_t(level) << 59) * 0x9e3779b97f4a7c15ull;
    return h ^ h >> 32;  // cells that get the same key only add triangles to look at
}

}  // namespace

TriangleGrid::TriangleGrid(const Complex& mesh) {
    mark_.assign(mesh.triangles(), 0);
    Box bounds = geometry::empty_box;
    double sum = 0;
    for (std::uint32_t t = 0; t < mesh.triangles(); ++t) {
        if (!mesh.has_triangle(t)) continue;
        const Box box = box_of(numbered(mesh, t).corner);
        geometry::extend(bounds, box);
        const Vec3 d = box.max - box.min;
        sum += std::max({d.x, d.y, d.z});
    }
    origin_ = bounds.min;
    const Vec3 extent = bounds.max - bounds.min;
    const double side = std::max({extent.x, extent.y, extent.z});
    width_ = std::max(sum / double(std::max<std::uint64_t>(mesh.living_triangles(), 1)), side * 0x1p-18);
    if (!(width_ > 0)) width_ = 1;
    for (std::uint32_t t = 0; t < mesh.triangles(); ++t)
        if (mesh.has_triangle(t)) insert(t, mesh);
}

int TriangleGrid::level_of(const Box& box) const {
    const Vec3 d = box.max - box.min;
    const double extent = std::max({d.x, d.y, d.z});
    int level = 0;
    for (double w = width_; w < extent && level + 1 < levels; w *= 2) ++level;
    return level;
}

template <class F>
void TriangleGrid::for_cells(const Box& box, int level, F&& fn) const {
    const double width = std::ldexp(width_, level);
    std::array<std::int64_t, 3> first, last;
    for (int axis = 0; axis < 3; ++axis) {
        // Far outside of the grid all is in its last cells: 20 bits an axis.
        const auto cell = [&](double x) {
            return std::int64_t(std::clamp(std::floor((x - origin_[axis]) / width), -1.0, 0x1p20 - 2)) + 1;
        };
        first[std::size_t(axis)] = cell(box.min[axis]);
        last[std::size_t(axis)] = cell(box.max[axis]);
    }
    for (std::int64_t z = first[2]; z <= last[2]; ++z)
        for (std::int64_t y = first[1]; y <= last[1]; ++y)
            for (std::int64_t x = first[0]; x <= last[0]; ++x)
                fn(std::uint64_t(x) | std::uint64_t(y) << 20 | std::uint64_t(z) << 40);
}

void TriangleGrid::insert(std::uint32_t triangle, const Complex& mesh) {
    const Box box = box_of(numbered(mesh, triangle).corner);
    const int level = level_of(box);
    ++in_level_[std::size_t(level)];
    for_cells(box, level, [&](std::uint64_t cell) { cells_[key(cell, level)].push_back(triangle); });
}

void TriangleGrid::remove(std::uint32_t triangle, const Complex& mesh) {
    const Box box = box_of(numbered(mesh, triangle).corner);
    const int level = level_of(box);
    --in_level_[std::size_t(level)];
    for_cells(box, level, [&](std::uint64_t cell) {
        auto& list = cells_[key(cell, level)];
        if (const auto at = std::find(list.begin(), list.end(), triangle); at != list.end()) {
            *at = list.back();
            list.pop_back();
        }
    });
}

/// fn() for each triangle that is met and not marked; stops when it returns false.
template <class F>
void TriangleGrid::for_met(const NumberedTriangle& triangle, const Complex& mesh, F&& fn) {
    const Box box = box_of(triangle.corner);
    bool going = true;
    for (int level = 0; level < levels && going; ++level) {
        if (in_level_[std::size_t(level)] == 0) continue;
        for_cells(box, level, [&](std::uint64_t cell) {
            const auto found = cells_.find(key(cell, level));
            if (!going || found == cells_.end()) return;
            for (const std::uint32_t t : found->second) {
                if (mark_[t] == epoch_) continue;
                mark_[t] = epoch_;
                const NumberedTriangle other = numbered(mesh, t);
                if (!geometry::overlap(box, box_of(other.corner)) || !intersect(triangle, other)) continue;
                going = fn();
                if (!going) return;
            }
        });
    }
}

bool TriangleGrid::meets(const NumberedTriangle& triangle, const Complex& mesh,
                         std::span<const std::uint32_t> ring) {
    ++epoch_;
    for (const std::uint32_t t : ring) mark_[t] = epoch_;
    bool met = false;
    for_met(triangle, mesh, [&] {
        met = true;
        return false;
    });
    return met;
}

std::uint64_t TriangleGrid::count_met(const NumberedTriangle& triangle, const Complex& mesh) {
    ++epoch_;
    std::uint64_t count = 0;
    for_met(triangle, mesh, [&] {
        ++count;
        return true;
    });
    return count;
}

std::uint64_t count_intersections(const Complex& mesh) {
    std::uint64_t count = 0;
    TriangleGrid grid(mesh);
    for (std::uint32_t t = 0; t < mesh.triangles(); ++t) {
        if (!mesh.has_triangle(t)) continue;
        grid.remove(t, mesh);  // those that remain have higher numbers
        count += grid.count_met(numbered(mesh, t), mesh);
    }
    return count;
}

}  // namespace its::simplifier
