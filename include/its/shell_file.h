#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "its/shell.h"

/// The .its file: a built shell with everything that queries need.
namespace ITS_API its {

/// Writes the shell to a temporary name beside `path`, then renames it: an existing file is replaced only by a
/// complete one. The same shell gives the same bytes; docs/design/file-format.md specifies them. Reports no
/// progress.
/// \throws FileError, OptionError (run).
void save(const ThinShell& shell, const std::filesystem::path& path, const Run& run = {});

/// The bytes of that file, in memory of the caller.
/// \throws OptionError (run).
std::vector<std::byte> encode(const ThinShell& shell, const Run& run = {});

/// How much of a file is examined before load() returns. No file, damaged by accident or on purpose, makes any
/// function of the library read out of bounds or run for ever, whichever is chosen.
enum class LoadCheck : std::uint8_t {
    /// Every byte by checksums, every index, every number. Reads the whole file.
    full,
    /// Header, sizes, octree and mesh, likewise; not the values of f, the bounds of f on M, and the lists of
    /// triangles: most of the file, which is then read where a query needs it. Milliseconds for a gigabyte.
    /// Damage there goes unnoticed and gives wrong answers: for files that are known to be whole.
    quick,
};

struct LoadOptions {
    LoadCheck check = LoadCheck::full;
    /// Map the file instead of copying it into memory: processes share its pages. It may then be replaced by
    /// another (as save() does) but not be changed in place while a copy of the shell exists: a process that
    /// touches what is no longer there is killed by the system, and what was checked is no longer what is read.
    bool map = true;
    Run run = {};  ///< reports no progress
};

/// "full", "quick".
std::string_view name(LoadCheck check);
/// The check of that name; empty: there is none.
std::optional<LoadCheck> parse_load_check(std::string_view name);

/// Reads a shell, in any version of the format so far.
/// \throws FileError if it cannot be read; InputError if it is not a complete, valid .its file; MemoryError if
/// it is to be copied and larger than the free memory; OptionError (run).
ThinShell load(const std::filesystem::path& path, const LoadOptions& options = {});

/// The shell in the bytes of an .its file, which are copied; LoadOptions::map is not used.
/// \throws as load().
ThinShell decode(std::span<const std::byte> bytes, const LoadOptions& options = {});

}  // namespace its
