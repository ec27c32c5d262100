#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "distance/closest_point.h"
#include "distance/leaf_singles.h"

namespace its::distance {

/// Closest points of many points at once: those near to each other need the same triangles. Single precision,
/// with proven errors, tells which those may be; what is found is that of ClosestPointTree::find(), bit for
/// bit. docs/design/distance.md.
class GroupSearch {
public:
    static constexpr int group = 128;  ///< points

    explicit GroupSearch(const ClosestPointTree& tree);

    /// \param points  of any number, best sorted along a curve: consecutive ones are searched together; within
    ///                reach()
    void find(std::span<const Vec3> points, std::span<Nearest> results) const;

    /// How far a point's coordinates may be from those of the tree's centre.
    double reach() const { return far / tree_.frame.inverse_scale; }
    Vec3 centre() const { return tree_.frame.centre; }

    std::uint64_t memory_bytes() const;  ///< beside the tree

    /// In units of the boxes: from here on, single precision tells too few triangles apart.
    static constexpr double far = 256;

    /// What a search reads.
    struct View {
        ClosestPointTree::View tree;
        const SingleTriangle* triangles;
        const LeafBox* boxes;
        float longest_edge;
    };

private:
    const ClosestPointTree* searched_;
    ClosestPointTree::View tree_;
    std::vector<SingleTriangle> triangles_;  ///< of each slot of the tree
    std::vector<LeafBox> boxes_;             ///< of each block
    float longest_edge_ = 0;
};

}  // namespace its::distance
