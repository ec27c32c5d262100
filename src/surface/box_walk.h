#pragma once

#include "field/field.h"
#include "octree/neighbours.h"
#include "surface/lattice_values.h"

/// The boxes on which f is trilinear.
namespace its::surface {

/// Goes down the octree with the cells around in hand, as finer hats reach from them into cells that are not
/// subdivided; these are halved until none does. Of the visitor:
///   bool enter(level, at)                  whether to go on into this cell, the level of which is at least 1
///   void leave(level)                      after one that was entered
///   bool wants(points)                     whether to look at the 8 finest boxes of these 27 points
///   void box(level, at, points, child)     child `child` of 27 points, in which f is trilinear
template <class Visitor>
class BoxWalk {
public:
    BoxWalk(const octree::Octree& octree, const field::Field& field, Visitor& visitor)
        : octree_(octree), field_(field), visitor_(visitor) {}

    /// All of the root cube.
    void run() {
        octree::Around around;
        around.fill(octree::no_group);
        around[octree::itself] = 0;
        visit_subdivided(octree_.depth + 1, {0, 0, 0}, around);
    }

private:
    void visit_subdivided(int level, const octree::Cell& at, const octree::Around& around) {
        const std::uint64_t group = around[octree::itself];
        const double* const points = field_.values[level - 1].data() + octree::group_points * group;
        const octree::Level& children = octree_.levels[level - 1];
        if (level == 1) return visit_finest(at, points);
        // Into leaves that meet M none reach: grid points that they would be centred at hang.
        const unsigned whole = octree_.surface_mask(level - 1, group);
        for (int c = 0; c < 8; ++c) {
            const octree::Cell child = octree::child_of(at, c);
            if (whole >> c & 1) {
                visitor_.box(level - 1, child, points, c);
                continue;
            }
            if (!visitor_.enter(level - 1, child)) continue;
            const bool subdivided = children.mask[group] >> c & 1;
            if (level == 2 && subdivided) {  // most cells: into their children nothing reaches
                const std::uint64_t finest = children.first.rank(group, c);
                visit_finest(child, field_.values[0].data() + octree::group_points * finest);
                visitor_.leave(level - 1);
                continue;
            }
            const octree::Around around_c = octree::around_child(children, around, c);
            if (subdivided)
                visit_subdivided(level - 1, child, around_c);
            else
                visit_leaf(level - 1, child, around_c, points, c);
            visitor_.leave(level - 1);
        }
    }

    /// A subdivided cell of level 1.
    void visit_finest(const octree::Cell& at, const double* points) {
        if (!visitor_.wants(points)) return;
        for (int c = 0; c < 8; ++c) visitor_.box(0, octree::child_of(at, c), points, c);
    }

    /// Child `place` of 27 points, which is not subdivided.
    void visit_leaf(int level, const octree::Cell& at, const octree::Around& around, const double* points,
                    int place) {
        if (!is_reached(around)) return visitor_.box(level, at, points, place);
        double corner[8], halved[octree::group_points];
        for (int c = 0; c < 8; ++c) corner[c] = points[octree::group_point(place, c)];
        halve(corner, halved);
        insert_grid_values(field_, level, around, halved);
        for (int c = 0; c < 8; ++c) {
            const octree::Cell child = octree::child_of(at, c);
            if (level == 1) {
                visitor_.box(0, child, halved, c);
                continue;
            }
            if (!visitor_.enter(level - 1, child)) continue;
            visit_leaf(level - 1, child, octree::around_child(octree_.levels[level - 1], around, c), halved, c);
            visitor_.leave(level - 1);
        }
    }

    const octree::Octree& octree_;
    const field::Field& field_;
    Visitor& visitor_;
};

/// A part of the root cube that a task looks at: a cell of a level at which there are 16 along the root, or of
/// level 1.
struct Region {
    int level;
    octree::Cell at;

    static int level_of(int depth) { return depth > 4 ? depth - 3 : 1; }

    /// Whether a cell of another level has part in it.
    bool meets(int other, const octree::Cell& cell) const {
        const int up = other > level ? other - level : 0, down = level > other ? level - other : 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (at[axis] >> up != cell[axis] >> down) return false;
        return true;
    }
    /// The common part of the two along an axis, in finest cells.
    std::uint32_t from(int other, const octree::Cell& cell, std::size_t axis) const {
        return std::max(at[axis] << level, cell[axis] << other);
    }
    std::uint32_t to(int other, const octree::Cell& cell, std::size_t axis) const {
        return std::min((at[axis] + 1) << level, (cell[axis] + 1) << other);
    }
};

}  // namespace its::surface
