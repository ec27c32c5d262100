#pragma once

#include <cstdint>
#include <vector>

#include "its/mesh.h"
#include "verify/lattice.h"

/// Signed crossings of M with the lattice lines that run upward, along z.
namespace its::verifier {

/// For every lattice point the sum of the signs with which the ray from it along +z crosses M: +1 where a
/// triangle's normal points up. Exact; lattice points are displaced as the file's convention says, so that no
/// ray meets an edge or a vertex. Where M is a cycle the sum is the winding number; its parity is that of the
/// number of triangles between the point and infinity.
///
/// Nothing here depends on the octree: every triangle is drawn row by row onto all lines that it may meet.
class Columns {
public:
    /// \param mesh  inside the root cube
    Columns(const Mesh& mesh, const Lattice& lattice, const Progress& progress);

    std::int32_t above(std::int64_t x, std::int64_t y, std::int64_t z) const;

    std::uint64_t crossings() const { return events_.size(); }

private:
    /// On a line, from lattice point z on upward a triangle is passed.
    struct Event {
        std::uint32_t x;
        std::int32_t z;
        std::int32_t sum;  ///< while they are gathered the sign; then of all from here to the line's end
    };
    struct Drawn {
        std::uint32_t row;
        Event event;
    };
    void draw(const Mesh& mesh, const Triangle& t, std::vector<Drawn>& out) const;
    void gather(const std::vector<std::vector<Drawn>>& drawn);

    const Lattice& lattice_;
    std::vector<std::uint64_t> row_;  ///< where the events of each y begin; one more at the end
    std::vector<Event> events_;       ///< by y, then x, then z
};

}  // namespace its::verifier
