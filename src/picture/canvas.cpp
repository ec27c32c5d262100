#include "picture/canvas.h"

#include <algorithm>
#include <cmath>

namespace its::picture {
namespace {

struct Bounds {
    double min_x, max_x, min_y, max_y;
};

/// The part of the segment in the box; false if there is none (Liang–Barsky).
bool clip(Segment& s, const Bounds& box) {
    const double dx = s.b.x - s.a.x, dy = s.b.y - s.a.y;
    const double step[4] = {-dx, dx, -dy, dy};
    const double room[4] = {s.a.x - box.min_x, box.max_x - s.a.x, s.a.y - box.min_y, box.max_y - s.a.y};
    double from = 0, to = 1;
    for (int i = 0; i < 4; ++i) {
        if (step[i] == 0 && room[i] < 0) return false;
        if (step[i] < 0) from = std::max(from, room[i] / step[i]);
        if (step[i] > 0) to = std::min(to, room[i] / step[i]);
    }
    if (from > to) return false;
    const Point2 a = s.a;
    s.a = {a.x + from * dx, a.y + from * dy};
    s.b = {a.x + to * dx, a.y + to * dy};
    return true;
}

/// Calls paint(x, y, coverage) for the pixels of a width × height picture that the line touches.
template <class Paint>
void trace(Segment s, double line_width, int width, int height, Paint&& paint) {
    const double reach = 0.5 * line_width + 0.5;  // beyond it a pixel's centre sees nothing of the line
    if (!clip(s, {-reach - 1, width + reach + 1, -reach - 1, height + reach + 1})) return;
    const double dx = s.b.x - s.a.x, dy = s.b.y - s.a.y, square = dx * dx + dy * dy;
    const int y_begin = std::max(0, int(std::floor(std::min(s.a.y, s.b.y) - reach)));
    const int y_end = std::min(height, int(std::ceil(std::max(s.a.y, s.b.y) + reach)) + 1);
    for (int y = y_begin; y < y_end; ++y) {
        // The part of the segment that is near enough to this row bounds the pixels to look at.
        Segment near = s;
        if (!clip(near, {-1e9, 1e9, y + 0.5 - reach, y + 0.5 + reach})) continue;
        const int x_begin = std::max(0, int(std::floor(std::min(near.a.x, near.b.x) - reach)));
        const int x_end = std::min(width, int(std::ceil(std::max(near.a.x, near.b.x) + reach)) + 1);
        for (int x = x_begin; x < x_end; ++x) {
            const double px = x + 0.5 - s.a.x, py = y + 0.5 - s.a.y;
            const double t = square > 0 ? std::clamp((px * dx + py * dy) / square, 0.0, 1.0) : 0.0;
            const double distance = std::hypot(px - t * dx, py - t * dy);
            const double coverage = std::min(std::clamp(reach - distance, 0.0, 1.0), line_width);
            if (coverage > 0) paint(x, y, coverage);
        }
    }
}

}  // namespace

void Coverage::line(const Segment& segment, double width, double strength) {
    trace(segment, width, width_, height_, [&](int x, int y, double coverage) {
        auto& value = value_[std::size_t(y) * width_ + x];
        value = std::max(value, static_cast<std::uint8_t>(std::lround(255 * coverage * strength)));
    });
}

Rgb mix(const Rgb& base, const Rgb& colour, double alpha) {
    Rgb out;
    for (std::size_t i = 0; i < 3; ++i) {
        out[i] = static_cast<std::uint8_t>(std::lround(std::lerp(double(base[i]), double(colour[i]), alpha)));
    }
    return out;
}

void set_pixel(Image& image, int x, int y, const Rgb& colour) {
    std::copy(colour.begin(), colour.end(), image.rgb.begin() + 3 * (std::ptrdiff_t(y) * image.width + x));
}

Rgb pixel(const Image& image, int x, int y) {
    const std::uint8_t* const p = image.rgb.data() + 3 * (std::ptrdiff_t(y) * image.width + x);
    return {p[0], p[1], p[2]};
}

void fill(Image& image, const PixelRect& rect, const Rgb& colour, double alpha) {
    const int x_end = std::min(image.width, rect.x + rect.width);
    const int y_end = std::min(image.height, rect.y + rect.height);
    for (int y = std::max(0, rect.y); y < y_end; ++y)
        for (int x = std::max(0, rect.x); x < x_end; ++x)
            set_pixel(image, x, y, mix(pixel(image, x, y), colour, alpha));
}

void draw_line(Image& image, const Segment& segment, double width, const Rgb& colour, double alpha) {
    trace(segment, width, image.width, image.height, [&](int x, int y, double coverage) {
        set_pixel(image, x, y, mix(pixel(image, x, y), colour, alpha * coverage));
    });
}

void outline(Image& image, const PixelRect& r, int width, const Rgb& colour, double alpha) {
    fill(image, {r.x, r.y, r.width, width}, colour, alpha);
    fill(image, {r.x, r.y + r.height - width, r.width, width}, colour, alpha);
    fill(image, {r.x, r.y + width, width, r.height - 2 * width}, colour, alpha);
    fill(image, {r.x + r.width - width, r.y + width, width, r.height - 2 * width}, colour, alpha);
}

}  // namespace its::picture
