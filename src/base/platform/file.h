#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>

/// Files as the operating system has them. What fails throws std::system_error with the system's reason.
/// `plain` is what standard C++ offers and exists everywhere; `posix` replaces it where there is POSIX, for
/// what else that has: maps of files, locks, and data that is known to be on the disk.
namespace its::platform {

namespace plain {

/// An open regular file.
class InputHandle {
public:
    /// \throws std::system_error; std::errc::not_supported for what is no regular file
    explicit InputHandle(const std::filesystem::path& path);

    std::uint64_t size() const { return size_; }
    /// Reads on from where the last call stopped. \return the number of bytes, 0 at the end of the file
    std::size_t read(std::span<std::byte> target) const;
    /// Memory that shows the whole file; null where that cannot be had.
    std::shared_ptr<const void> map() const { return nullptr; }

private:
    std::shared_ptr<std::FILE> file_;
    std::uint64_t size_ = 0;
};

/// A new file that is written from start to end.
class OutputHandle {
public:
    /// \throws std::system_error; std::errc::file_exists if there is such a file
    explicit OutputHandle(const std::filesystem::path& path);

    void write(std::span<const std::byte> bytes);
    /// All that was written is on the disk, as far as the system lets a program know.
    void flush();
    /// Renames the file, which is called `from`, and closes it; replaces what is called `to`. Until then it
    /// counts as one that has a writer.
    void move(const std::filesystem::path& from, const std::filesystem::path& to);

private:
    std::shared_ptr<std::FILE> file_;
};

/// The names in a folder are on the disk, as far as the system lets a program know.
inline void flush_folder(const std::filesystem::path&) {}

/// Whether a file that an OutputHandle made has lost its writer: the process ended without closing it. False
/// where that cannot be known.
inline bool is_abandoned(const std::filesystem::path&) {
    return false;
}

/// Removes a file that is abandoned, and no other that has got its name meanwhile.
inline void remove_abandoned(const std::filesystem::path&) {}

/// While this lives an existing file counts as one that has a writer.
class FileLock {
public:
    explicit FileLock(const std::filesystem::path&) {}
};

/// A number that no other process of this machine has at the same time, or at least seldom.
std::uint64_t process_number();

}  // namespace plain

#if __has_include(<unistd.h>) && !defined(ITS_PLAIN)

namespace posix {

/// A file descriptor, closed at the end.
class Descriptor {
public:
    explicit Descriptor(int number) : number_(number) {}
    ~Descriptor();
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    int get() const { return number_; }

private:
    int number_;
};

class InputHandle {
public:
    explicit InputHandle(const std::filesystem::path& path);

    std::uint64_t size() const { return size_; }
    std::size_t read(std::span<std::byte> target) const;
    std::shared_ptr<const void> map() const;

private:
    Descriptor descriptor_;
    std::uint64_t size_ = 0;
};

/// Holds a lock on the file until it is closed, also by the end of the process.
class OutputHandle {
public:
    explicit OutputHandle(const std::filesystem::path& path);

    void write(std::span<const std::byte> bytes);
    void flush();
    void move(const std::filesystem::path& from, const std::filesystem::path& to);

private:
    Descriptor descriptor_;
};

void flush_folder(const std::filesystem::path& folder);
bool is_abandoned(const std::filesystem::path& path);
void remove_abandoned(const std::filesystem::path& path);

class FileLock {
public:
    explicit FileLock(const std::filesystem::path& path);

private:
    Descriptor descriptor_;
};

std::uint64_t process_number();

}  // namespace posix

using namespace posix;

#else

using namespace plain;

#endif

}  // namespace its::platform
