#pragma once

#include <filesystem>
#include <string>
#include <string_view>

/// What comes from outside, as messages show it: no line of the library has 300 characters.
namespace its {

/// Text as it may stand in a message: one line, without control characters, and no longer than `most` bytes.
std::string quotable(std::string_view text, std::size_t most = 80);
/// Likewise, with the end kept: that of a path says more than its beginning.
std::string quotable_end(std::string_view text, std::size_t most);

/// A file's name in a message: all of it, or the end where it is longer than this.
inline constexpr std::size_t longest_name = 100;
std::string shown(const std::filesystem::path& path);

}  // namespace its
