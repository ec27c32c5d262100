#include "shell/triangle_lists.h"

#include <algorithm>
#include <bit>

#include "base/parallel.h"

namespace its::shell {

namespace {

constexpr std::uint64_t group_grain = 4096;

std::uint8_t* put(std::uint64_t number, std::uint8_t* at) {
    for (; number > 127; number >>= 7) *at++ = std::uint8_t(number | 128);
    *at++ = std::uint8_t(number);
    return at;
}

std::uint64_t digits(std::uint64_t number) {
    return number == 0 ? 1 : std::uint64_t(std::bit_width(number) + 6) / 7;
}

/// fn(number) for each number of a list as it is written.
template <class F>
void for_numbers(std::span<const std::uint32_t> list, F&& fn) {
    std::uint64_t next = 0;
    for (const std::uint32_t t : list) {
        fn(t - next);
        next = std::uint64_t{t} + 1;
    }
}

std::uint64_t list_bytes(std::span<const std::uint32_t> list) {
    std::uint64_t bytes = 0;
    for_numbers(list, [&](std::uint64_t number) { bytes += digits(number); });
    return bytes;
}

/// Takes a number off the front. False if it does not end, or is longer than `limit` allows.
bool take(std::span<const std::uint8_t>& bytes, std::uint64_t limit, std::uint64_t& number) {
    number = 0;
    for (unsigned shift = 0; !bytes.empty() && shift < 63; shift += 7) {
        const std::uint8_t byte = bytes.front();
        bytes = bytes.subspan(1);
        number |= std::uint64_t(byte & 127u) << shift;
        if (byte < 128) return number <= limit;
    }
    return false;
}

/// Takes a list off the front: its length, then its bytes; nothing if they are not there.
std::span<const std::uint8_t> take_list(std::span<const std::uint8_t>& bytes) {
    std::uint64_t length = 0;
    if (!take(bytes, ~std::uint64_t{0}, length) || length > bytes.size()) {
        bytes = {};
        return {};
    }
    const auto list = bytes.first(length);
    bytes = bytes.subspan(length);
    return list;
}

/// The bytes of a group, whatever `offset` says.
std::span<const std::uint8_t> group_bytes(const TriangleLists& lists, std::uint64_t group) {
    const std::uint64_t end = std::min<std::uint64_t>(lists.offset[group + 1], lists.bytes.size());
    const std::uint64_t begin = std::min(lists.offset[group], end);
    return {lists.bytes.data() + begin, end - begin};
}

}  // namespace

TriangleList TriangleLists::list(std::uint64_t group, int number, std::uint64_t limit) const {
    auto rest = group_bytes(*this, group);
    for (; number > 0; --number) take_list(rest);
    return {take_list(rest), limit};
}

namespace {

/// \param first  ranks of the groups' surface cells
TriangleLists pack(const octree::Ranks& first, std::span<const std::uint64_t> offset,
                   std::span<const std::uint32_t> triangle) {
    const std::uint64_t groups = first.size() - 1;
    const auto list_of = [&](std::uint64_t cell) {
        return triangle.subspan(offset[cell], offset[cell + 1] - offset[cell]);
    };
    std::vector<std::uint64_t> begin(groups + 1, 0);
    parallel_for(groups, group_grain, [&](std::uint64_t group) {
        for (std::uint64_t cell = first[group]; cell < first[group + 1]; ++cell) {
            const std::uint64_t length = list_bytes(list_of(cell));
            begin[group + 1] += digits(length) + length;
        }
    });
    for (std::uint64_t group = 0; group < groups; ++group) begin[group + 1] += begin[group];
    std::vector<std::uint8_t> bytes(begin.back());
    parallel_for(groups, group_grain, [&](std::uint64_t group) {
        std::uint8_t* at = bytes.data() + begin[group];
        for (std::uint64_t cell = first[group]; cell < first[group + 1]; ++cell) {
            at = put(list_bytes(list_of(cell)), at);
            for_numbers(list_of(cell), [&](std::uint64_t number) { at = put(number, at); });
        }
    });
    return {std::move(begin), std::move(bytes)};
}

}  // namespace

TriangleLists pack_lists(const octree::Level& level, std::span<const std::uint64_t> offset,
                         std::span<const std::uint32_t> triangle) {
    return pack(level.first, offset, triangle);
}

TriangleLists pack_lists(const octree::Octree& octree, std::span<const std::uint64_t> offset,
                         std::span<const std::uint32_t> triangle) {
    if (!octree.adaptive()) return pack_lists(octree.levels[0], offset, triangle);
    std::vector<std::uint8_t> masks;
    masks.reserve(octree.surface_groups());
    for (int k = 0; k <= octree.depth; ++k)
        for (std::uint64_t group = 0; group < octree.levels[std::size_t(k)].groups(); ++group)
            masks.push_back(std::uint8_t(octree.surface_mask(k, group)));
    return pack(octree::Ranks(masks), offset, triangle);
}

CellLists unpack_lists(const octree::Level& level, const TriangleLists& lists, std::uint64_t limit) {
    CellLists result{.offset = {0}, .triangle = {}};
    for (std::uint64_t group = 0; group < level.groups(); ++group)
        for (int number = 0; number < std::popcount(level.mask[group]); ++number) {
            for (const std::uint32_t t : lists.list(group, number, limit)) result.triangle.push_back(t);
            result.offset.push_back(result.triangle.size());
        }
    return result;
}

bool well_formed(const TriangleLists& lists, std::uint64_t group, int count, std::uint64_t limit) {
    if (lists.offset[group] > lists.offset[group + 1] || lists.offset[group + 1] > lists.bytes.size())
        return false;
    auto bytes = group_bytes(lists, group);
    for (; count > 0; --count) {
        std::uint64_t length = 0, number = 0, next = 0;
        if (!take(bytes, bytes.size(), length) || length > bytes.size()) return false;
        auto list = bytes.first(length);
        bytes = bytes.subspan(length);
        while (!list.empty()) {
            if (!take(list, limit, number) || number >= limit - next) return false;
            next += number + 1;
        }
    }
    return bytes.empty();
}

}  // namespace its::shell
