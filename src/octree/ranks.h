#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/platform/compiler.h"

/// Counts of set bits in an array of 8-bit masks.
namespace its::octree {

/// ranks[i]: the number of set bits in masks 0 … i − 1, for 0 ≤ i ≤ number of masks. Two bytes a mask, and one
/// cache line a look-up, since the masks are kept beside their counts.
class Ranks {
public:
    /// Eight masks, the first in the lowest byte, and the number of bits before them.
    struct Word {
        std::uint64_t masks = 0, before = 0;

        /// The number of bits before bit `bit` of mask i, of which this is the word.
        ITS_INLINE std::uint64_t rank(std::uint64_t i, int bit) const {
            const std::uint64_t below = (std::uint64_t{1} << (8 * (i % 8) + std::uint64_t(bit))) - 1;
            return before + std::uint64_t(std::popcount(masks & below));
        }
    };

    Ranks() : Ranks(std::span<const std::uint8_t>()) {}
    explicit Ranks(std::span<const std::uint8_t> masks) : count_(masks.size()), words_(masks.size() / 8 + 1) {
        std::uint64_t before = 0;
        for (std::size_t w = 0; w < words_.size(); ++w) {
            const auto eight = masks.subspan(8 * w, std::min<std::size_t>(8, masks.size() - 8 * w));
            for (std::size_t i = 0; i < eight.size(); ++i)
                words_[w].masks |= std::uint64_t{eight[i]} << (8 * i);
            words_[w].before = before;
            before += std::uint64_t(std::popcount(words_[w].masks));
        }
    }

    std::uint64_t operator[](std::uint64_t i) const { return words_[i / 8].rank(i, 0); }
    /// As [i], and the bits of mask i below `bit`.
    std::uint64_t rank(std::uint64_t i, int bit) const { return words_[i / 8].rank(i, bit); }
    std::uint64_t back() const { return (*this)[count_]; }
    std::size_t size() const { return count_ + 1; }
    const Word* words() const { return words_.data(); }
    std::uint64_t bytes() const { return words_.size() * sizeof(Word); }

    /// The mask that has the bit with this rank, which is below back().
    std::uint64_t find(std::uint64_t rank) const {
        const auto above =
            std::upper_bound(words_.begin(), words_.end(), rank,
                             [](std::uint64_t value, const Word& word) { return value < word.before; });
        std::uint64_t i = 8 * std::uint64_t(above - words_.begin() - 1);
        while ((*this)[i + 1] <= rank) ++i;
        return i;
    }

private:
    std::size_t count_;
    std::vector<Word> words_;
};

}  // namespace its::octree
