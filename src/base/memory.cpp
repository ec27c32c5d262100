#include "its/memory.h"

#include <fmt/format.h>
#include <limits>

#include "base/platform/memory.h"
#include "its/base.h"

namespace its {

std::optional<std::uint64_t> available_memory() {
    return platform::available_memory();
}

std::uint64_t memory_limit(std::uint64_t allowed) {
    if (allowed > 0) return allowed;
    const std::optional<std::uint64_t> available = available_memory();
    return available ? *available / 4 * 3 : std::numeric_limits<std::uint64_t>::max();
}

void require_memory(std::uint64_t bytes, std::uint64_t allowed, const std::string& what,
                    const std::string& advice) {
    const std::uint64_t limit = memory_limit(allowed);
    if (bytes > limit)
        throw MemoryError(fmt::format("{} needs about {} of memory, more than the {} allowed; {}", what,
                                      bytes_text(bytes), bytes_text(limit), advice));
}

std::string bytes_text(std::uint64_t bytes) {
    static constexpr const char* units[] = {"B", "kB", "MB", "GB", "TB", "PB", "EB"};
    double value = double(bytes);
    int unit = 0;
    for (; value >= 999.5 && unit < 6; ++unit) value /= 1000;
    return value < 9.95 && unit > 0 ? fmt::format("{:.1f} {}", value, units[unit])
                                    : fmt::format("{:.0f} {}", value, units[unit]);
}

}  // namespace its
