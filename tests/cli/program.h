#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "its/mesh.h"

/// Runs the real program, as a user's shell would.
namespace its::cli_test {

struct Result {
    int status = 0;     ///< exit status; 128 + the signal's number when a signal ended it
    std::string out;    ///< standard output
    std::string error;  ///< standard error
};

/// A folder of its own for each test, gone after it.
class Workshop {
public:
    Workshop();
    ~Workshop();
    Workshop(const Workshop&) = delete;
    Workshop& operator=(const Workshop&) = delete;

    std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }
    std::string path(const std::string& name) const { return (folder_ / name).string(); }
    /// Writes a mesh and returns its path.
    std::string add(const std::string& name, const Mesh& mesh) const;
    /// Writes a file and returns its path.
    std::string add(const std::string& name, const std::string& content) const;
    /// Names of everything in the folder, sorted.
    std::vector<std::string> names() const;

private:
    std::filesystem::path folder_;
};

std::string content(const std::filesystem::path& file);

/// Runs `its` with both outputs going into pipes.
Result run(const std::vector<std::string>& arguments);

/// Whether `its` has this command: it may have been built without pictures or pages.
bool has_command(const std::string& command);

/// The same without the rights of root, which ignores permissions: as user 65534 if this is root.
Result run_without_privileges(const std::vector<std::string>& arguments);

/// Runs `its` on a terminal of its own; everything it prints is in `out`. Sends SIGINT as soon as something was
/// printed if `interrupt`.
Result run_on_terminal(const std::vector<std::string>& arguments, bool interrupt = false);

}  // namespace its::cli_test
