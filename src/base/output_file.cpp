#include "base/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>

namespace its {
namespace {

namespace fs = std::filesystem;

/// Where the bytes shall end up: `path`, or what it points to.
fs::path resolve(const fs::path& path) {
    std::error_code error;
    if (!fs::is_symlink(path, error)) return path;
    const fs::path target = fs::weakly_canonical(path, error);
    return error ? path : target;
}

}  // namespace

void OutputFile::fail(const char* what) const {
    throw FileError(fmt::format("{}: {}: {}", path_.string(), what, std::strerror(errno)));
}

OutputFile::OutputFile(const fs::path& path) : path_(resolve(path)) {
    std::error_code error;
    const fs::file_status status = fs::status(path_, error);
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        throw FileError(fmt::format("{}: {}; name a regular file to write", path.string(),
                                    fs::is_directory(status) ? "is a folder" : "is not a regular file"));
    }
    if (path_.filename().empty()) throw FileError("the name of the file to write is empty");
    static std::atomic<std::uint64_t> counter = 0;
    // O_EXCL makes the name ours; the process id and the counter only make a second attempt rare.
    constexpr int attempts = 100;
    for (int i = 0; i < attempts && descriptor_ < 0; ++i) {
        temporary_ = path_.parent_path() / fmt::format(".{}-{}.tmp", ::getpid(), counter++);
        descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor_ < 0 && errno != EEXIST) break;
    }
    if (descriptor_ < 0) fail("cannot create a file in that folder");
    struct stat old {};
    if (::stat(path_.c_str(), &old) == 0) (void)!::fchmod(descriptor_, old.st_mode & 0777);
}

OutputFile::~OutputFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void OutputFile::write(std::span<const std::byte> bytes) {
    // Linux writes at most 2³¹ − 4096 bytes a call; whatever a call leaves is written by the next.
    constexpr std::size_t largest_call = std::size_t{1} << 30;
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor_, bytes.data(), std::min(bytes.size(), largest_call));
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail("cannot write");
        bytes = bytes.subspan(std::size_t(written));
    }
}

void OutputFile::commit() {
    if (::fsync(descriptor_) != 0) fail("cannot write");
    const int descriptor = descriptor_;
    descriptor_ = -1;
    if (::close(descriptor) != 0) fail("cannot write");
    if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot replace");
    temporary_.clear();
    // The name itself reaches the disk with the folder; file systems that cannot do that are still complete.
    const fs::path parent = path_.parent_path();
    const int folder = ::open(parent.empty() ? "." : parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder >= 0) {
        (void)!::fsync(folder);
        ::close(folder);
    }
}

}  // namespace its
