#pragma once

#include <algorithm>
#include <ctime>

#include "its/mesh.h"
#include "its/stopwatch.h"

/// Other ways to wrap a mesh, each with one thread unless said.
namespace its::bench {

/// Wall-clock seconds, and processor seconds of all threads, which other work on the machine disturbs less.
struct Seconds {
    double wall = 1e300, processor = 1e300;

    void keep_least(const Seconds& other) {
        wall = std::min(wall, other.wall);
        processor = std::min(processor, other.processor);
    }
};

/// Since construction.
class Timer {
public:
    Seconds seconds() const { return {watch_.seconds(), double(std::clock() - processor_) / CLOCKS_PER_SEC}; }

private:
    Stopwatch watch_;
    std::clock_t processor_ = std::clock();
};

/// A surface, and the time it took.
struct PeerSurface {
    Mesh mesh;
    Seconds seconds;
};

/// CGAL's alpha_wrap_3; alpha and offset in mesh units.
PeerSurface alpha_wrap(const Mesh& mesh, double alpha, double offset);

/// OpenVDB: meshToVolume with this voxel, and volumeToMesh at `level` (mesh units, from the surface) without
/// adaptivity, its quads split; `seconds` is of volumeToMesh alone, `build_seconds` of meshToVolume.
/// \param half_width  of the grid's band, in voxels
PeerSurface volume_to_mesh(const Mesh& mesh, double voxel, double level, int threads, double& build_seconds,
                           float half_width = 3);

}  // namespace its::bench
