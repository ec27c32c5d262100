#pragma once

namespace its {

/// The nearest 32-bit number. Where two neighbours are rounded so, GCC 12 takes double(float(x)) for x.
inline double to_single(double x) {
    volatile float rounded = float(x);
    return double(rounded);
}

}  // namespace its
