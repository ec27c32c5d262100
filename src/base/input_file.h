#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include "its/base.h"

/// Files read as a whole.
namespace its {

/// The bytes of a file, as long as `owner` lives.
struct FileBytes {
    std::span<const std::byte> bytes;
    std::shared_ptr<const void> owner;
};

inline std::string_view text_of(const FileBytes& file) {
    return {reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()};
}

/// Copies a file into memory.
/// \throws FileError, also for what is no regular file, such as a pipe or a folder; MemoryError if it is larger
///         than the free memory.
FileBytes read_bytes(const std::filesystem::path& path);

/// Maps a file: its pages are read when they are first touched, and shared with other processes. Where the file
/// system cannot map, as read_bytes(). If another process shortens the file, touching what is gone kills this
/// one (SIGBUS): only for files that are replaced by renaming.
/// \throws as read_bytes()
FileBytes map_bytes(const std::filesystem::path& path);

}  // namespace its
