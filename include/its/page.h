#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "its/shell.h"

/// A page for a browser that shows a shell in three dimensions. In the library its::page, which needs npm to
/// build.
namespace ITS_API its {

struct ViewOptions {
    std::string title = "Implicit thin shell";  ///< UTF-8
    int up = 2;                                 ///< the axis that points upwards: 0 x, 1 y, 2 z
    /// Cells of the two surfaces along the scale s, 1 to 65536. 0: the shell's own up to depth 7, and 128
    /// above.
    int resolution = 0;
    std::uint64_t max_memory = 0;  ///< of the surfaces, see SurfaceOptions::max_memory
    /// Samples of f along the longest side of the box that the page's cut plane shows, 16 to 256.
    int field_samples = 112;
    /// Triangles of each body, at least 1000: what has more is shown simplified, and the page says so.
    std::uint64_t max_triangles = 400'000;
    Run run = {};
};

/// The page: one HTML text that loads nothing else. It has the mesh and the surfaces, rounded to 2⁻¹⁹ of s, f
/// on a grid of samples, and the numbers of the build.
/// \throws OptionError, MemoryError, Cancelled.
std::string view_page(const ThinShell& shell, const ViewOptions& options = {});

/// Writes view_page() to a temporary name that is then renamed.
/// \throws as view_page(), FileError.
void write_view(const ThinShell& shell, const std::filesystem::path& path, const ViewOptions& options = {});

}  // namespace its
