#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace its::adaptive {

/// Distances at hanging points, by lattice point. They are no values of f, but tell why it misses the window.
class HangingDistances {
public:
    static constexpr std::uint64_t no_key = ~std::uint64_t{0};
    const double* find(std::uint64_t key) const {
        if (keys_.empty()) return nullptr;
        for (std::uint64_t at = place(key);; at = (at + 1) & mask()) {
            if (keys_[at] == no_key) return nullptr;
            if (keys_[at] == key) return &distance_[at];
        }
    }
    void insert(std::uint64_t key, double distance) {
        if (2 * (size_ + 1) > keys_.size()) grow();
        std::uint64_t at = place(key);
        while (keys_[at] != no_key) at = (at + 1) & mask();
        keys_[at] = key;
        distance_[at] = distance;
        ++size_;
    }
    std::uint64_t bytes() const { return keys_.size() * 16; }

private:
    std::uint64_t mask() const { return keys_.size() - 1; }
    std::uint64_t place(std::uint64_t key) const {  // Fibonacci hashing
        return (key * 0x9e3779b97f4a7c15) >> 20 & mask();
    }
    void grow() {
        std::vector<std::uint64_t> keys(std::max<std::size_t>(64, 2 * keys_.size()), no_key);
        std::vector<double> distance(keys.size());
        keys.swap(keys_);
        distance.swap(distance_);
        size_ = 0;
        for (std::size_t i = 0; i < keys.size(); ++i)
            if (keys[i] != no_key) insert(keys[i], distance[i]);
    }
    std::vector<std::uint64_t> keys_;
    std::vector<double> distance_;
    std::uint64_t size_ = 0;
};

}  // namespace its::adaptive
