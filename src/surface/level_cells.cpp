#include "surface/level_cells.h"

#include <algorithm>

#include "base/parallel.h"
#include "octree/neighbours.h"
#include "surface/lattice_values.h"

namespace its::surface {

namespace {

constexpr std::uint64_t min_tasks = 256;  // groups at the level where the work is divided

class Finder {
public:
    Finder(const octree::Octree& octree, const field::Field& field, double low, double high)
        : octree_(octree), field_(field), low_(low), high_(high) {}

    /// The cells in children of a group, which are cells of `level`: in all of them, or in those only that are
    /// not subdivided.
    void visit_group(int level, std::uint64_t group, bool all, std::vector<LevelCell>& found) const {
        const std::uint64_t parent = octree_.levels[level].parent[group];
        const octree::Around around = octree::around_cell(octree_, level + 1, octree::morton_decode(parent));
        visit_children(level + 1, octree::morton_decode(parent), around, all, found);
    }

private:
    /// A subdivided cell.
    void visit_children(int level, const octree::Cell& at, const octree::Around& around, bool all,
                        std::vector<LevelCell>& found) const {
        const std::uint64_t group = around[octree::itself];
        const double* const points = field_.values[level - 1].data() + octree::group_points * group;
        if (level == 1) return keep_crossed(at, points, found);
        const unsigned mask = octree_.levels[level - 1].mask[group];
        for (int c = 0; c < 8; ++c) {
            const bool subdivided = mask >> c & 1;
            if (subdivided && !all) continue;
            const octree::Around around_c = octree::around_child(octree_.levels[level - 1], around, c);
            if (subdivided)
                visit_children(level - 1, octree::child_of(at, c), around_c, true, found);
            else
                visit_leaf(level - 1, octree::child_of(at, c), around_c, points, c, found);
        }
    }

    /// Child `child` of 27 points: a cell that is not subdivided, or a lattice cell in one.
    void visit_leaf(int level, const octree::Cell& at, const octree::Around& around, const double* points,
                    int child, std::vector<LevelCell>& found) const {
        double corner[8];
        for (int c = 0; c < 8; ++c) corner[c] = points[octree::group_point(child, c)];
        const bool reached = is_reached(around);
        if (!reached && !crossed(corner)) return;
        double halved[octree::group_points];
        halve(corner, halved);
        if (reached) insert_grid_values(field_, level, around, halved);
        if (level == 1) return keep_crossed(at, halved, found);
        for (int c = 0; c < 8; ++c) {
            const octree::Around around_c =
                reached ? octree::around_child(octree_.levels[level - 1], around, c) : around;
            visit_leaf(level - 1, octree::child_of(at, c), around_c, halved, c, found);
        }
    }

    bool crossed(const double* corner) const {
        double least = corner[0], most = corner[0];
        for (int c = 1; c < 8; ++c) {
            least = std::min(least, corner[c]);
            most = std::max(most, corner[c]);
        }
        return least < high_ && most >= low_;
    }

    /// Of the eight finest cells with these points.
    void keep_crossed(const octree::Cell& parent, const double* points, std::vector<LevelCell>& found) const {
        if (!crossed_any(points)) return;
        for (int child = 0; child < 8; ++child) {
            LevelCell cell;
            for (int c = 0; c < 8; ++c) cell.value[std::size_t(c)] = points[octree::group_point(child, c)];
            if (!crossed(cell.value.data())) continue;
            cell.at = octree::child_of(parent, child);
            found.push_back(cell);
        }
    }

    bool crossed_any(const double* points) const {
        double least = points[0], most = points[0];
        for (int p = 1; p < octree::group_points; ++p) {
            least = std::min(least, points[p]);
            most = std::max(most, points[p]);
        }
        return least < high_ && most >= low_;
    }

    const octree::Octree& octree_;
    const field::Field& field_;
    const double low_, high_;
};

/// A group to visit.
struct Task {
    int level;
    std::uint64_t group;
};

}  // namespace

ITS_API std::vector<LevelCell> find_level_cells(const octree::Octree& octree, const field::Field& field,
                                                double low, double high, const Progress& progress) {
    int split = octree.depth;
    while (split > 0 && octree.levels[split].groups() < min_tasks) --split;
    std::vector<Task> tasks;
    for (int level = split; level <= octree.depth; ++level)
        for (std::uint64_t group = 0; group < octree.levels[level].groups(); ++group)
            tasks.push_back({level, group});

    Stage stage(progress, "surface cells", tasks.size());
    std::vector<std::vector<LevelCell>> found(tasks.size());
    const Finder finder(octree, field, low, high);
    parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
        finder.visit_group(tasks[i].level, tasks[i].group, tasks[i].level == split, found[i]);
        stage.advance(1);
    });

    std::vector<std::uint64_t> begin(tasks.size() + 1, 0);
    for (std::size_t i = 0; i < tasks.size(); ++i) begin[i + 1] = begin[i] + found[i].size();
    std::vector<LevelCell> cells(begin.back());
    parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
        std::copy(found[i].begin(), found[i].end(), cells.begin() + std::ptrdiff_t(begin[i]));
        std::vector<LevelCell>().swap(found[i]);
    });
    return cells;
}

}  // namespace its::surface
