#pragma once

#include <cstdint>

#include "its/mesh.h"

/// Other people's simplification; every call starts from the mesh as it is in memory.
namespace its::bench {

/// The result, and the seconds that the simplification alone took.
struct PeerResult {
    Mesh mesh;
    double seconds = 0;
};

PeerResult cgal_garland_heckbert(const Mesh& mesh, std::uint64_t faces);
PeerResult cgal_lindstrom_turk(const Mesh& mesh, std::uint64_t faces);
/// Lindstrom–Turk within a polyhedral envelope of this distance, until nothing is left to collapse or `faces`
/// is reached.
PeerResult cgal_envelope(const Mesh& mesh, std::uint64_t faces, double distance);

#ifdef ITS_BENCH_MESHOPTIMIZER
PeerResult meshoptimizer(const Mesh& mesh, std::uint64_t faces);
#endif

}  // namespace its::bench
