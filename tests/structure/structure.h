#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// Rules on which file may include which, checked on the text of the files.
namespace its::structure {

/// One line for each broken rule: "FILE:LINE: what is wrong and what is allowed". Empty: all is well.
using Violations = std::vector<std::string>;

/// src/: every quoted include is "module/file.h" or "its/file.h", exists, and points to the file's own module
/// or to one further down; verify shares nothing with the builder but its arrays and vector arithmetic.
Violations check_library(const std::filesystem::path& root);

/// Of the names as the compiler writes them (Itanium C++ ABI) in the verifier's object files, those of
/// functions and objects of the library that are neither the verifier's own nor of base, plain data or the
/// vectors' arithmetic: one line for each.
Violations check_verifier_symbols(const std::vector<std::string>& mangled);

/// include/its/: other public headers and the standard library only.
Violations check_public_headers(const std::filesystem::path& root);

/// cli/ and examples/: public headers, files of their own folder, and other people's libraries.
Violations check_users(const std::filesystem::path& root);

/// The version stands in include/its/version.h and in no other source, script or build file.
Violations check_version(const std::filesystem::path& root);

/// Nothing in src/ writes to the terminal or ends the process.
Violations check_silence(const std::filesystem::path& root);

/// What only POSIX or one compiler knows, and long double, whose width machines differ in, are named in
/// src/base/platform and cli/platform.cpp alone.
Violations check_platform(const std::filesystem::path& root);

/// No text in src/ speaks of the command line: of an option (two hyphens and a letter) or a command (`its …`).
Violations check_wording(const std::filesystem::path& root);

/// include/its/ and src/: no namespace has two types of one name, whatever their files (in anonymous
/// namespaces, not in one file), and private code is in its module's namespace.
Violations check_types(const std::filesystem::path& root);

}  // namespace its::structure
