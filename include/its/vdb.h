#pragma once

#include <filesystem>

#include "its/shell.h"

/// Export for OpenVDB. In the library its::vdb, which is there where OpenVDB is.
namespace ITS_API its {

struct VdbOptions {
    double half_width = 3;  ///< of the band of active voxels, in finest cells of f; 1 to 64
    Run run = {};
};

/// Writes f as one float grid "f" to a .vdb file, under a temporary name that is then renamed. Voxels are the
/// points of the finest lattice, values in mesh units; all with |f| < half_width cells are active, the others
/// have ± that as background. Class "level set" where f has an inside; else all values are positive. Metadata
/// has epsilon_inner, epsilon_outer, depth and sign.
/// \throws InputError (cells too narrow for OpenVDB, below 1.5e-5, or values beyond 32-bit numbers),
/// OptionError, FileError, Cancelled.
void write_vdb(const ThinShell& shell, const std::filesystem::path& path, const VdbOptions& options = {});

}  // namespace its
