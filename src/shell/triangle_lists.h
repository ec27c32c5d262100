#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <vector>

#include "base/array.h"
#include "octree/octree.h"

/// Which triangles meet each surface cell, in one to three bytes a triangle.
namespace its::shell {

/// The triangles of one cell, ascending: a range to iterate over. It never leaves its bytes and never gives a
/// triangle ≥ `limit`, whatever the bytes are.
class TriangleList {
public:
    class Iterator {
    public:
        // NOLINTBEGIN(readability-identifier-naming): names of the standard
        using value_type = std::uint32_t;
        using difference_type = std::ptrdiff_t;
        // NOLINTEND(readability-identifier-naming)

        Iterator() = default;
        Iterator(std::span<const std::uint8_t> bytes, std::uint64_t limit)
            : at_(bytes.data()), end_(at_ + bytes.size()), limit_(limit) {
            ++*this;
        }
        std::uint32_t operator*() const { return std::uint32_t(next_ - 1); }
        Iterator& operator++() {
            std::uint64_t step = 0;
            for (unsigned shift = 0; at_ != end_ && shift < 35; shift += 7) {
                const std::uint8_t byte = *at_++;
                step |= std::uint64_t(byte & 127u) << shift;
                if (byte > 127) continue;
                next_ += step + 1;
                if (next_ > limit_) break;
                return *this;
            }
            next_ = 0;  // the end, or nonsense
            return *this;
        }
        Iterator operator++(int) {
            const Iterator old = *this;
            ++*this;
            return old;
        }
        friend bool operator==(const Iterator& a, std::default_sentinel_t) { return a.next_ == 0; }
        friend bool operator==(const Iterator& a, const Iterator& b) {
            return a.next_ == b.next_ && a.at_ == b.at_;
        }

    private:
        const std::uint8_t* at_ = nullptr;
        const std::uint8_t* end_ = nullptr;
        std::uint64_t limit_ = 0, next_ = 0;  // next_: the triangle + 1; 0 at the end
    };

    TriangleList(std::span<const std::uint8_t> bytes, std::uint64_t limit) : bytes_(bytes), limit_(limit) {}
    Iterator begin() const { return {bytes_, limit_}; }
    std::default_sentinel_t end() const { return {}; }

private:
    std::span<const std::uint8_t> bytes_;
    std::uint64_t limit_;
};

/// The lists of all surface cells, sibling group by sibling group.
///
/// A group's bytes are the lists of its marked children in order, each preceded by its length in bytes; a list
/// is its first triangle and then each difference from the one before, less one. All these numbers are written
/// in base 128, low digits first, with bit 7 set on all bytes but the last.
struct TriangleLists {
    Array<std::uint64_t> offset;  ///< where each group's bytes begin; one more entry at the end: the total
    Array<std::uint8_t> bytes;

    /// The list with this number in the group: the number of marked children before its own.
    TriangleList list(std::uint64_t group, int number, std::uint64_t limit) const;
};

/// The same lists as plain arrays: cell c has triangle[offset[c] … offset[c+1]), strictly ascending.
struct CellLists {
    std::vector<std::uint64_t> offset;
    std::vector<std::uint32_t> triangle;
};

/// \param level  level 0 of the octree, if all surface cells are there
TriangleLists pack_lists(const octree::Level& level, std::span<const std::uint64_t> offset,
                         std::span<const std::uint32_t> triangle);
/// Of all groups that may have surface cells, in the octree's order.
TriangleLists pack_lists(const octree::Octree& octree, std::span<const std::uint64_t> offset,
                         std::span<const std::uint32_t> triangle);
CellLists unpack_lists(const octree::Level& level, const TriangleLists& lists, std::uint64_t limit);

/// Whether the bytes of a group are `count` complete lists of triangles < limit, and nothing else.
bool well_formed(const TriangleLists& lists, std::uint64_t group, int count, std::uint64_t limit);

}  // namespace its::shell
