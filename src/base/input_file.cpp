#include "base/input_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <new>
#include <optional>
#include <string>
#include <system_error>

#include "base/file_error.h"
#include "base/platform/file.h"
#include "base/quote.h"
#include "its/memory.h"

namespace its {

namespace {

/// An open regular file, and the errors that name it.
class InputFile {
public:
    explicit InputFile(const std::filesystem::path& path)
        : name_(shown(path)), handle_(naming_file(path, "cannot open", [&] { return open(path); })) {}

    FileBytes map() const {
        const std::shared_ptr<const void> place = handle_.map();
        if (!place) return copy();
        return {{static_cast<const std::byte*>(place.get()), std::size_t(handle_.size())}, place};
    }

    FileBytes copy() const {
        const std::uint64_t size = handle_.size();
        // A sparse file may claim, and have, any size; what is read takes as much memory as the file has bytes.
        if (const std::optional<std::uint64_t> available = available_memory(); available && size > *available)
            throw MemoryError(fmt::format("{}: needs {} of memory, and {} are free", name_, bytes_text(size),
                                          bytes_text(*available)));
        try {
            // Arrays of a file begin at multiples of 64, so that they are aligned in memory too.
            constexpr std::align_val_t alignment{64};
            const std::shared_ptr<std::byte> memory(
                static_cast<std::byte*>(::operator new(std::max<std::size_t>(size, 1), alignment)),
                [](std::byte* bytes) { ::operator delete(bytes, alignment); });
            read({memory.get(), std::size_t(size)});
            return {{memory.get(), std::size_t(size)}, memory};
        } catch (const std::bad_alloc&) {
            throw MemoryError(
                fmt::format("{}: needs {} of memory, more than is free", name_, bytes_text(size)));
        }
    }

private:
    static platform::InputHandle open(const std::filesystem::path& path) {
        try {
            return platform::InputHandle(path);
        } catch (const std::system_error& error) {
            if (error.code() != std::errc::not_supported) throw;
            throw FileError(shown(path) + ": is not a regular file");
        }
    }

    void read(std::span<std::byte> target) const {
        while (!target.empty()) {
            const std::size_t got = naming_file(name_, "cannot read", [&] { return handle_.read(target); });
            if (got == 0) throw FileError(name_ + ": became shorter while it was read");
            target = target.subspan(got);
        }
    }

    std::string name_;
    platform::InputHandle handle_;
};

}  // namespace

FileBytes read_bytes(const std::filesystem::path& path) {
    return InputFile(path).copy();
}

FileBytes map_bytes(const std::filesystem::path& path) {
    return InputFile(path).map();
}

}  // namespace its
