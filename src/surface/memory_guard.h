#pragma once

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <string>

#include "its/base.h"
#include "its/memory.h"

/// Memory of an extraction, counted before it is taken.
namespace its::surface {

class MemoryGuard {
public:
    /// \param limit  bytes, or 0 for three quarters of what is free
    explicit MemoryGuard(std::uint64_t limit) : limit_(memory_limit(limit)) {}

    /// Counts bytes that are about to be taken, from any thread. \throws MemoryError
    void take(std::uint64_t bytes) {
        if (used_.fetch_add(bytes, std::memory_order_relaxed) + bytes > limit_)
            throw MemoryError(
                fmt::format("the surface needs more than the {} of memory allowed; choose a smaller resolution",
                            bytes_text(limit_)));
    }
    void give_back(std::uint64_t bytes) { used_.fetch_sub(bytes, std::memory_order_relaxed); }

    /// Refuses what is known to be too much beforehand.
    /// \param cells  expected of the lattice's cells that the surface runs through, at a resolution
    void check_expected(double cells, double resolution) const {
        const double bytes = cells * bytes_per_cell;
        if (bytes <= double(limit_)) return;
        const double fits = std::floor(resolution * std::sqrt(double(limit_) / bytes));
        throw MemoryError(
            fmt::format("a surface of resolution {} needs about {} of memory, more than the {} allowed; {}",
                        resolution, bytes_text(std::uint64_t(std::min(bytes, 1e18))), bytes_text(limit_),
                        fits >= 1 ? fmt::format("the largest resolution that fits is about {}", fits)
                                  : std::string("raise the limit")));
    }

    /// At the peak: cells collected for a range of levels, twice while they are joined (80 bytes each);
    /// crossing, first vertex and index (28); a vertex and two triangles, twice while they are joined (24 +
    /// 2·2·12).
    static constexpr double bytes_per_cell = 2 * 1.75 * 80 + 28 + 72;

private:
    std::uint64_t limit_;
    std::atomic<std::uint64_t> used_ = 0;
};

/// Counted as long as this lives.
class Taken {
public:
    Taken(MemoryGuard& guard, std::uint64_t bytes) : guard_(guard) { add(bytes); }
    ~Taken() { guard_.give_back(bytes_); }
    Taken(const Taken&) = delete;
    Taken& operator=(const Taken&) = delete;

    /// From any thread. \throws MemoryError
    void add(std::uint64_t bytes) {
        bytes_.fetch_add(bytes, std::memory_order_relaxed);
        guard_.take(bytes);
    }
    std::uint64_t bytes() const { return bytes_.load(std::memory_order_relaxed); }

private:
    MemoryGuard& guard_;
    std::atomic<std::uint64_t> bytes_ = 0;
};

}  // namespace its::surface
