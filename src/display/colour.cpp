#include "display/colour.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace its::display {
namespace {

struct Lab {
    double l, a, b;
};

Lab from_lch(double lightness, double chroma, double degrees) {
    const double hue = degrees * std::numbers::pi / 180;
    return {lightness, chroma * std::cos(hue), chroma * std::sin(hue)};
}

std::uint8_t to_byte(double linear) {
    const double v = std::clamp(linear, 0.0, 1.0);
    const double srgb = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;  // IEC 61966-2-1
    return static_cast<std::uint8_t>(std::lround(255 * srgb));
}

/// Björn Ottosson, "A perceptual color space for image processing", 2020.
Rgb to_rgb(const Lab& c) {
    const auto cube = [](double v) { return v * v * v; };
    const double l = cube(c.l + 0.3963377774 * c.a + 0.2158037573 * c.b);
    const double m = cube(c.l - 0.1055613458 * c.a - 0.0638541728 * c.b);
    const double s = cube(c.l - 0.0894841775 * c.a - 1.2914855480 * c.b);
    return to_srgb({4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
                    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
                    -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s});
}

struct Stop {
    double at, lightness, chroma;  // of both arms
};
constexpr Stop stops[] = {{0.0, 0.985, 0.004}, {0.3, 0.885, 0.055}, {0.65, 0.70, 0.125}, {1.0, 0.48, 0.155}};
constexpr double blue = 255, red = 28;  // hues, degrees

constexpr int half_table = 512;

Lab at(double t) {
    const double x = std::abs(t);
    std::size_t i = 0;
    while (i + 2 < std::size(stops) && x > stops[i + 1].at) ++i;
    const double mix = (x - stops[i].at) / (stops[i + 1].at - stops[i].at);
    const double lightness = std::lerp(stops[i].lightness, stops[i + 1].lightness, mix);
    const double chroma = std::lerp(stops[i].chroma, stops[i + 1].chroma, mix);
    return from_lch(lightness, chroma, t < 0 ? blue : red);
}

double to_linear(std::uint8_t byte) {
    const double v = byte / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

}  // namespace

ITS_API Light to_light(const Rgb& colour) {
    return {to_linear(colour[0]), to_linear(colour[1]), to_linear(colour[2])};
}

ITS_API Rgb to_srgb(const Light& light) {
    return {to_byte(light.x), to_byte(light.y), to_byte(light.z)};
}

DivergingMap::DivergingMap() : table_(2 * half_table + 1) {
    for (std::size_t i = 0; i < table_.size(); ++i) {
        table_[i] = to_rgb(at((double(i) - half_table) / half_table));
    }
}

Rgb DivergingMap::operator()(double t) const {
    if (std::isnan(t)) return {128, 128, 128};
    return table_[std::size_t(std::lround(std::clamp(t, -1.0, 1.0) * half_table) + half_table)];
}

ITS_API double signed_root(double t) {
    return std::copysign(std::sqrt(std::abs(t)), t);
}

}  // namespace its::display
