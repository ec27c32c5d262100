#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "platform.h"
#include "report.h"

namespace its::cli {

/// The manifest of a batch, for one process at a time: a line of JSON for each mesh that is over, in the order
/// in which they were; the last of a mesh counts.
class Manifest {
public:
    /// Opens the file, or makes it.
    /// \throws FileError if another process has it, or it is none
    explicit Manifest(const std::filesystem::path& path);

    /// The line of a mesh; null if it has none.
    const Json* find(const std::string& mesh) const;
    /// Writes the line of a mesh.
    /// \throws FileError
    void add(const std::string& mesh, Json line);

private:
    void read();

    std::filesystem::path path_;
    platform::FileHold hold_;
    std::ofstream file_;
    std::map<std::string, Json> lines_;
};

}  // namespace its::cli
