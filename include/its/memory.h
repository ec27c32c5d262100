#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "its/export.h"

/// How much memory may be taken.
namespace ITS_API its {

/// Bytes of memory that can be taken now without swapping, within all limits that are set for the process (the
/// system, control groups, ulimit); nothing if none is known.
std::optional<std::uint64_t> available_memory();

/// Bytes that a call may take beside its input: those that its options allow, or, if that is 0, three quarters
/// of what is available.
std::uint64_t memory_limit(std::uint64_t allowed);

/// Refuses what takes more than memory_limit(allowed).
/// \throws MemoryError "WHAT needs about 2 GB of memory, more than the 1.5 GB allowed; ADVICE"
void require_memory(std::uint64_t bytes, std::uint64_t allowed, const std::string& what,
                    const std::string& advice);

/// "1.5 GB": decimal units, two significant digits at least.
std::string bytes_text(std::uint64_t bytes);

}  // namespace its
