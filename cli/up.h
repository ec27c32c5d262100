#pragma once

#include <filesystem>
#include <span>

#include "common.h"
#include "its/mesh_file.h"

/// The option --up AXIS of commands that write meshes, and what else is said of GLB files.
namespace its::cli {

class UpOption {
public:
    void declare(CLI::App& app);
    /// Refuses an output that has no place for it, before any long work. \throws OptionError
    void check(const std::filesystem::path& output) const;
    /// How these meshes are written there. Warns of a GLB file that others may read less exactly.
    WriteOptions writing(const std::filesystem::path& output, std::span<const MeshView> meshes) const;

private:
    UpAxis up_ = UpAxis::unknown;
};

}  // namespace its::cli
