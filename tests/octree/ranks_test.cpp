#include "octree/ranks.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <random>
#include <vector>

namespace its {
namespace {

TEST(Ranks, CountBits) {
    std::mt19937_64 random(20240);
    for (std::size_t n = 0; n < 40; ++n) {
        std::vector<std::uint8_t> masks(n);
        for (std::uint8_t& mask : masks) mask = random() % 4 == 0 ? 0 : std::uint8_t(random());
        const octree::Ranks ranks{masks};
        ASSERT_EQ(ranks.size(), n + 1);
        std::uint64_t count = 0;
        for (std::size_t i = 0; i < n; ++i) {
            EXPECT_EQ(ranks[i], count);
            for (int bit = 0; bit < 8; ++bit) {
                EXPECT_EQ(ranks.rank(i, bit), count);
                if (!(masks[i] >> bit & 1)) continue;
                EXPECT_EQ(ranks.find(count), i);
                ++count;
            }
        }
        EXPECT_EQ(ranks.back(), count);
    }
}

}  // namespace
}  // namespace its
