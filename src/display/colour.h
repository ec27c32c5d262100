#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "its/base.h"

/// Colours, and the diverging map of f.
namespace its::display {

using Rgb = std::array<std::uint8_t, 3>;  ///< sRGB

/// Linear light, not sRGB; 1 is white.
using Light = Vec3;

Light to_light(const Rgb& colour);
Rgb to_srgb(const Light& light);  ///< clamped to [0, 1]

/// Blue (−1) over near white (0) to red (1), interpolated in Oklab, where equal steps look equal: both ends are
/// equally dark, so that the picture stays readable in grey. Values outside [−1, 1] are clamped, NaN is grey.
class ITS_API DivergingMap {
public:
    DivergingMap();
    Rgb operator()(double t) const;

private:
    std::vector<Rgb> table_;
};

/// sign(t)·√|t|: spreads the colours near the surface, where they matter.
double signed_root(double t);

}  // namespace its::display
