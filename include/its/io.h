#pragma once

#include <filesystem>

#include "its/shell.h"

/// The .its file: a built shell with everything that queries need.
namespace its {

/// Writes the shell to a temporary name beside `path`, then renames it: an existing file is replaced only by
/// a complete one. The same shell gives the same bytes. \throws FileError.
void save(const ThinShell& shell, const std::filesystem::path& path);

/// Reads a shell; checks magic, version, sizes and checksum, then every index and array in it.
/// \throws FileError if it cannot be read; InputError if it is not a complete, valid .its file; MemoryError if
/// it is larger than the free memory.
ThinShell load(const std::filesystem::path& path);

}  // namespace its
