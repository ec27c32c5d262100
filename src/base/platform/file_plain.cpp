#include <cerrno>
#include <chrono>
#include <string>
#include <system_error>

#include "base/platform/file.h"

namespace its::platform::plain {

namespace fs = std::filesystem;

namespace {

/// The C library need not say why a call failed.
[[noreturn]] void fail() {
    throw std::system_error(errno != 0 ? errno : EIO, std::generic_category());
}

std::shared_ptr<std::FILE> open(const fs::path& path, const char* mode) {
    errno = 0;
    std::FILE* const file = std::fopen(path.string().c_str(), mode);
    if (file == nullptr) fail();
    return {file, [](std::FILE* f) { std::fclose(f); }};
}

}  // namespace

InputHandle::InputHandle(const fs::path& path) {
    // Opening a pipe would wait for its other end.
    const fs::file_status status = fs::status(path);
    if (fs::exists(status) && !fs::is_regular_file(status))
        throw std::system_error(std::make_error_code(std::errc::not_supported));
    file_ = open(path, "rb");
    size_ = fs::file_size(path);
}

std::size_t InputHandle::read(std::span<std::byte> target) const {
    errno = 0;
    const std::size_t got = std::fread(target.data(), 1, target.size(), file_.get());
    if (got < target.size() && std::ferror(file_.get()) != 0) fail();
    return got;
}

OutputHandle::OutputHandle(const fs::path& path) : file_(open(path, "wbx")) {}

void OutputHandle::write(std::span<const std::byte> bytes) {
    errno = 0;
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) fail();
}

void OutputHandle::flush() {
    errno = 0;
    if (std::fflush(file_.get()) != 0) fail();
}

void OutputHandle::move(const fs::path& from, const fs::path& to) {
    flush();
    file_.reset();  // there are systems that cannot rename open files
    fs::rename(from, to);
}

std::uint64_t process_number() {
    static const auto number =
        std::uint64_t(std::chrono::steady_clock::now().time_since_epoch().count() & 0x7fffffff);
    return number;
}

}  // namespace its::platform::plain
