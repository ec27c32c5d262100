#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "octree/neighbours.h"
#include "octree/octree.h"

/// An octree that grows, and of each grid point whether it is free. See docs/design/adaptive.md.
namespace its::adaptive {

inline constexpr std::uint32_t none = ~std::uint32_t{0};

/// Elements that never move, in blocks: growing does not copy.
template <class T>
class Blocks {
public:
    std::uint64_t size() const { return size_; }
    void resize(std::uint64_t size) {
        while (blocks_.size() * block < size) blocks_.push_back(std::make_unique<T[]>(block));
        size_ = size;
    }
    T& operator[](std::uint64_t i) { return blocks_[i / block][i % block]; }
    const T& operator[](std::uint64_t i) const { return blocks_[i / block][i % block]; }

private:
    static constexpr std::uint64_t block = 1024;
    std::vector<std::unique_ptr<T[]>> blocks_;
    std::uint64_t size_ = 0;
};

/// A sibling group, named by its parent cell as in octree::Level, and its 27 grid points.
struct Group {
    std::uint64_t parent = 0;  ///< Morton code
    std::array<double, octree::group_points> value;
    std::uint32_t above = none;  ///< the group that has the parent
    std::uint32_t free = 0;      ///< bit p: value[p] is the distance D at point p; else an interpolation
    std::uint32_t inside = 0;    ///< bit p: point p is inside
    std::int8_t level = 0;       ///< of the children
    std::uint8_t subdivided = 0, surface = 0;  ///< bits of children; a surface leaf is not subdivided
    bool waiting = false;                      ///< its values are to be looked at in this pass
};

/// What is next to a group; gone when the tree has grown.
struct Links {
    std::array<std::uint32_t, octree::neighbours> around;  ///< groups of the cells around the parent, or none
    std::array<std::uint32_t, 8>
        child;  ///< the group of a subdivided one, the number of a surface leaf, or none
};

/// A leaf that meets M.
struct Leaf {
    std::uint64_t begin = 0;  ///< of its triangles, in their pool
    std::uint32_t count = 0;
    std::uint32_t group = none;
    std::int32_t winding = 0;  ///< of its lowest corner
    std::uint16_t pool = 0;
    std::uint8_t child = 0;
    bool split = false;  ///< it is none any more
};

/// A stored cell.
struct Place {
    std::uint32_t group = none;  ///< none: outside of the root cube
    int child = 0;
};

class GrowingTree {
public:
    explicit GrowingTree(int depth) : depth_(depth) {}

    int depth() const { return depth_; }
    std::uint32_t size() const { return std::uint32_t(groups_.size()); }
    Group& operator[](std::uint32_t group) { return groups_[group]; }
    const Group& operator[](std::uint32_t group) const { return groups_[group]; }

    Links& links(std::uint32_t group) { return links_[group]; }
    const Links& links(std::uint32_t group) const { return links_[group]; }

    /// Room for more groups, whose fields the caller sets.
    void resize(std::uint32_t size) {
        groups_.resize(size);
        links_.resize(size);
    }
    void forget_links() { links_ = {}; }

    /// Finds what is around new groups of one level, which are linked to the groups above them and come after
    /// all other groups; and tells those around. Groups of coarser levels must be done before.
    void link_around(std::uint32_t begin, std::uint32_t end);

    /// Of a direction in which no group is around one: the leaf there, which may be a coarser one.
    Place leaf_around(std::uint32_t group, int direction) const;

    bool is_surface(const Place& place) const {
        return place.group != none && (groups_[place.group].surface >> place.child & 1) != 0;
    }

    /// The grid points that hang: one of the cells around them is not there, and the leaf that covers it meets
    /// M.
    /// \param too_coarse  receives the surface leaves around that are two levels coarser or more than a surface
    ///                    leaf of the group that touches them
    std::uint32_t hanging(std::uint32_t group, std::vector<Place>& too_coarse) const;

private:
    int depth_;
    Blocks<Group> groups_;
    Blocks<Links> links_;
};

/// Bits of the children of a cell that touch the one next to it in a direction.
inline constexpr std::array<std::uint8_t, octree::neighbours> children_towards = [] {
    std::array<std::uint8_t, octree::neighbours> table{};
    for (int n = 0; n < octree::neighbours; ++n)
        for (int c = 0; c < 8; ++c) {
            bool touches = true;
            for (int axis = 0, at = n; axis < 3; ++axis, at /= 3)
                touches &= at % 3 == 1 || (at % 3 == 2) == ((c >> axis & 1) != 0);
            if (touches) table[std::size_t(n)] |= std::uint8_t(1u << c);
        }
    return table;
}();

inline constexpr int opposite(int direction) {
    return octree::neighbours - 1 - direction;
}

/// A point of a group, as others around have it.
struct Sharing {
    std::uint8_t direction, point;
};
struct Sharings {
    std::array<Sharing, 7> with{};
    int count = 0;
};

/// By point: where else it is a point.
inline constexpr std::array<Sharings, octree::group_points> sharings = [] {
    std::array<Sharings, octree::group_points> table{};
    for (int p = 0; p < octree::group_points; ++p)
        for (int n = 0; n < octree::neighbours; ++n) {
            const int theirs = octree::point_of_neighbour(p, n);
            if (n == octree::itself || theirs < 0) continue;
            Sharings& s = table[std::size_t(p)];
            s.with[std::size_t(s.count++)] = {std::uint8_t(n), std::uint8_t(theirs)};
        }
    return table;
}();

/// The points that are corners of the group's parent, and which.
inline constexpr std::uint32_t all_points = (1u << octree::group_points) - 1;
inline constexpr std::uint32_t corner_points = [] {
    std::uint32_t bits = 0;
    for (int corner = 0; corner < 8; ++corner) bits |= 1u << octree::group_point(corner, corner);
    return bits;
}();

/// By child: its corners among the points.
inline constexpr std::array<std::uint32_t, 8> points_of_child = [] {
    std::array<std::uint32_t, 8> table{};
    for (int c = 0; c < 8; ++c)
        for (int corner = 0; corner < 8; ++corner)
            table[std::size_t(c)] |= 1u << octree::group_point(c, corner);
    return table;
}();

/// The trilinear interpolation of a parent's corner values at point p of its children: nested means of two,
/// along x, then y, then z. So it is the same, whichever of the cells around the point it is taken from, and
/// between those it is the mean of.
inline double interpolated(const double (&corner)[8], int p) {
    const int x = p % 3, y = p / 3 % 3, z = p / 9;
    const auto mean = [](double a, double b) { return 0.5 * (a + b); };
    const auto along_x = [&](int row) {
        return x == 1 ? mean(corner[row], corner[row + 1]) : corner[row + x / 2];
    };
    const auto along_y = [&](int slice) {
        return y == 1 ? mean(along_x(slice), along_x(slice + 2)) : along_x(slice + (y / 2) * 2);
    };
    return z == 1 ? mean(along_y(0), along_y(4)) : along_y((z / 2) * 4);
}

}  // namespace its::adaptive
