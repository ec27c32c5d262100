#include "base/platform/memory.h"

#include <algorithm>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace its::platform {

namespace {

namespace fs = std::filesystem;
using Bytes = std::optional<std::uint64_t>;  ///< nothing: unknown, or without limit

void take_least(Bytes& least, const Bytes& other) {
    if (other) least = least ? std::min(*least, *other) : *other;
}

/// What a limit leaves; nothing without limit. What is used and unknown counts as none.
Bytes left_of(const Bytes& limit, const Bytes& used) {
    if (!limit) return {};
    return *limit > used.value_or(0) ? *limit - used.value_or(0) : 0;
}

/// The number that a file begins with: "max" is none.
Bytes number_in(const fs::path& path) {
    std::ifstream file(path);
    std::uint64_t value = 0;
    return file >> value ? Bytes(value) : Bytes();
}

/// The number behind `key` at the start of a line. A colon and spaces may stand between them.
Bytes number_after(const fs::path& path, std::string_view key) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        if (!line.starts_with(key)) continue;
        const std::size_t at = line.find_first_not_of(": \t", key.size());
        if (at == key.size() || at == std::string::npos) continue;  // a longer key
        std::uint64_t value = 0;
        return std::istringstream(line.substr(at)) >> value ? Bytes(value) : Bytes();
    }
    return {};
}

Bytes kilobytes_after(const fs::path& path, std::string_view key) {
    const Bytes value = number_after(path, key);
    return value ? Bytes(*value * 1024) : Bytes();
}

/// Names of one version of control groups.
struct Version {
    std::string_view type;                           ///< of its file system
    std::initializer_list<std::string_view> limits;  ///< files
    std::string_view used;                           ///< file
    std::initializer_list<std::string_view> cache;   ///< keys in memory.stat of what caches files
};
const Version version_1 = {
    "cgroup", {"memory.limit_in_bytes"}, "memory.usage_in_bytes", {"total_inactive_file", "total_active_file"}};
const Version version_2 = {"cgroup2",
                           {"memory.max", "memory.high"},
                           "memory.current",
                           {"inactive_file", "active_file", "slab_reclaimable"}};

Bytes left_in(const fs::path& group, const Version& version) {
    Bytes limit;
    for (const std::string_view name : version.limits) take_least(limit, number_in(group / name));
    Bytes used = number_in(group / version.used);
    for (const std::string_view key : version.cache)
        if (used) used = left_of(used, number_after(group / "memory.stat", key));
    return left_of(limit, used);
}

/// Where a hierarchy of control groups is mounted, and which of its groups lies there.
struct Mount {
    fs::path place, group;
};

/// Of the hierarchy with the memory controller. /proc/self/mountinfo has in each line: two numbers, the device,
/// the mounted folder of the file system, the place, options up to " - ", the type, a source and further
/// options.
std::optional<Mount> mount_of(const fs::path& root, const Version& version) {
    std::ifstream file(root / "proc/self/mountinfo");
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string skipped, group, place, type, source, options;
        words >> skipped >> skipped >> skipped >> group >> place;
        while (words >> skipped && skipped != "-") {
        }
        words >> type >> source >> options;
        const bool has_memory = (',' + options + ',').find(",memory,") != std::string::npos;
        if (type == version.type && (type == "cgroup2" || has_memory))
            return Mount{root / fs::path(place).relative_path(), group};
    }
    return {};
}

/// The process's own group: /proc/self/cgroup has lines "number:controllers:/path", of version 2 "0::/path".
std::optional<fs::path> own_group(const fs::path& root, const Version& version) {
    std::ifstream file(root / "proc/self/cgroup");
    for (std::string line; std::getline(file, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (first == std::string::npos || second == std::string::npos) continue;
        const std::string controllers = ',' + line.substr(first + 1, second - first - 1) + ',';
        const bool matches =
            version.type == "cgroup2" ? controllers == ",," : controllers.find(",memory,") != std::string::npos;
        if (matches) return line.substr(second + 1);
    }
    return {};
}

/// The least that the process's group and those above it leave, as far as they are mounted.
Bytes left_by_groups(const fs::path& root, const Version& version) {
    const std::optional<Mount> mount = mount_of(root, version);
    const std::optional<fs::path> own = own_group(root, version);
    if (!mount || !own) return {};
    const fs::path below = own->lexically_relative(mount->group);
    Bytes least = left_in(mount->place, version);
    fs::path group = mount->place;
    for (const fs::path& name : below) {
        if (name == ".." || name.empty()) break;  // a group that is not mounted here
        if (name == ".") continue;
        group /= name;
        take_least(least, left_in(group, version));
    }
    return least;
}

/// /proc/self/limits has lines "NAME  SOFT  HARD  bytes"; "unlimited" is no number.
Bytes left_by_process(const fs::path& root) {
    const fs::path self = root / "proc/self";
    Bytes least =
        left_of(number_after(self / "limits", "Max address space"), kilobytes_after(self / "status", "VmSize"));
    take_least(least, left_of(number_after(self / "limits", "Max data size"),
                              kilobytes_after(self / "status", "VmData")));
    return least;
}

}  // namespace

std::optional<std::uint64_t> available_memory(const fs::path& root) {
    Bytes least = kilobytes_after(root / "proc/meminfo", "MemAvailable");
    take_least(least, left_by_groups(root, version_1));
    take_least(least, left_by_groups(root, version_2));
    take_least(least, left_by_process(root));
    return least;
}

}  // namespace its::platform
