#include "surface/leaf_cells.h"

#include <algorithm>
#include <bit>

#include "base/parallel.h"
#include "octree/neighbours.h"
#include "surface/lattice_values.h"

namespace its::surface {

CellSet::CellSet(std::span<const std::uint64_t> keys)
    : shift_(64 - std::bit_width(2 * keys.size() + 1)), slots_(std::size_t{1} << (64 - shift_)) {
    for (const std::uint64_t key : keys) {
        std::uint64_t at = place(key);
        while (slots_[at] != 0 && slots_[at] != key) at = (at + 1) & (slots_.size() - 1);
        slots_[at] = key;
    }
}

namespace {

constexpr std::uint64_t min_tasks = 256;  // groups at the level where the work is divided

struct Found {
    std::vector<LeafCell> cells;
    std::vector<std::uint64_t> divided;
};

class Finder {
public:
    Finder(const octree::Octree& octree, const field::Field& field, double low, double high,
           const CellSet& halved)
        : octree_(octree), field_(field), low_(low), high_(high), halved_(halved) {}

    /// The cells below the one that a group halves: all, or those in children that are not subdivided.
    void visit_group(int level, std::uint64_t group, bool all, Found& found) const {
        const octree::Cell at = octree::morton_decode(octree_.levels[std::size_t(level)].parent[group]);
        const octree::Around around = octree::around_cell(octree_, level + 1, at);
        visit_children(level + 1, at, around, all, found);
        found.divided.push_back(CellSet::key(octree_.depth, level + 1, octree::morton_encode(at)));
    }

private:
    /// A cell that the octree subdivides.
    void visit_children(int level, const octree::Cell& at, const octree::Around& around, bool all,
                        Found& found) const {
        const std::size_t before = found.cells.size();
        const std::uint64_t group = around[octree::itself];
        const octree::Level& below = octree_.levels[std::size_t(level) - 1];
        const double* const points =
            field_.values[std::size_t(level) - 1].data() + octree::group_points * group;
        const unsigned subdivided = octree_.subdivided_mask(level - 1, group),
                       surface = octree_.surface_mask(level - 1, group);
        for (int c = 0; c < 8; ++c) {
            if (subdivided >> c & 1) {
                if (all)
                    visit_children(level - 1, octree::child_of(at, c), octree::around_child(below, around, c),
                                   true, found);
                continue;
            }
            double corner[8];
            for (int i = 0; i < 8; ++i) corner[i] = points[octree::group_point(c, i)];
            if ((surface >> c & 1) != 0 || level == 1)
                visit_trilinear(level - 1, octree::child_of(at, c), corner, found);
            else
                visit_empty(level - 1, octree::child_of(at, c), octree::around_child(below, around, c), corner,
                            found);
        }
        note(level, at, before, found);
    }

    void note(int level, const octree::Cell& at, std::size_t before, Found& found) const {
        if (found.cells.size() > before)
            found.divided.push_back(CellSet::key(octree_.depth, level, octree::morton_encode(at)));
    }

    /// A leaf that does not meet M, or a cell in one.
    void visit_empty(int level, const octree::Cell& at, const octree::Around& around, const double* corner,
                     Found& found) const {
        if (level == 0 || !is_reached(around)) return visit_trilinear(level, at, corner, found);
        const std::size_t before = found.cells.size();
        double points[octree::group_points];
        halve(corner, points);
        insert_grid_values(field_, level, around, points);
        for (int c = 0; c < 8; ++c) {
            double below[8];
            for (int i = 0; i < 8; ++i) below[i] = points[octree::group_point(c, i)];
            visit_empty(level - 1, octree::child_of(at, c),
                        octree::around_child(octree_.levels[std::size_t(level) - 1], around, c), below, found);
        }
        note(level, at, before, found);
    }

    void visit_trilinear(int level, const octree::Cell& at, const double* corner, Found& found) const {
        const auto [least, most] = std::minmax_element(corner, corner + 8);
        if (!(*least < high_ && *most >= low_)) return;
        if (level == 0 || !halved_.has(CellSet::key(octree_.depth, level, octree::morton_encode(at)))) {
            LeafCell cell{at, level, {}};
            std::copy(corner, corner + 8, cell.value.begin());
            found.cells.push_back(cell);
            return;
        }
        const std::size_t before = found.cells.size();
        double points[octree::group_points];
        halve(corner, points);
        for (int c = 0; c < 8; ++c) {
            double below[8];
            for (int i = 0; i < 8; ++i) below[i] = points[octree::group_point(c, i)];
            visit_trilinear(level - 1, octree::child_of(at, c), below, found);
        }
        note(level, at, before, found);
    }

    const octree::Octree& octree_;
    const field::Field& field_;
    const double low_, high_;
    const CellSet& halved_;
};

}  // namespace

LeafCells find_leaf_cells(const octree::Octree& octree, const field::Field& field, double low, double high,
                          const CellSet& halved, const Progress& progress) {
    struct Task {
        int level;
        std::uint64_t group;
    };
    int split = octree.depth;
    while (split > 0 && octree.levels[std::size_t(split)].groups() < min_tasks) --split;
    std::vector<Task> tasks;
    for (int level = split; level <= octree.depth; ++level)
        for (std::uint64_t group = 0; group < octree.levels[std::size_t(level)].groups(); ++group)
            tasks.push_back({level, group});
    Stage stage(progress, "surface cells", tasks.size());
    std::vector<Found> found(tasks.size());
    const Finder finder(octree, field, low, high, halved);
    parallel_for(tasks.size(), 1, [&](std::uint64_t i) {
        finder.visit_group(tasks[i].level, tasks[i].group, tasks[i].level == split, found[i]);
        stage.advance(1);
    });
    LeafCells result;
    std::vector<std::uint64_t> divided;
    for (Found& part : found) {
        result.cells.insert(result.cells.end(), part.cells.begin(), part.cells.end());
        divided.insert(divided.end(), part.divided.begin(), part.divided.end());
        part = {};
    }
    result.divided = CellSet(divided);
    return result;
}

}  // namespace its::surface
