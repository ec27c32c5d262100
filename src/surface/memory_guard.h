#pragma once

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "its/base.h"
#include "its/memory.h"

/// Memory of an extraction, counted before it is taken.
namespace its::surface {

class MemoryGuard {
public:
    /// \param limit  bytes, or 0 for three quarters of what is free
    explicit MemoryGuard(std::uint64_t limit, std::string advice = "choose a smaller resolution")
        : limit_(memory_limit(limit)), advice_(std::move(advice)) {}

    /// Counts bytes that are about to be taken, from any thread.
    /// \throws MemoryError
    void take(std::uint64_t bytes) {
        if (used_.fetch_add(bytes, std::memory_order_relaxed) + bytes > limit_)
            throw MemoryError(fmt::format("the surface needs more than the {} of memory allowed; {}",
                                          bytes_text(limit_), advice_));
    }
    void give_back(std::uint64_t bytes) { used_.fetch_sub(bytes, std::memory_order_relaxed); }

    /// Refuses what is known to be too much beforehand.
    /// \param bytes  expected at the peak, for a surface of this resolution
    void check_expected(double bytes, double resolution) const {
        if (bytes <= double(limit_)) return;
        const double fits = std::floor(resolution * std::sqrt(double(limit_) / bytes));
        throw MemoryError(
            fmt::format("a surface of resolution {} needs about {} of memory, more than the {} allowed; {}",
                        resolution, bytes_text(std::uint64_t(std::min(bytes, 1e18))), bytes_text(limit_),
                        fits >= 1 ? fmt::format("the largest resolution that fits is about {}", fits)
                                  : std::string("raise the limit")));
    }

private:
    std::uint64_t limit_;
    std::string advice_;
    std::atomic<std::uint64_t> used_ = 0;
};

/// Counted as long as this lives.
class Taken {
public:
    Taken(MemoryGuard& guard, std::uint64_t bytes) : guard_(guard) { add(bytes); }
    ~Taken() { guard_.give_back(bytes_); }
    Taken(const Taken&) = delete;
    Taken& operator=(const Taken&) = delete;

    /// From any thread.
    /// \throws MemoryError
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
