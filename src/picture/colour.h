#pragma once

#include <array>
#include <cstdint>
#include <vector>

/// Colours, and the diverging map of f.
namespace its {

using Rgb = std::array<std::uint8_t, 3>;  ///< sRGB

/// Blue (−1) over near white (0) to red (1), interpolated in Oklab, where equal steps look equal: both ends are
/// equally dark, so that the picture stays readable in grey. Values outside [−1, 1] are clamped, NaN is grey.
class DivergingMap {
public:
    DivergingMap();
    Rgb operator()(double t) const;

private:
    std::vector<Rgb> table_;
};

/// sign(t)·√|t|: spreads the colours near the surface, where they matter.
double signed_root(double t);

}  // namespace its
