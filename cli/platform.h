#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

/// What the operating system gives a command line beyond the standard. Where there is no POSIX: no bar, no
/// question about permissions (writing fails later), signals as standard C++ has them, and no other programs.
namespace its::cli::platform {

/// Whether standard error is a terminal.
bool errors_go_to_a_terminal();

/// False only if files can surely not be made in this folder.
bool may_write_into(const std::filesystem::path& folder);

/// Calls `handler` with the number of the first SIGINT or SIGTERM, which then interrupts no call of the system;
/// the next one of its kind ends the process.
void handle_first_interruption(void (*handler)(int));

/// The file of the running program; empty where that cannot be known.
std::filesystem::path this_program();

/// A program that ran to its end, or was ended.
struct Ended {
    enum { exited, killed, out_of_time, stopped } how = exited;
    int code = 0;  ///< exit status, or the signal that killed it
    double seconds = 0;
    std::uint64_t peak_bytes = 0;  ///< resident; 0: not known
    std::string out, error;        ///< what it printed
};

/// Runs a program, words[0], whose children end with it, and which ends with this process, however that ends.
/// An interruption from the terminal does not reach it.
/// \param seconds  after which it is killed; 0: never
/// \param stop     asked now and then: whether to kill it
/// \throws Error where programs cannot be run
Ended run_program(const std::vector<std::string>& words, double seconds, const std::function<bool()>& stop);

/// Holds a file, which is made if need be, for this process alone. Released at its end, however that comes.
class FileHold {
public:
    /// \throws FileError if it cannot be opened
    explicit FileHold(const std::filesystem::path& path);
    /// False if another process has it.
    bool held() const { return held_; }

private:
    std::shared_ptr<void> file_;
    bool held_ = true;
};

}  // namespace its::cli::platform
