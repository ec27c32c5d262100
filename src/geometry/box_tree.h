#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "geometry/box.h"
#include "its/base.h"

namespace its::geometry {

/// A balanced binary tree over boxes: finds those that satisfy a condition which the box around several
/// satisfies whenever one of them does.
class BoxTree {
public:
    explicit BoxTree(std::vector<Box> boxes) : boxes_(std::move(boxes)), item_(boxes_.size()) {
        std::iota(item_.begin(), item_.end(), std::uint32_t{0});
        if (!item_.empty()) make_node(0, std::uint32_t(item_.size()));
    }

    /// \return whether stop(i) was true for a box i with meets(box); the first such ends the search
    template <class Meets, class Stop>
    bool any(Meets&& meets, Stop&& stop) const {
        if (nodes_.empty()) return false;
        std::array<std::uint32_t, 64> open;  // the depth is at most 32
        std::size_t count = 0;
        open[count++] = 0;
        while (count > 0) {
            const std::uint32_t at = open[--count];
            const Node& node = nodes_[at];
            if (!meets(node.box)) continue;
            if (node.second != 0) {
                open[count++] = node.second;
                open[count++] = at + 1;
                continue;
            }
            for (std::uint32_t i = node.begin; i < node.end; ++i)
                if (meets(boxes_[item_[i]]) && stop(item_[i])) return true;
        }
        return false;
    }

    template <class Meets, class F>
    void for_each(Meets&& meets, F&& fn) const {
        any(meets, [&](std::uint32_t i) {
            fn(i);
            return false;
        });
    }

private:
    struct Node {
        Box box;
        std::uint32_t begin, end, second;  ///< items; the second child, 0: a leaf; the first is the next node
    };
    static constexpr std::uint32_t leaf_size = 4;

    void make_node(std::uint32_t begin, std::uint32_t end) {
        const auto at = std::uint32_t(nodes_.size());
        Box box = boxes_[item_[begin]];
        for (std::uint32_t i = begin; i < end; ++i) {
            extend(box, boxes_[item_[i]].min);
            extend(box, boxes_[item_[i]].max);
        }
        nodes_.push_back({box, begin, end, 0});
        if (end - begin <= leaf_size) return;
        int axis = 0;
        for (int other = 1; other < 3; ++other)
            if (box.max[other] - box.min[other] > box.max[axis] - box.min[axis]) axis = other;
        const std::uint32_t middle = begin + (end - begin) / 2;
        const auto before = [&](std::uint32_t i, std::uint32_t j) {
            const double a = 0.5 * boxes_[i].min[axis] + 0.5 * boxes_[i].max[axis],
                         b = 0.5 * boxes_[j].min[axis] + 0.5 * boxes_[j].max[axis];
            return a < b || (a == b && i < j);
        };
        std::nth_element(item_.begin() + begin, item_.begin() + middle, item_.begin() + end, before);
        make_node(begin, middle);
        nodes_[at].second = std::uint32_t(nodes_.size());
        make_node(middle, end);
    }

    std::vector<Box> boxes_;
    std::vector<std::uint32_t> item_;
    std::vector<Node> nodes_;
};

}  // namespace its::geometry
