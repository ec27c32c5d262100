#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "display/colour.h"
#include "its/picture.h"

/// Drawing with antialiasing. Pixel (x, y) covers [x, x+1) × [y, y+1), y downwards.
namespace its::picture {
using namespace display;

/// A part of a picture, in whole pixels.
struct PixelRect {
    int x = 0, y = 0, width = 0, height = 0;
};

struct Point2 {
    double x = 0, y = 0;
};

struct Segment {
    Point2 a, b;
};

/// How much of each pixel of a rectangle lines cover, 0 to 255. Lines add by maximum, so that their order is
/// without effect and joints of a polyline do not show.
class Coverage {
public:
    Coverage(int width, int height) : width_(width), height_(height), value_(std::size_t(width) * height) {}

    /// A line with round ends, `width` pixels wide, `strength` ≤ 1 opaque; clipped. Coordinates are finite.
    void line(const Segment& segment, double width, double strength = 1);

    double at(int x, int y) const { return value_[std::size_t(y) * width_ + x] / 255.0; }

private:
    int width_, height_;
    std::vector<std::uint8_t> value_;
};

/// colour over base, `alpha` opaque.
Rgb mix(const Rgb& base, const Rgb& colour, double alpha);

void set_pixel(Image& image, int x, int y, const Rgb& colour);
Rgb pixel(const Image& image, int x, int y);

/// Blends a colour over a rectangle; clipped to the image.
void fill(Image& image, const PixelRect& rect, const Rgb& colour, double alpha = 1);

/// A line over the picture, and the outline of a rectangle just inside its border.
void draw_line(Image& image, const Segment& segment, double width, const Rgb& colour, double alpha = 1);
void outline(Image& image, const PixelRect& rect, int width, const Rgb& colour, double alpha = 1);

}  // namespace its::picture
