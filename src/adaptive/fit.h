#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/bernstein.h"
#include "geometry/clip.h"
#include "geometry/fan_batch.h"
#include "octree/lattice.h"

/// Whether f stays within a window on M.
namespace its::adaptive {

/// A cell in lattice coordinates.
struct Cube {
    Vec3 corner;
    double width;
};

/// One thread's tests.
class Fit {
public:
    /// \param positions  vertices in lattice coordinates
    Fit(const octree::Lattice& lattice, std::span<const Vec3> positions, std::span<const Triangle> triangles);

    /// Whether the control values prove lower ≤ f ≤ upper on the parts of these triangles in the cell, for the
    /// trilinear f with these corner values. False is said for what is within by less than a small part of the
    /// window, too. Without the control values' rounding error, which is part of γ (docs/design/extremes.md).
    bool within(const Cube& cell, const double (&value)[8], std::span<const std::uint32_t> list, double lower,
                double upper);

private:
    struct Piece {
        geometry::Sample p, q, r;
        int halvings;
    };
    /// A triangle in local coordinates.
    struct Corners {
        Vec3 a, b, c;
    };
    enum class Look : std::uint8_t { within, outside, unknown };
    static Look look_at(const double* value, const Corners& t, double margin, double lower, double upper);
    bool batch_within(const double* value, double lower, double upper);
    bool piece_within(const double* value, const Vec3& a, const Vec3& b, const Vec3& c, double lower,
                      double upper);

    std::span<const Vec3> positions_;
    std::span<const Triangle> triangles_;
    double margin_;  ///< as in find_extremes()
    geometry::FanBatch batch_{};
    std::vector<Piece> pieces_;
    std::vector<Corners> unsettled_;
};

}  // namespace its::adaptive
