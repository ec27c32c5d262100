#pragma once

#include "base/single.h"
#include "geometry/scaling.h"

namespace its::simplifier {

/// The numbers that the result's coordinates can be: those that `rounding` leaves of doubles, in the caller's
/// units, scaled as the mesh under simplification is. Doubles of common sizes need no rounding; subnormal ones
/// have fewer digits than what is computed with.
struct Numbers {
    Rounding rounding;  ///< in the caller's units
    geometry::Scaling scaling;

    Vec3 nearest(const Vec3& p) const {
        if (scaling.exponent == 0) return rounding.nearest(p);
        return scaling.in(rounding.nearest(scaling.out(p)));
    }
};

}  // namespace its::simplifier
