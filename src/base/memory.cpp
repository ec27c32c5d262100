#include "base/memory.h"

#include <fmt/format.h>
#include <algorithm>
#include <fstream>
#include <limits>

namespace its {

namespace {

constexpr std::uint64_t unknown = std::numeric_limits<std::uint64_t>::max();

std::uint64_t number_in(const char* path) {
    std::ifstream file(path);
    std::uint64_t value = 0;
    return file >> value ? value : unknown;  // "max" is no number: no limit
}

std::uint64_t system_available() {
    std::ifstream file("/proc/meminfo");
    std::string key, unit;
    std::uint64_t kilobytes = 0;
    while (file >> key >> kilobytes) {
        if (key == "MemAvailable:") return kilobytes * 1024;
        std::getline(file, unit);
    }
    return unknown;
}

std::uint64_t group_available() {
    const std::uint64_t limit = number_in("/sys/fs/cgroup/memory.max");
    const std::uint64_t used = number_in("/sys/fs/cgroup/memory.current");
    if (limit == unknown || used == unknown) return unknown;
    return limit > used ? limit - used : 0;
}

}  // namespace

std::uint64_t available_memory() {
    const std::uint64_t available = std::min(system_available(), group_available());
    return available == unknown ? 0 : available;
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
