#pragma once

#include <cstdint>
#include <string>

namespace its {

/// Bytes of memory that can be taken now without swapping, within the limits of the system and of the process's
/// control group; 0 if neither is known.
std::uint64_t available_memory();

/// "1.5 GB": decimal units, two significant digits at least.
std::string bytes_text(std::uint64_t bytes);

}  // namespace its
