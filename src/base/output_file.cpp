#include "base/output_file.h"

#include <fmt/format.h>

#include <string>
#include <system_error>

#include "base/file_error.h"
#include "base/quote.h"

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

/// Names of temporary files are tried in order, so that stale ones are found without a look at the folder.
constexpr int names = 1000, names_looked_at = 16;

/// Of the path's own name no more than fits with what is added to it.
fs::path temporary_name(const fs::path& path, int i) {
    constexpr std::size_t longest = 200;  // bytes, of the 255 that file systems allow
    std::string name = path.filename().string();
    if (name.size() > longest) {
        std::size_t end = longest;
        while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0u) == 0x80) --end;  // a character whole
        name.resize(end);
    }
    return path.parent_path() / fmt::format(".{}.its-{}.tmp", name, i);
}

}  // namespace

OutputFile::OutputFile(const fs::path& path) : path_(resolve(path)) {
    std::error_code error;
    const fs::file_status status = fs::status(path_, error);
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        throw FileError(fmt::format("{}: {}; name a regular file to write", shown(path),
                                    fs::is_directory(status) ? "is a folder" : "is not a regular file"));
    }
    if (path_.filename().empty()) throw FileError("the name of the file to write is empty");
    naming_file(path_, "cannot create a file in that folder", [&] { create_temporary(); });
    if (fs::exists(status)) fs::permissions(temporary_, status.permissions() & fs::perms(0777), error);
}

void OutputFile::create_temporary() {
    for (int i = 0; i < names_looked_at; ++i) platform::remove_abandoned(temporary_name(path_, i));
    for (int i = 0;; ++i) {
        const fs::path name = temporary_name(path_, i);
        try {
            handle_.emplace(name);
            temporary_ = name;
            return;
        } catch (const std::system_error& error) {
            if (error.code() != std::errc::file_exists || i == names) throw;
        }
    }
}

OutputFile::~OutputFile() {
    restore_old();
    if (temporary_.empty()) return;
    std::error_code error;
    fs::remove(temporary_, error);  // before the lock goes with the handle
    if (!error) return;
    handle_.reset();  // there are systems that cannot remove open files
    fs::remove(temporary_, error);
}

void OutputFile::write(std::span<const std::byte> bytes) {
    naming_file(path_, "cannot write", [&] { handle_->write(bytes); });
}

/// Gives the file at `path_`, if there is one, a second name; or another name, where there are no hard links.
void OutputFile::keep_old() {
    std::error_code error;
    if (!fs::is_regular_file(fs::symlink_status(path_, error))) return;  // nothing that rename() replaces
    for (int i = 0; i < names && old_.empty(); ++i) {
        const fs::path name = temporary_name(path_, i);
        fs::create_hard_link(path_, name, error);
        if (!error) {
            old_ = name;
        } else if (error != std::errc::file_exists && !fs::exists(fs::symlink_status(name))) {
            fs::rename(path_, name);
            old_ = name;
            replaced_ = true;
        }
    }
    if (old_.empty()) throw std::system_error(std::make_error_code(std::errc::file_exists));
    old_lock_.emplace(old_);  // else a writer of the same path would take it for abandoned
}

void OutputFile::rename() {
    handle_->move(temporary_, path_);
    temporary_.clear();
    replaced_ = true;
}

/// Undoes keep_old() and rename(); false if that fails.
bool OutputFile::restore_old() {
    std::error_code error;
    if (replaced_ && old_.empty()) fs::remove(path_, error);
    if (replaced_ && !old_.empty()) fs::rename(old_, path_, error);
    if (!replaced_ && !old_.empty()) fs::remove(old_, error);
    replaced_ = false;
    old_.clear();  // where it could not be restored its file stays: it is all that is left of it
    old_lock_.reset();
    return !error;
}

void OutputFile::forget_old() {
    std::error_code ignored;
    if (!old_.empty()) fs::remove(old_, ignored);
    old_.clear();
    old_lock_.reset();
    replaced_ = false;
}

void OutputFile::commit() {
    OutputFile* const self = this;
    commit_all({&self, 1});
}

void OutputFile::commit_all(std::span<OutputFile* const> files) {
    for (OutputFile* file : files) naming_file(file->path_, "cannot write", [&] { file->handle_->flush(); });
    try {
        if (files.size() > 1)
            for (OutputFile* file : files)
                naming_file(file->path_, "cannot keep the old file while others are replaced",
                            [&] { file->keep_old(); });
        for (OutputFile* file : files) naming_file(file->path_, "cannot replace", [&] { file->rename(); });
    } catch (const FileError& error) {
        std::string what = error.what();
        for (OutputFile* file : files) {
            const std::string old = shown(file->old_);
            if (!file->restore_old())
                what += fmt::format("; {} cannot be put back{}", shown(file->path_),
                                    old.empty() ? "" : ": its old content is in " + old);
        }
        throw FileError(what);
    }
    for (OutputFile* file : files) {
        file->forget_old();
        file->handle_.reset();
        // The name itself reaches the disk with the folder; file systems that cannot do that are still
        // complete.
        const fs::path parent = file->path_.parent_path();
        platform::flush_folder(parent.empty() ? "." : parent);
    }
}

}  // namespace its
