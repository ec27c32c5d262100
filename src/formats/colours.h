#pragma once

#include <algorithm>
#include <cmath>

/// Colours of files are sRGB, as pictures are (IEC 61966-2-1); those of glTF are linear.
namespace its::formats {

inline double linear_of_srgb(double x) {
    return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}
inline double srgb_of_linear(double x) {
    return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

/// 8 bits of sRGB in 16 bits of linear light: exact both ways, since the least step between two of 256 is
/// 1/255/12.92 and 20 times that of 65,536.
inline double linear_16_of_byte(double byte) {
    return std::round(linear_of_srgb(byte / 255) * 65535);
}
/// Whether a linear value in [0, 1] of 16 bits is that of a byte of sRGB.
inline bool is_of_byte(double linear) {
    const double byte = std::round(srgb_of_linear(std::clamp(linear, 0.0, 1.0)) * 255);
    return linear_16_of_byte(byte) == std::round(linear * 65535);
}

}  // namespace its::formats
