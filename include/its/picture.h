#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "its/shell.h"

/// Pictures of a shell.
namespace ITS_API its {

struct SliceOptions {
    int axis = 2;  ///< 0 x, 1 y, 2 z: the normal of the plane, unless `normal` is given
    /// Normal of any plane, towards the viewer: finite and not zero, of any length.
    std::optional<Vec3> normal = {};
    double at = 0.5;                    ///< position of the plane within the mesh's extent, 0 to 1
    std::optional<Vec3> through = {};   ///< a finite point of the plane, mesh units; `at` is then not used
    std::optional<MeshView> mesh = {};  ///< its section is drawn; empty: that of the shell's own mesh
    int size = 1024;                    ///< pixels of the longer side of the plot, 64 to 8192
    bool cells = false;                 ///< draw the octree's cells
    Run run = {};                       ///< reports the beginning and the end
};

/// 8-bit RGB, rows from the top.
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

/// f on a plane: diverging colours (blue inside, red outside), contours at ε₁, 0 and ε₂, the
/// mesh's section in black, and a legend with values beside the plot.
/// \throws OptionError; InputError if `mesh` has no triangles, indices out of range or non-finite coordinates.
Image slice(const ThinShell& shell, const SliceOptions& options = {});

struct RenderOptions {
    int width = 1600;              ///< pixels of the picture, 256 to 8192
    int up = 2;                    ///< the axis that points upwards: 0 x, 1 y, 2 z
    double azimuth = 30;           ///< of the camera around that axis, degrees
    double elevation = 18;         ///< of the camera above the floor, degrees, 0 to 80
    double cut = 48;               ///< where the cuts face, seen from above: degrees to the left of the camera
    double at = 0.5;               ///< position of the middle cut within the outer surface, 0 to 1
    int samples = 16;              ///< rays a pixel, 1 to 4096: noise falls with it, and time grows
    int resolution = 0;            ///< of the surfaces, see SurfaceOptions::resolution
    std::uint64_t max_memory = 0;  ///< of the surfaces, see SurfaceOptions::max_memory
    Run run = {};
};

/// The mesh, its inner and outer surface side by side, and all three cut open, one less than the other; traced
/// with soft light. Needs neither a display nor a graphics card.
/// \throws OptionError, MemoryError, Cancelled.
Image render(const ThinShell& shell, const RenderOptions& options = {});

/// Writes a PNG to a temporary name that is then renamed.
/// \throws FileError; OptionError if the image has no pixels or not 3 bytes for each.
void write_png(const Image& image, const std::filesystem::path& path);

}  // namespace its
