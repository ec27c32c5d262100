#include "base/platform/file.h"

#if __has_include(<unistd.h>) && !defined(ITS_PLAIN)

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace its::platform::posix {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t largest_call = std::size_t{1} << 30;  // Linux moves less than 2³¹ bytes a call

[[noreturn]] void fail() {
    throw std::system_error(errno, std::generic_category());
}

int open(const fs::path& path, int flags) {
    const int number = ::open(path.c_str(), flags | O_CLOEXEC, 0666);
    if (number < 0) fail();
    return number;
}

}  // namespace

Descriptor::~Descriptor() {
    if (number_ >= 0) ::close(number_);
}

InputHandle::InputHandle(const fs::path& path)
    : descriptor_(posix::open(path, O_RDONLY | O_NONBLOCK)) {  // a pipe must not block us
    struct stat status {};
    if (::fstat(descriptor_.get(), &status) != 0) fail();
    if (!S_ISREG(status.st_mode)) throw std::system_error(std::make_error_code(std::errc::not_supported));
    size_ = std::uint64_t(status.st_size);
}

std::size_t InputHandle::read(std::span<std::byte> target) const {
    for (;;) {
        const ssize_t got = ::read(descriptor_.get(), target.data(), std::min(target.size(), largest_call));
        if (got >= 0) return std::size_t(got);
        if (errno != EINTR) fail();
    }
}

std::shared_ptr<const void> InputHandle::map() const {
    if (size_ == 0) return nullptr;
    const std::size_t size = size_;
    void* const place = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor_.get(), 0);
    if (place == MAP_FAILED) return nullptr;
    return {place, [size](void* mapped) { ::munmap(mapped, size); }};
}

OutputHandle::OutputHandle(const fs::path& path) : descriptor_(posix::open(path, O_WRONLY | O_CREAT | O_EXCL)) {
    // Between these two calls another process may take the file for an abandoned one, and remove it.
    struct stat status {};
    const bool locked = ::flock(descriptor_.get(), LOCK_EX | LOCK_NB) == 0;
    if (!locked && errno == EWOULDBLOCK) throw std::system_error(std::make_error_code(std::errc::file_exists));
    if (locked && ::fstat(descriptor_.get(), &status) == 0 && status.st_nlink == 0)
        throw std::system_error(std::make_error_code(std::errc::file_exists));
}

void OutputHandle::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor_.get(), bytes.data(), std::min(bytes.size(), largest_call));
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail();
        bytes = bytes.subspan(std::size_t(written));
    }
}

void OutputHandle::flush() {
    if (::fsync(descriptor_.get()) != 0) fail();
}

void OutputHandle::move(const fs::path& from, const fs::path& to) {
    fs::rename(from, to);
}

void flush_folder(const fs::path& folder) {
    const Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (descriptor.get() >= 0) (void)!::fsync(descriptor.get());
}

bool is_abandoned(const fs::path& path) {
    const Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    return descriptor.get() >= 0 && ::flock(descriptor.get(), LOCK_EX | LOCK_NB) == 0;
}

/// While we hold the lock no writer takes the name: one that has just made the file and not yet locked it finds
/// it locked, or gone.
void remove_abandoned(const fs::path& path) {
    constexpr int flags = O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
    int number = ::open(path.c_str(), O_RDWR | flags);  // network file systems lock what may be written
    if (number < 0 && errno == EACCES) number = ::open(path.c_str(), O_RDONLY | flags);
    if (number < 0) return;
    const Descriptor descriptor(number);
    struct stat named {
    }, locked{};
    if (::fstat(number, &locked) == 0 && S_ISREG(locked.st_mode) && ::flock(number, LOCK_EX | LOCK_NB) == 0 &&
        ::lstat(path.c_str(), &named) == 0 && named.st_dev == locked.st_dev && named.st_ino == locked.st_ino)
        ::unlink(path.c_str());
}

FileLock::FileLock(const fs::path& path)
    : descriptor_(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC)) {
    if (descriptor_.get() >= 0) (void)::flock(descriptor_.get(), LOCK_EX | LOCK_NB);
}

std::uint64_t process_number() {
    return std::uint64_t(::getpid());
}

}  // namespace its::platform::posix

#endif
