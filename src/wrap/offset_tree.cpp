#include "wrap/offset_tree.h"

#include <algorithm>
#include <cmath>

#include "adaptive/growing_tree.h"
#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/vec3.h"
#include "octree/neighbours.h"

namespace its::wrapper {

namespace {

constexpr std::uint64_t grain = 256;
/// Leaves that may be crossed are this wide at most, in root cubes: the longest side of M's bounds and 16th.
constexpr int coarsest = 4;
/// Of a cube's side: from the middle to a corner; and from the middle of one of eight cubes to the corners of
/// all, whose values may decide about its own.
constexpr double to_corner = 0.8660254037844388, to_far_corner = 3 * to_corner;
/// Distances err by 144uR (its/distance.h), and ways by less than 16uR; R is the largest coordinate.
constexpr double distance_roundings = 256;

}  // namespace

void PointValues::insert(std::uint64_t key, double value) {
    if (2 * (size_ + 1) > slots_.size()) {
        std::vector<Slot> old(2 * slots_.size());
        old.swap(slots_);
        size_ = 0;
        for (const Slot& slot : old)
            if (slot.key != 0) insert(slot.key, slot.value);
    }
    std::size_t at = place(key);
    while (slots_[at].key != 0) at = (at + 1) & (slots_.size() - 1);
    slots_[at] = {key, value};
    ++size_;
}

OffsetTree::OffsetTree(const OffsetTask& task, surface::MemoryGuard& guard, const Progress& progress)
    : task_(task),
      guard_(guard),
      rounding_(distance_roundings * unit_roundoff * task.lattice.reach() * task.lattice.width) {
    Node root{{0, 0, 0}, task.lattice.depth + 1, outside};
    nodes_.push_back(root);
    const Vec3 centre = position(twice_centre(root));
    const distance::Nearest nearest = task_.field.tree().find(centre);
    const double distance = std::sqrt(nearest.squared);
    nodes_[0].centre = (task_.field.inside(centre) ? -distance : distance) - task_.level;
    std::vector<Wanted> wanted{{group_key(root, 13), centre, nodes_[0].centre}};
    for (int c = 0; c < 8; ++c) want(corner_key(root, c), nodes_[0], wanted);
    evaluate(wanted);
    std::vector<std::uint32_t> fresh;
    halve(0, fresh);
    refine(std::move(fresh), progress);
}

/// Exact: half lattice points are multiples of an eighth of a finest cell.
Vec3 OffsetTree::position(const std::array<std::int64_t, 3>& twice) const {
    const octree::Lattice& l = task_.lattice;
    const auto at = [&](std::size_t axis) { return double(l.base[axis] + 2 * twice[axis]) * (0.25 * l.width); };
    return {at(0), at(1), at(2)};
}

Vec3 OffsetTree::position(std::uint64_t key) const {
    const PointValues::Point p = PointValues::point(key);
    return task_.lattice.position({p[0], p[1], p[2]});
}

/// g at p. The segment to a point whose distance is more than its length does not meet M.
double OffsetTree::evaluate(const Vec3& p, const Vec3& from, double value) const {
    const double known = value + task_.level, way = norm(p - from);
    const double bound = (std::abs(known) + way) * (1 + 0x1p-20);
    distance::Nearest nearest = task_.field.tree().find(p, bound);
    if (!std::isfinite(nearest.squared)) nearest = task_.field.tree().find(p);
    const double distance = std::sqrt(nearest.squared);
    const bool inside = same_side(way, std::max(distance, std::abs(known))) ? known < 0 : task_.field.inside(p);
    return (inside ? -distance : distance) - task_.level;
}

void OffsetTree::evaluate(std::vector<Wanted>& wanted) {
    std::sort(wanted.begin(), wanted.end(), [](const Wanted& a, const Wanted& b) { return a.key < b.key; });
    wanted.erase(std::unique(wanted.begin(), wanted.end(),
                             [](const Wanted& a, const Wanted& b) { return a.key == b.key; }),
                 wanted.end());
    parallel_for(wanted.size(), grain, [&](std::uint64_t i) {
        wanted[i].value = evaluate(position(wanted[i].key), wanted[i].from, wanted[i].value);
    });
    for (const Wanted& w : wanted) values_.insert(w.key, w.value);
    wanted.clear();
}

std::array<std::int64_t, 3> OffsetTree::twice_centre(const Node& node) const {
    std::array<std::int64_t, 3> twice{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        twice[axis] = (2 * std::int64_t(node.at[axis]) + 1) << node.level;
    return twice;
}

std::uint64_t OffsetTree::corner_key(const Node& node, int corner) const {
    PointValues::Point p;
    for (unsigned axis = 0; axis < 3; ++axis)
        p[axis] = (node.at[axis] + (unsigned(corner) >> axis & 1u)) << node.level;
    return PointValues::key(p);
}

/// Of the 27 points of the children.
std::uint64_t OffsetTree::group_key(const Node& parent, int point) const {
    const unsigned at[3] = {unsigned(point) % 3, unsigned(point) / 3 % 3, unsigned(point) / 9};
    PointValues::Point p;
    for (std::size_t axis = 0; axis < 3; ++axis)
        p[axis] = (2 * parent.at[axis] + at[axis]) << (parent.level - 1);
    return PointValues::key(p);
}

void OffsetTree::want(std::uint64_t key, const Node& near, std::vector<Wanted>& wanted) const {
    if (values_.find(key) == nullptr) wanted.push_back({key, position(twice_centre(near)), near.centre});
}

/// g changes by no more than the way from the middle, and errs there by no more than rounding_.
bool OffsetTree::may_be_crossed(const Node& node) const {
    const double width = std::ldexp(task_.lattice.width, node.level);
    return std::abs(node.centre) <= (1 + 0x1p-20) * to_corner * width + rounding_;
}

/// Of a leaf that may be crossed, with values at its corners: too wide, or g bends too much for it.
bool OffsetTree::is_coarse(const Node& node) const {
    if (node.level == 0) return false;
    if (node.level > task_.lattice.depth + 1 - coarsest) return true;
    double sum = 0;
    for (int c = 0; c < 8; ++c) sum += *values_.find(corner_key(node, c));
    return std::abs(sum / 8 - node.centre) > task_.tolerance;
}

void OffsetTree::halve(std::uint32_t leaf, std::vector<std::uint32_t>& fresh) {
    if (nodes_[leaf].child != 0) return;
    const std::uint64_t bytes = nodes_.size() * sizeof(Node) + values_.memory_bytes();
    if (bytes > counted_) {
        const std::uint64_t ahead = bytes + bytes / 4;  // before it is looked at again
        guard_.take(ahead - counted_);
        counted_ = ahead;
    }
    nodes_[leaf].child = std::uint32_t(nodes_.size());
    for (int c = 0; c < 8; ++c) {
        fresh.push_back(std::uint32_t(nodes_.size()));
        nodes_.push_back({octree::child_of(nodes_[leaf].at, c), nodes_[leaf].level - 1, leaf});
    }
}

/// A node of the same level or, if there is none, the leaf that has the place; `outside`.
std::uint32_t OffsetTree::neighbour(const Node& node, int direction) const {
    std::array<std::int64_t, 3> twice = twice_centre(node);
    const int step[3] = {direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        twice[axis] += std::int64_t(step[axis]) * (std::int64_t{2} << node.level);
        if (twice[axis] < 0 || twice[axis] >= std::int64_t(2) * task_.lattice.cells()) return outside;
    }
    return find(twice, node.level);
}

std::uint32_t OffsetTree::find(const std::array<std::int64_t, 3>& twice, int level) const {
    std::uint32_t at = 0;
    while (nodes_[at].child != 0 && nodes_[at].level > level) {
        const int bit = nodes_[at].level;  // of twice the coordinates, that tells the halves
        at = nodes_[at].child +
             std::uint32_t((twice[0] >> bit & 1) | (twice[1] >> bit & 1) << 1 | (twice[2] >> bit & 1) << 2);
    }
    return at;
}

std::uint32_t OffsetTree::leaf_of(const Vec3& p) const {
    const Vec3 at = task_.lattice.to_lattice(p);
    std::array<std::int64_t, 3> twice{};
    for (int axis = 0; axis < 3; ++axis)
        twice[std::size_t(axis)] = std::clamp(std::int64_t(std::floor(2 * at[axis])), std::int64_t{0},
                                              std::int64_t(2) * task_.lattice.cells() - 1);
    return find(twice, 0);
}

void OffsetTree::leaves_around(const PointValues::Point& p, int level,
                               std::vector<std::uint32_t>& found) const {
    for (int c = 0; c < 8; ++c) {
        std::array<std::int64_t, 3> twice{};
        bool within = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            twice[axis] = 2 * std::int64_t(p[axis]) - 1 + 2 * (c >> axis & 1);
            within = within && twice[axis] >= 0 && twice[axis] < std::int64_t(2) * task_.lattice.cells();
        }
        if (!within) continue;
        const std::uint32_t leaf = find(twice, 0);
        if (nodes_[leaf].level == level) found.push_back(leaf);
    }
}

/// Cells around one that is halved are there at its own level: those that are not, which are one level coarser,
/// are halved first.
void OffsetTree::halve_balanced(std::uint32_t leaf, std::vector<std::uint32_t>& fresh) {
    if (nodes_[leaf].child != 0) return;
    for (int direction = 0; direction < octree::neighbours; ++direction) {
        const std::uint32_t other = neighbour(nodes_[leaf], direction);
        if (other != outside && nodes_[other].level > nodes_[leaf].level) halve_balanced(other, fresh);
    }
    halve(leaf, fresh);
}

std::vector<std::uint32_t> OffsetTree::wide_leaves(double width) const {
    std::vector<std::uint32_t> found;
    for (std::uint32_t i = 0; i < nodes_.size(); ++i)
        if (nodes_[i].child == 0 && nodes_[i].level > 0 && may_be_crossed(nodes_[i]) &&
            std::ldexp(task_.lattice.width, nodes_[i].level) > width)
            found.push_back(i);
    return found;
}

void OffsetTree::split(std::span<const std::uint32_t> leaves, const Progress& progress) {
    std::vector<std::uint32_t> fresh;
    for (const std::uint32_t leaf : leaves) halve_balanced(leaf, fresh);
    refine(std::move(fresh), progress);
}

/// Values of new leaves, and the halving of those that are too coarse, until none is.
void OffsetTree::refine(std::vector<std::uint32_t> fresh, const Progress& progress) {
    while (!fresh.empty()) {
        Stage stage(progress, "distances", fresh.size());
        parallel_for(fresh.size(), grain, [&](std::uint64_t i) {
            Node& node = nodes_[fresh[i]];
            const Node& parent = nodes_[node.parent];
            node.centre = evaluate(position(twice_centre(node)), position(twice_centre(parent)), parent.centre);
        });
        std::vector<Wanted> wanted;
        for (const std::uint32_t i : fresh) {
            const Node& node = nodes_[i];
            if (node.level > 0) values_.insert(group_key(node, 13), node.centre);
            if (!may_be_crossed(node)) continue;
            for (int c = 0; c < 8; ++c) want(corner_key(node, c), node, wanted);
        }
        evaluate(wanted);
        stage.advance(fresh.size());
        std::vector<std::uint32_t> halved, next;
        for (const std::uint32_t i : fresh)
            if (nodes_[i].child == 0 && may_be_crossed(nodes_[i]) && is_coarse(nodes_[i])) halved.push_back(i);
        for (const std::uint32_t leaf : halved) halve_balanced(leaf, next);
        fresh = std::move(next);
    }
}

/// Bit n: in direction n there is a leaf as large as the parent of a group.
std::uint32_t OffsetTree::leaves_around_group(const Node& parent) const {
    std::uint32_t bits = 0;
    for (int direction = 0; direction < octree::neighbours; ++direction) {
        const std::uint32_t other = neighbour(parent, direction);
        if (other != outside && nodes_[other].child == 0) bits |= 1u << direction;
    }
    return bits;
}

namespace {

/// By point of a group: directions, from its parent, of the cells that touch the point and do not have it as a
/// corner, if they are as large as the parent. None of the parent's corners and its middle.
constexpr std::array<std::uint32_t, octree::group_points> hung_by = [] {
    std::array<std::uint32_t, octree::group_points> table{};
    for (int p = 0; p < octree::group_points; ++p) {
        const int at[3] = {p % 3, p / 3 % 3, p / 9};
        if (at[0] != 1 && at[1] != 1 && at[2] != 1) continue;
        for (int n = 0; n < octree::neighbours; ++n) {
            bool touches = n != octree::itself;
            for (int axis = 0, rest = n; axis < 3; ++axis, rest /= 3)
                touches =
                    touches && (rest % 3 == 1 || rest % 3 == at[axis]) && (at[axis] != 1 || rest % 3 == 1);
            if (touches) table[std::size_t(p)] |= 1u << n;
        }
    }
    return table;
}();

}  // namespace

OffsetTree::Crossed OffsetTree::crossed(const Progress& progress) {
    Stage stage(progress, "surface cells", nodes_.size());
    struct Group {
        std::uint32_t parent;
        unsigned near = 0;          ///< bit c: child c is a leaf that the surface may run through
        std::uint32_t hanging = 0;  ///< of its 27 points
    };
    std::vector<Group> groups;
    std::vector<std::uint64_t> divided;
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
        const Node& node = nodes_[i];
        if (node.child == 0) continue;
        divided.push_back(
            surface::CellSet::key(task_.lattice.depth, node.level, octree::morton_encode(node.at)));
        Group group{i};
        for (unsigned c = 0; c < 8; ++c) {
            const Node& child = nodes_[node.child + c];
            const double width = std::ldexp(task_.lattice.width, child.level);
            const bool near = std::abs(child.centre) <= (1 + 0x1p-20) * to_far_corner * width + rounding_;
            if (child.child == 0 && near) group.near |= 1u << c;
        }
        if (group.near != 0) groups.push_back(group);
    }
    parallel_for(groups.size(), grain, [&](std::uint64_t i) {
        const std::uint32_t around = leaves_around_group(nodes_[groups[i].parent]);
        for (int p = 0; p < octree::group_points; ++p)
            if ((hung_by[std::size_t(p)] & around) != 0) groups[i].hanging |= 1u << p;
    });
    std::vector<Wanted> wanted;
    for (const Group& group : groups) {
        const Node& parent = nodes_[group.parent];
        std::uint32_t points = 0;
        for (unsigned c = 0; c < 8; ++c)
            if (group.near >> c & 1) points |= adaptive::points_of_child[c];
        if ((points & group.hanging) != 0) points |= adaptive::corner_points;
        for (int p = 0; p < octree::group_points; ++p)
            if ((points & ~group.hanging) >> p & 1) want(group_key(parent, p), parent, wanted);
    }
    evaluate(wanted);
    std::vector<std::vector<surface::LeafCell>> cells(chunk_count(groups.size(), grain));
    std::vector<std::vector<std::uint32_t>> nodes(cells.size());
    for_chunks(groups.size(), grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) {
            const Node& parent = nodes_[groups[i].parent];
            double corner[8] = {};
            const bool hangs = groups[i].hanging != 0;
            for (int c = 0; c < 8 && hangs; ++c) {
                const double* const value = values_.find(corner_key(parent, c));
                corner[c] = value != nullptr ? *value : 0;  // of none that hangs and is wanted
            }
            for (unsigned c = 0; c < 8; ++c) {
                if (!(groups[i].near >> c & 1)) continue;
                const std::uint32_t number = parent.child + c;
                surface::LeafCell cell{nodes_[number].at, nodes_[number].level, {}};
                bool below = false, above = false;
                for (int k = 0; k < 8; ++k) {
                    const int p = octree::group_point(int(c), k);
                    const double value = groups[i].hanging >> p & 1 ? adaptive::interpolated(corner, p)
                                                                    : *values_.find(group_key(parent, p));
                    cell.value[std::size_t(k)] = value / task_.lattice.width;
                    (value < 0 ? below : above) = true;
                }
                if (!below || !above) continue;
                cells[chunk].push_back(cell);
                nodes[chunk].push_back(number);
            }
        }
    });
    Crossed result;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        result.leaves.cells.insert(result.leaves.cells.end(), cells[i].begin(), cells[i].end());
        result.node.insert(result.node.end(), nodes[i].begin(), nodes[i].end());
    }
    result.leaves.divided = surface::CellSet(divided);
    return result;
}

}  // namespace its::wrapper
