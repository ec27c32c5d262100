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
///
/// A temporary file is locked until it has its name. What a killed writer has left behind is known by its lock,
/// which is free: the next writer of the same path removes it. Where there are no locks nothing is removed.
class ITS_API OutputFile {
public:
    /// Creates the temporary file, in the same folder, with a name that no other file has. A symbolic link is
    /// followed, so that the file it points to is replaced.
    /// \throws FileError, also if `path` exists and is not a regular file: renaming over a device or a folder
    ///         would destroy it.
    explicit OutputFile(const std::filesystem::path& path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// Appends bytes.
    /// \throws FileError, such as when the disk is full.
    void write(std::span<const std::byte> bytes);

    /// Flushes everything to the disk and renames. Nothing may be written afterwards.
    /// \throws FileError.
    void commit();

    /// Flushes all files to the disk before the first is renamed. Where a later one cannot be renamed, those
    /// before get their old contents back, or are removed if they are new.
    /// \throws FileError.
    static void commit_all(std::span<OutputFile* const> files);

private:
    void create_temporary();
    void keep_old();
    void rename();
    bool restore_old();
    void forget_old();

    std::filesystem::path path_, temporary_;
    std::filesystem::path old_;  ///< where the old file is, while it may have to come back
    bool replaced_ = false;      ///< `path_` is not the old file any more
    std::optional<platform::OutputHandle> handle_;
    std::optional<platform::FileLock> old_lock_;
};

}  // namespace its
