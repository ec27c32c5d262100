#include "base/output_file.h"

#include <fmt/format.h>

#include <atomic>
#include <cstdint>
#include <system_error>

#include "base/file_error.h"

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

OutputFile::OutputFile(const fs::path& path) : path_(resolve(path)) {
    std::error_code error;
    const fs::file_status status = fs::status(path_, error);
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        throw FileError(fmt::format("{}: {}; name a regular file to write", path.string(),
                                    fs::is_directory(status) ? "is a folder" : "is not a regular file"));
    }
    if (path_.filename().empty()) throw FileError("the name of the file to write is empty");
    naming_file(path_, "cannot create a file in that folder", [&] { create_temporary(); });
    if (fs::exists(status)) fs::permissions(temporary_, status.permissions() & fs::perms(0777), error);
}

void OutputFile::create_temporary() {
    static std::atomic<std::uint64_t> counter = 0;
    // Nobody else can make a file that exists; the numbers only make a second attempt rare.
    constexpr int attempts = 100;
    for (int i = 1;; ++i) {
        const fs::path name =
            path_.parent_path() / fmt::format(".{}-{}.tmp", platform::process_number(), counter++);
        try {
            handle_.emplace(name);
            temporary_ = name;
            return;
        } catch (const std::system_error& error) {
            if (error.code() != std::errc::file_exists || i == attempts) throw;
        }
    }
}

OutputFile::~OutputFile() {
    handle_.reset();
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove(temporary_, ignored);
}

void OutputFile::write(std::span<const std::byte> bytes) {
    naming_file(path_, "cannot write", [&] { handle_->write(bytes); });
}

void OutputFile::commit() {
    naming_file(path_, "cannot write", [&] { handle_->flush(); });
    naming_file(path_, "cannot replace", [&] { handle_->move(temporary_, path_); });
    handle_.reset();
    temporary_.clear();
    // The name itself reaches the disk with the folder; file systems that cannot do that are still complete.
    const fs::path parent = path_.parent_path();
    platform::flush_folder(parent.empty() ? "." : parent);
}

}  // namespace its
