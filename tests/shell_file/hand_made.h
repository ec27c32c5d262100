#pragma once

#include "its/inspect.h"
#include "shell/shell_data.h"

/// Small shells made by hand: tests of the format need no builder.
namespace its::test {

inline void describe(shell::ShellData& shell) {
    ShellInfo& info = shell.info;
    const std::int64_t side = shell.lattice.cells();
    info.depth = shell.lattice.depth;
    info.sign = SignRule::unsigned_rule;
    info.sign_reason = "made by hand";
    info.mesh_vertices = shell.mesh.vertices.size();
    info.mesh_triangles = shell.mesh.triangles.size();
    info.scale = shell.lattice.scale();
    info.cell_width = shell.lattice.width;
    info.root = {shell.lattice.position({0, 0, 0}), shell.lattice.position({side, side, side})};
    shell.epsilon_inner = -0.125;
    shell.epsilon_outer = 0.5;
    info.epsilon_inner = shell.epsilon_inner * shell.lattice.width;
    info.epsilon_outer = shell.epsilon_outer * shell.lattice.width;
    info.rounding = 1e-15;
    info.surface_cells = shell.octree.surface_cells();
    info.cells = 1;
    for (const octree::Level& level : shell.octree.levels) info.cells += 8 * level.groups();
    info.memory_bytes = 1234;
}

inline void fill_arrays(shell::ShellData& shell) {
    for (const octree::Level& level : shell.octree.levels) {
        std::vector<double> values(level.groups() * octree::group_points);
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = double(i) / 8 - 1.0;
        shell.field.values.emplace_back(std::move(values));
    }
    shell.sides = signs::no_inside(shell.octree);
    const std::uint64_t cells = shell.octree.surface_cells();
    std::vector<float> lower(cells, -0.125f), upper;
    std::vector<std::uint64_t> offset = {0};
    std::vector<std::uint32_t> triangle;
    for (std::uint64_t i = 0; i < cells; ++i) {
        upper.push_back(0.25f + float(i) / 64);
        for (std::uint32_t t = 0; t <= i % shell.mesh.triangles.size(); ++t) triangle.push_back(t);
        offset.push_back(triangle.size());
    }
    shell.surface = {
        std::move(lower), std::move(upper), {}, shell::pack_lists(shell.octree.levels[0], offset, triangle)};
}

/// K = 0: the root's eight children, two of which meet the mesh of one triangle.
inline shell::ShellData one_level() {
    shell::ShellData shell;
    shell.mesh.vertices = {{0.5, 0.5, 0.5}, {1.5, 0.5, 0.5}, {0.5, 0.75, 0.625}};
    shell.mesh.triangles = {{0, 1, 2}};
    shell.lattice = {.depth = 0, .width = 1.0, .base = {0, 0, 0}};
    shell.octree.depth = 0;
    shell.octree.levels = {octree::Level({0}, {0b11})};
    fill_arrays(shell);
    describe(shell);
    return shell;
}

/// K = 1: two of the root's children are subdivided.
inline shell::ShellData two_levels() {
    shell::ShellData shell;
    shell.mesh.vertices = {{0.5, 0.5, 0.5}, {1.5, 0.5, 0.5}, {0.5, 0.75, 0.625}, {3.25, 3, 3.5}, {0, -0.0, 4}};
    shell.mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
    shell.lattice = {.depth = 1, .width = 1.0, .base = {0, 0, 0}};
    shell.octree.depth = 1;
    shell.octree.levels = {octree::Level({0, 7}, {0b11, 0b10000001}), octree::Level({0}, {0b10000001})};
    fill_arrays(shell);
    describe(shell);
    return shell;
}

}  // namespace its::test
