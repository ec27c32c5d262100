#include "shell/triangle_lists.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

namespace its {
namespace {

constexpr std::uint64_t limit = std::uint64_t{1} << 32;

/// Random lists: few and many triangles, near each other and far apart, up to the largest index.
shell::CellLists random_lists(std::uint64_t cells, std::mt19937_64& random) {
    shell::CellLists lists{.offset = {0}, .triangle = {}};
    for (std::uint64_t c = 0; c < cells; ++c) {
        std::set<std::uint32_t> list;
        const std::uint32_t base = random() % 3 ? std::uint32_t(random()) : 0;
        const std::uint32_t spread = std::uint32_t(random() >> (32 + random() % 32));
        for (std::uint64_t n = random() % (random() % 10 ? 6 : 100); n > 0; --n)
            list.insert(base + (spread == 0 ? 0 : std::uint32_t(random()) % spread));
        if (random() % 8 == 0) list.insert(0xffffffff);
        lists.triangle.insert(lists.triangle.end(), list.begin(), list.end());
        lists.offset.push_back(lists.triangle.size());
    }
    return lists;
}

octree::Level random_level(std::uint64_t groups, std::mt19937_64& random) {
    std::vector<std::uint64_t> parent(groups);
    std::vector<std::uint8_t> mask(groups);
    for (std::uint64_t g = 0; g < groups; ++g) parent[g] = g, mask[g] = std::uint8_t(random());
    return {std::move(parent), std::move(mask)};
}

TEST(TriangleLists, RoundTrip) {
    std::mt19937_64 random(20240);
    for (const std::uint64_t groups : {1, 2, 9, 5000}) {
        const octree::Level level = random_level(groups, random);
        const shell::CellLists plain = random_lists(level.first.back(), random);
        const shell::TriangleLists packed = shell::pack_lists(level, plain.offset, plain.triangle);
        const shell::CellLists again = shell::unpack_lists(level, packed, limit);
        EXPECT_EQ(again.offset, plain.offset);
        EXPECT_EQ(again.triangle, plain.triangle);
        for (std::uint64_t g = 0; g < groups; ++g)
            EXPECT_TRUE(shell::well_formed(packed, g, std::popcount(level.mask[g]), limit));
    }
}

TEST(TriangleLists, BytesOfAKnownCase) {
    const octree::Level level({0}, {0b101});
    const shell::TriangleLists packed = shell::pack_lists(level, std::vector<std::uint64_t>{0, 3, 4},
                                                          std::vector<std::uint32_t>{5, 6, 200, 128});
    // The first list: 4 bytes, 5, 6 − 5 − 1, 200 − 6 − 1 = 65 + 128·1; the second: 2 bytes, 128.
    EXPECT_EQ(packed.bytes, (std::vector<std::uint8_t>{4, 5, 0, 65 + 128, 1, 2, 128, 1}));
    EXPECT_EQ(packed.offset, (std::vector<std::uint64_t>{0, 8}));
    EXPECT_FALSE(shell::well_formed(packed, 0, 2, 200));
    EXPECT_TRUE(shell::well_formed(packed, 0, 2, 201));
    EXPECT_FALSE(shell::well_formed(packed, 0, 1, 201));
    EXPECT_FALSE(shell::well_formed(packed, 0, 3, 201));
}

/// Whatever the bytes are, reading ends, and gives ascending triangles below the limit only.
TEST(TriangleLists, NonsenseIsHarmless) {
    std::mt19937_64 random(20240);
    for (int round = 0; round < 20000; ++round) {
        std::vector<std::uint8_t> bytes(random() % 24);
        for (std::uint8_t& byte : bytes)
            byte = random() % 3 == 0 ? std::uint8_t(random() % 8) : std::uint8_t(random());
        shell::TriangleLists lists{{random() % 4 ? 0 : random(), random() % 2 ? bytes.size() : random()},
                                   std::move(bytes)};
        const std::uint64_t most = random() % 2 ? limit : random() % 300;
        for (int number = 0; number < 9; ++number) {
            std::uint64_t next = 0;
            for (const std::uint32_t t : lists.list(0, number, most)) {
                ASSERT_LT(t, most);
                ASSERT_GE(t, next);
                next = std::uint64_t{t} + 1;
            }
        }
        (void)shell::well_formed(lists, 0, 3, most);
    }
}

}  // namespace
}  // namespace its
