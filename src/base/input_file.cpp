#include "base/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <new>

#include "base/memory.h"

namespace its {

namespace {

/// An open regular file.
class Descriptor {
public:
    explicit Descriptor(const std::filesystem::path& path) : name_(path.string()) {
        descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe must not block us
        if (descriptor_ < 0) fail("cannot open");
        struct stat status {};
        const bool known = ::fstat(descriptor_, &status) == 0;
        const int error = errno;
        if (known && S_ISREG(status.st_mode)) {
            size_ = static_cast<std::size_t>(status.st_size);
            return;
        }
        ::close(descriptor_);
        if (known) throw FileError(name_ + ": is not a regular file");
        errno = error;
        fail("cannot open");
    }
    ~Descriptor() { ::close(descriptor_); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    int get() const { return descriptor_; }
    std::size_t size() const { return size_; }

    void read(std::span<std::byte> target) const {
        constexpr std::size_t largest_call = std::size_t{1} << 30;  // Linux reads less than 2³¹ bytes a call
        while (!target.empty()) {
            const ssize_t got = ::read(descriptor_, target.data(), std::min(target.size(), largest_call));
            if (got < 0 && errno == EINTR) continue;
            if (got < 0) fail("cannot read");
            if (got == 0) throw FileError(name_ + ": became shorter while it was read");
            target = target.subspan(static_cast<std::size_t>(got));
        }
    }

    FileBytes copy() const {
        // A sparse file may claim, and have, any size; what is read takes as much memory as the file has bytes.
        const std::uint64_t available = available_memory();
        if (available > 0 && size_ > available)
            throw MemoryError(fmt::format("{}: needs {} of memory, and {} are free", name_, bytes_text(size_),
                                          bytes_text(available)));
        try {
            // Arrays of a file begin at multiples of 64, so that they are aligned in memory too.
            constexpr std::align_val_t alignment{64};
            const std::shared_ptr<std::byte> memory(
                static_cast<std::byte*>(::operator new(std::max<std::size_t>(size_, 1), alignment)),
                [](std::byte* bytes) { ::operator delete(bytes, alignment); });
            read({memory.get(), size_});
            return {{memory.get(), size_}, memory};
        } catch (const std::bad_alloc&) {
            throw MemoryError(
                fmt::format("{}: needs {} of memory, more than is free", name_, bytes_text(size_)));
        }
    }

private:
    [[noreturn]] void fail(const char* what) const {
        throw FileError(fmt::format("{}: {}: {}", name_, what, std::strerror(errno)));
    }

    std::string name_;
    int descriptor_ = -1;
    std::size_t size_ = 0;
};

}  // namespace

FileBytes read_bytes(const std::filesystem::path& path) {
    return Descriptor(path).copy();
}

FileBytes map_bytes(const std::filesystem::path& path) {
    const Descriptor file(path);
    const std::size_t size = file.size();
    void* const place = size == 0 ? MAP_FAILED : ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file.get(), 0);
    if (place == MAP_FAILED) return file.copy();
    const std::shared_ptr<const void> owner(place, [size](void* mapped) { ::munmap(mapped, size); });
    return {{static_cast<const std::byte*>(place), size}, owner};
}

}  // namespace its
