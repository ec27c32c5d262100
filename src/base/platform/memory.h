#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace its::platform {

/// Bytes of memory that this process can still take without swapping: the least of what the system has, what
/// its control groups leave (Linux, version 1 or 2: its own and all above it) and what its own limits leave
/// (`ulimit`). Memory that only caches files counts as free. Nothing where none of these is known.
/// \param root  the folder whose proc and sys are read, for tests
std::optional<std::uint64_t> available_memory(const std::filesystem::path& root = "/");

}  // namespace its::platform
