#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "base/quote.h"
#include "its/base.h"

namespace its {

/// Runs a call of the operating system; its error becomes one that names the file and what was tried.
/// \throws FileError
template <class F>
auto naming_file(const std::filesystem::path& path, const char* what, F&& call) {
    try {
        return std::forward<F>(call)();
    } catch (const std::system_error& error) {
        throw FileError(fmt::format("{}: {}: {}", shown(path), what, error.code().message()));
    }
}

}  // namespace its
