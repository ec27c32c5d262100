#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "its/shell_file.h"
#include "shell/shell_data.h"

/// The .its format in memory; docs/design/file-format.md has the layout.
namespace its::shell_file {

/// The bytes of the .its file of a shell.
std::vector<std::byte> encode(const shell::ShellData& shell);

/// The shell in the bytes of an .its file.
/// \param name  how errors call it.
/// \throws InputError if they are not a complete and valid .its file.
shell::ShellData decode(std::span<const std::byte> bytes, const std::string& name = "shell",
                        LoadCheck check = LoadCheck::full);

/// Recomputes the checksums of a file whose content was changed, as far as its section table can be followed.
/// For tests and fuzzing, which must get past the checksums to reach the checks behind them.
void mend_checksums(std::span<std::byte> bytes);

}  // namespace its::shell_file
