#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace its {

/// Bytes of memory that can be taken now without swapping, within all limits that are set for the process;
/// nothing if none is known.
std::optional<std::uint64_t> available_memory();

/// Bytes that a call may take: those that its options allow, or, if that is 0, three quarters of what is
/// available.
std::uint64_t memory_limit(std::uint64_t allowed);

/// \throws MemoryError "WHAT needs about … of memory, more than the … allowed; ADVICE" if `bytes` exceeds
/// memory_limit(allowed)
void require_memory(std::uint64_t bytes, std::uint64_t allowed, const std::string& what,
                    const std::string& advice);

/// "1.5 GB": decimal units, two significant digits at least.
std::string bytes_text(std::uint64_t bytes);

}  // namespace its
