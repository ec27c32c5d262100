#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>

#include "base/platform/file.h"
#include "its/base.h"

/// Files that appear complete or not at all.
namespace its {

/// A file written beside its final place under a temporary name; commit() renames it into place. Destroyed
/// without commit(), it removes the temporary file and leaves an existing `path` as it was.
class OutputFile {
public:
    /// Creates the temporary file, in the same folder, with a name that no other file has. A symbolic link is
    /// followed, so that the file it points to is replaced. \throws FileError, also if `path` exists and is
    /// not a regular file: renaming over a device or a folder would destroy it.
    explicit OutputFile(const std::filesystem::path& path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// Appends bytes. \throws FileError, such as when the disk is full.
    void write(std::span<const std::byte> bytes);

    /// Flushes everything to the disk and renames. Nothing may be written afterwards. \throws FileError.
    void commit();

private:
    void create_temporary();

    std::filesystem::path path_, temporary_;
    std::optional<platform::OutputHandle> handle_;
};

}  // namespace its
