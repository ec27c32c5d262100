#pragma once

#include <filesystem>

#include "common.h"
#include "its/mesh_file.h"

/// The option --up AXIS of commands that write meshes, and what else is said of GLB files.
namespace its::cli {

class UpOption {
public:
    void declare(CLI::App& app);
    /// Refuses an output that has no place for it, before any long work.
    /// \throws OptionError
    void check(const std::filesystem::path& output) const;
    /// How a mesh is written there whose coordinates are 32-bit numbers about this origin, if .glb has them.
    /// Warns of a file that others may read less exactly.
    WriteOptions writing(const std::filesystem::path& output, const Vec3& origin) const;

private:
    UpAxis up_ = UpAxis::unknown;
};

}  // namespace its::cli
