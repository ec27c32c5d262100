#include "distance/curve_order.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"
#include "base/platform/compiler.h"
#include "geometry/box.h"
#include "octree/morton.h"

namespace its::distance {

namespace {

constexpr int bits = 11;  // of each coordinate
constexpr std::uint64_t grain = 4096;
constexpr int block = 64;  // points at a time

/// Cells of the points of a block, then their places on the curve, an axis' bits apart.
struct Cells {
    std::uint32_t x[block], y[block], z[block];
};

/// From coordinates to the curve (J. Skilling, Programming the Hilbert curve, AIP Conf. Proc. 707, 2004):
/// level by level, from the largest, exchanges or reflects axes; the Gray code at the end.
ITS_CLONES void follow_curve(Cells& c) {
    for (int level = bits - 1; level > 0; --level) {
        const std::uint32_t below = (1U << level) - 1;
        const auto if_set = [&](std::uint32_t v) { return (0U - (v >> level & 1U)) & below; };
        for (int i = 0; i < block; ++i) {
            std::uint32_t x = c.x[i], y = c.y[i], z = c.z[i];
            x ^= if_set(x);
            const std::uint32_t by_y = if_set(y), xy = (x ^ y) & (below ^ by_y);
            x ^= by_y ^ xy;
            y ^= xy;
            const std::uint32_t by_z = if_set(z), xz = (x ^ z) & (below ^ by_z);
            x ^= by_z ^ xz;
            z ^= xz;
            c.x[i] = x;
            c.y[i] = y;
            c.z[i] = z;
        }
    }
    std::uint32_t flip[block] = {};
    for (int i = 0; i < block; ++i) {
        c.y[i] ^= c.x[i];
        c.z[i] ^= c.y[i];
    }
    for (int level = bits - 1; level > 0; --level)
        for (int i = 0; i < block; ++i) flip[i] ^= (0U - (c.z[i] >> level & 1U)) & ((1U << level) - 1);
    for (int i = 0; i < block; ++i) {
        c.x[i] ^= flip[i];
        c.y[i] ^= flip[i];
        c.z[i] ^= flip[i];
    }
}

/// Place on the curve, and number, of each point.
struct Key {
    std::uint64_t place;
    std::uint32_t point;
};

std::vector<Key> keys_of(std::span<const Vec3> points, std::span<const std::uint32_t> numbers) {
    Box box = geometry::empty_box;
    for (const std::uint32_t i : numbers) geometry::extend(box, points[i]);
    const Vec3 size{box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z};
    const double side = std::max({size.x, size.y, size.z});
    const double last = (1 << bits) - 1, cells = side > 1e-300 ? last / side : 0;
    std::vector<Key> keys(numbers.size());
    for_chunks(numbers.size(), grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        Cells cells_of = {};
        for (std::uint64_t first = begin; first < end; first += block) {
            const std::uint64_t count = std::min<std::uint64_t>(block, end - first);
            for (std::uint64_t i = 0; i < count; ++i) {
                const Vec3& p = points[numbers[first + i]];
                cells_of.x[i] = std::uint32_t(std::min((p.x - box.min.x) * cells, last));
                cells_of.y[i] = std::uint32_t(std::min((p.y - box.min.y) * cells, last));
                cells_of.z[i] = std::uint32_t(std::min((p.z - box.min.z) * cells, last));
            }
            follow_curve(cells_of);
            for (std::uint64_t i = 0; i < count; ++i)
                keys[first + i] = {octree::morton_encode({cells_of.z[i], cells_of.y[i], cells_of.x[i]}),
                                   numbers[first + i]};
        }
    });
    return keys;
}

}  // namespace

std::vector<std::uint32_t> curve_order(std::span<const Vec3> points, std::span<const std::uint32_t> numbers) {
    std::vector<Key> keys = keys_of(points, numbers), sorted(keys.size());
    for (int shift = 0; shift < 3 * bits; shift += bits) {
        const auto digit = [shift](const Key& key) { return (key.place >> shift) & ((1U << bits) - 1); };
        std::array<std::uint32_t, (1 << bits) + 1> begin{};
        for (const Key& key : keys) ++begin[digit(key) + 1];
        for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
        for (const Key& key : keys) sorted[begin[digit(key)]++] = key;
        keys.swap(sorted);
    }
    std::vector<std::uint32_t> order(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) order[i] = keys[i].point;
    return order;
}

}  // namespace its::distance
