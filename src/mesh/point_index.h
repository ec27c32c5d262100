#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "its/base.h"

namespace its::mesh {

/// Numbers distinct positions in the order of their first occurrence; −0 equals +0. Coordinates must not be
/// NaN. An open-addressing hash table; the numbers do not depend on the hash.
class PointIndex {
public:
    explicit PointIndex(std::size_t expected = 0) {
        points_.reserve(expected);
        std::size_t slots = 64;
        while (slots < expected * 2) slots *= 2;
        slots_.resize(slots);
    }

    /// The number of this position. At most 2³² − 1 of them are told apart: check size().
    std::uint32_t insert(Vec3 point) {
        point = {point.x + 0.0, point.y + 0.0, point.z + 0.0};  // −0 + 0 = +0
        const std::uint64_t hash = hash_of(point);
        const auto tag = std::uint32_t(hash >> 32);
        for (std::size_t i = hash & (slots_.size() - 1);; i = (i + 1) & (slots_.size() - 1)) {
            Slot& slot = slots_[i];
            if (slot.number == 0) {
                points_.push_back(point);
                slot = {tag, std::uint32_t(points_.size())};
                if (points_.size() * 2 > slots_.size()) grow();
                return std::uint32_t(points_.size() - 1);
            }
            if (slot.tag == tag && points_[slot.number - 1] == point) return slot.number - 1;
        }
    }

    std::size_t size() const { return points_.size(); }
    const std::vector<Vec3>& points() const { return points_; }

private:
    struct Slot {
        std::uint32_t tag = 0, number = 0;  ///< number: one more than the point's, 0 if free
    };

    /// Multiply and fold, after the finaliser of SplitMix64.
    static std::uint64_t hash_of(const Vec3& p) {
        std::uint64_t h = 0;
        for (const double c : {p.x, p.y, p.z}) {
            h = (h ^ std::bit_cast<std::uint64_t>(c)) * 0x9e3779b97f4a7c15ull;
            h ^= h >> 29;
        }
        h *= 0xbf58476d1ce4e5b9ull;
        return h ^ (h >> 32);
    }

    void grow() {
        std::vector<Slot> old(slots_.size() * 2);
        old.swap(slots_);
        for (std::uint32_t number = 1; number <= points_.size(); ++number) {
            const std::uint64_t hash = hash_of(points_[number - 1]);
            std::size_t i = hash & (slots_.size() - 1);
            while (slots_[i].number != 0) i = (i + 1) & (slots_.size() - 1);
            slots_[i] = {std::uint32_t(hash >> 32), number};
        }
    }

    std::vector<Vec3> points_;
    std::vector<Slot> slots_;
};

}  // namespace its::mesh
