#pragma once

#include <filesystem>

/// What the operating system gives a command line beyond the standard. Where there is no POSIX: no bar, no
/// question about permissions (writing fails later), and signals as standard C++ has them.
namespace its::cli::platform {

/// Whether standard error is a terminal.
bool errors_go_to_a_terminal();

/// False only if files can surely not be made in this folder.
bool may_write_into(const std::filesystem::path& folder);

/// Calls `handler` with the number of the first SIGINT or SIGTERM, which then interrupts no call of the system;
/// the next one of its kind ends the process.
void handle_first_interruption(void (*handler)(int));

}  // namespace its::cli::platform
