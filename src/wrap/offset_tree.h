#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "octree/lattice.h"
#include "octree/morton.h"
#include "surface/leaf_cells.h"
#include "surface/memory_guard.h"
#include "wrap/offset_field.h"

/// An octree that is fine where an offset surface of M runs.
namespace its::wrapper {

/// Values at lattice points by their coordinates: a hash table that only grows.
class PointValues {
public:
    using Point = std::array<std::uint32_t, 3>;
    static std::uint64_t key(const Point& p) {
        return (p[0] | std::uint64_t{p[1]} << 21 | std::uint64_t{p[2]} << 42) + 1;
    }
    static Point point(std::uint64_t key) {
        --key;
        return {std::uint32_t(key & 0x1fffff), std::uint32_t(key >> 21 & 0x1fffff), std::uint32_t(key >> 42)};
    }

    PointValues() : slots_(1024) {}
    const double* find(std::uint64_t key) const {
        for (std::size_t at = place(key);; at = (at + 1) & (slots_.size() - 1)) {
            if (slots_[at].key == key) return &slots_[at].value;
            if (slots_[at].key == 0) return nullptr;
        }
    }
    void insert(std::uint64_t key, double value);
    std::uint64_t size() const { return size_; }
    std::uint64_t memory_bytes() const { return slots_.size() * sizeof(Slot); }

private:
    struct Slot {
        std::uint64_t key = 0;
        double value = 0;
    };
    std::size_t place(std::uint64_t key) const {
        return std::size_t((key * 0x9e3779b97f4a7c15) >> 20) & (slots_.size() - 1);
    }
    std::vector<Slot> slots_;
    std::uint64_t size_ = 0;
};

/// What is wanted of the tree. Lengths in mesh units.
struct OffsetTask {
    const octree::Lattice& lattice;
    const OffsetField& field;
    double level;      ///< of the signed distance, at which the surface is
    double tolerance;  ///< cells are halved where the function's bend is larger
};

/// Cells of levels 0 to depth + 1 (the root), each a leaf or halved. Any two that touch differ by one level at
/// most. g is the signed distance less the level.
class OffsetTree {
public:
    struct Node {
        octree::Cell at;  ///< within its level
        int level;
        std::uint32_t parent;
        std::uint32_t child = 0;  ///< the first of eight; 0: a leaf
        double centre = 0;        ///< g in the middle
    };

    OffsetTree(const OffsetTask& task, surface::MemoryGuard& guard, const Progress& progress);

    /// Halves leaves, what balance asks for, and then what is too coarse.
    void split(std::span<const std::uint32_t> leaves, const Progress& progress);

    /// Leaves that the surface of the interpolated g runs through, and which nodes they are.
    struct Crossed {
        surface::LeafCells leaves;  ///< values are g, in finest cells: the surface is at 0
        std::vector<std::uint32_t> node;
    };
    Crossed crossed(const Progress& progress);

    const Node& node(std::uint32_t i) const { return nodes_[i]; }
    /// The finest node with the point that has this level or a coarser one.
    /// \param twice  twice its coordinates
    std::uint32_t find(const std::array<std::int64_t, 3>& twice, int level) const;
    std::uint32_t leaf_of(const Vec3& p) const;
    /// The leaves that touch a lattice point and have a level.
    void leaves_around(const PointValues::Point& p, int level, std::vector<std::uint32_t>& found) const;
    /// Leaves that may be crossed, as far as their middles tell, and are wider than this.
    std::vector<std::uint32_t> wide_leaves(double width) const;
    const PointValues& values() const { return values_; }
    /// Whether two points this far from each other are on one side of M, as one is at this distance from it.
    bool same_side(double way, double distance) const { return way + rounding_ < distance; }

private:
    static constexpr std::uint32_t outside = ~std::uint32_t{0};

    /// A point that is to be evaluated, and one nearby whose value is known.
    struct Wanted {
        std::uint64_t key;
        Vec3 from;
        double value;
    };
    Vec3 position(const std::array<std::int64_t, 3>& twice) const;
    Vec3 position(std::uint64_t key) const;
    double evaluate(const Vec3& p, const Vec3& from, double value) const;
    void evaluate(std::vector<Wanted>& wanted);
    std::array<std::int64_t, 3> twice_centre(const Node& node) const;
    std::uint64_t corner_key(const Node& node, int corner) const;
    std::uint64_t group_key(const Node& parent, int point) const;
    bool may_be_crossed(const Node& node) const;
    bool is_coarse(const Node& node) const;
    void halve(std::uint32_t leaf, std::vector<std::uint32_t>& fresh);
    void halve_balanced(std::uint32_t leaf, std::vector<std::uint32_t>& fresh);
    void refine(std::vector<std::uint32_t> fresh, const Progress& progress);
    std::uint32_t neighbour(const Node& node, int direction) const;
    std::uint32_t leaves_around_group(const Node& parent) const;
    void want(std::uint64_t key, const Node& near, std::vector<Wanted>& wanted) const;

    OffsetTask task_;
    surface::MemoryGuard& guard_;
    std::vector<Node> nodes_;
    PointValues values_;
    double rounding_;            ///< of a distance and a way between points
    std::uint64_t counted_ = 0;  ///< bytes that the guard knows of
};

}  // namespace its::wrapper
