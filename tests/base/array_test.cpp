#include "base/array.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace its {
namespace {

TEST(Array, OfAVectorKeepsItsMemory) {
    std::vector<std::uint32_t> elements = {3, 1, 4, 1, 5};
    const std::uint32_t* const place = elements.data();
    const Array<std::uint32_t> array = std::move(elements);
    EXPECT_EQ(array.data(), place);
    EXPECT_EQ(array, (std::vector<std::uint32_t>{3, 1, 4, 1, 5}));
    EXPECT_EQ(array.front(), 3u);
    EXPECT_EQ(array.back(), 5u);
    EXPECT_EQ(array[2], 4u);
}

TEST(Array, CopiesShareTheElements) {
    Array<double> copy;
    {
        const Array<double> array = {1.0, 2.0};
        copy = array;
        EXPECT_EQ(copy.data(), array.data());
    }
    EXPECT_EQ(copy, (Array<double>{1.0, 2.0}));
    EXPECT_FALSE(copy == (Array<double>{1.0}));
    EXPECT_FALSE(copy == (Array<double>{1.0, 3.0}));
}

TEST(Array, KeepsItsOwnerAlive) {
    auto owner = std::make_shared<std::vector<int>>(std::vector<int>{1, 2, 3});
    const std::weak_ptr<std::vector<int>> watch = owner;
    Array<int> part(std::span<const int>(*owner).subspan(1), owner);
    owner.reset();
    EXPECT_FALSE(watch.expired());
    EXPECT_EQ(part, (std::vector<int>{2, 3}));
    part = {};
    EXPECT_TRUE(watch.expired());
}

TEST(Array, ConvertsToASpan) {
    const Array<int> array = {1, 2, 3};
    const std::span<const int> span = array;
    EXPECT_EQ(span.data(), array.data());
    EXPECT_EQ(span.size(), 3u);
    EXPECT_TRUE(Array<int>().empty());
    EXPECT_EQ(Array<int>().begin(), Array<int>().end());
}

}  // namespace
}  // namespace its
