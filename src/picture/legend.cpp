#include "picture/legend.h"
#include "display/numbers.h"
#include "its/inspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

namespace its::picture {
namespace {

constexpr double small = 15, normal = 16.5, title = 30;  // em sizes, units
constexpr double row_height = 26;                        // units

/// 1, 2 or 5 times a power of ten: the smallest that is at least `least`.
double nice_step(double least) {
    const double power = std::pow(10.0, std::floor(std::log10(least)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= least) return factor * power;
    return 10 * power;
}

/// Text of a multiple of `step`, up to `largest` in magnitude: the digits down to those of the step.
std::string tick_text(double value, double step, double largest) {
    if (std::abs(value) < 0.5 * step) return "0";
    const int lowest = int(std::floor(std::log10(1.001 * step)));  // the step's own power of ten
    if (lowest >= -4 && largest < 1e6) return with_minus(fmt::format("{:.{}f}", value, std::max(0, -lowest)));
    const int highest = int(std::floor(std::log10(1.001 * std::abs(value))));
    return number_text(value, std::clamp(1 + highest - lowest, 1, 15));
}

}  // namespace

int Pen::pixels(double units) const {
    return std::max(1, int(std::lround(units * unit)));
}

void Pen::rule(double x, double y, double width) const {
    fill(image, {int(std::lround(x)), int(std::lround(y)), int(std::lround(width)), pixels(1)}, hairline);
}

void draw_axes(const Pen& pen, const View& view, const PlaneText& text) {
    const PixelRect& r = view.rect;
    const double step = nice_step(view.pixel * std::max(r.width, r.height) / 7);
    const double tick = 6 * pen.unit;
    const Point2 low = view.to_plane({0, double(r.height)}), high = view.to_plane({double(r.width), 0});
    const double largest = std::max({std::abs(low.x), std::abs(low.y), std::abs(high.x), std::abs(high.y)});
    const double size = small * pen.unit;

    for (double i = std::ceil(low.x / step); i * step <= high.x; ++i) {
        const double x = r.x + view.to_pixels({i * step, 0}).x, y = r.y + r.height;
        draw_line(pen.image, {{x, y}, {x, y + tick}}, pen.pixels(1), pale_ink);
        pen.type.write(pen.image, tick_text(i * step, step, largest), {x, y + tick + 1.15 * size}, size,
                       pale_ink, Weight::regular, Align::centre);
    }
    for (double i = std::ceil(low.y / step); i * step <= high.y; ++i) {
        const double x = r.x, y = r.y + view.to_pixels({0, i * step}).y;
        draw_line(pen.image, {{x - tick, y}, {x, y}}, pen.pixels(1), pale_ink);
        pen.type.write(pen.image, tick_text(i * step, step, largest), {x - 1.6 * tick, y + 0.36 * size}, size,
                       pale_ink, Weight::regular, Align::right);
    }
    pen.type.write(pen.image, text.right, {double(r.x + r.width), r.y + r.height + 2.9 * size},
                   normal * pen.unit, ink, Weight::medium, Align::right);
    pen.type.write(pen.image, text.up, {r.x - 1.6 * tick, r.y - 0.5 * size}, normal * pen.unit, ink,
                   Weight::medium, Align::right);
}

double facts_height(const PlaneText& text) {
    return 1.72 * title + 20 + row_height * double(text.normal.empty() ? 9 : 10) + 28;
}

double draw_facts(const Pen& pen, const ShellInfo& info, const PlaneText& text, double x, double y,
                  double width) {
    const double u = pen.unit;
    pen.type.write(pen.image, "Implicit thin shell", {x, y + 0.74 * title * u}, title * u, ink, Weight::medium);
    y += 1.72 * title * u;
    pen.type.write(pen.image, text.title, {x, y}, normal * u, pale_ink);
    y += 20 * u;

    std::vector<std::pair<std::string, std::string>> rows = {
        {"Depth K", fmt::format("{}", info.depth)},
        {"Cell width w", number_text(info.cell_width)},
        {"Sign", std::string(name(info.sign))},
        {"ε₁", number_text(info.epsilon_inner)},
        {"ε₂", number_text(info.epsilon_outer)},
        {"Thickness ε₂ − ε₁", number_text(info.thickness())},
        {"Thickness relative to s", number_text(info.thickness() / info.scale)},
        {"Triangles", count_text(info.mesh_triangles)},
        {"Surface cells", count_text(info.surface_cells)},
    };
    if (!text.normal.empty()) rows.insert(rows.begin(), {"Normal n", text.normal});
    for (const auto& [label, value] : rows) {
        pen.rule(x, y, width);
        pen.type.write(pen.image, label, {x, y + 18.5 * u}, normal * u, pale_ink);
        pen.type.write(pen.image, value, {x + width, y + 18.5 * u}, normal * u, ink, Weight::medium,
                       Align::right);
        y += row_height * u;
    }
    pen.rule(x, y, width);
    return y + 28 * u;
}

double draw_colour_bar(const Pen& pen, const DivergingMap& colours, bool has_inside, double range, double x,
                       double y, double width) {
    const double u = pen.unit, size = small * u;
    pen.type.write(pen.image, "f ÷ s, square-root scale", {x, y}, normal * u, ink, Weight::medium);
    y += 10 * u;
    const PixelRect bar{int(std::lround(x)), int(std::lround(y)), int(std::lround(width)), pen.pixels(16)};
    const double lowest = has_inside ? -1 : 0;
    const auto place = [&](double t) { return bar.x + (t - lowest) / (1 - lowest) * bar.width; };
    for (int i = 0; i < bar.width; ++i) {
        const double t = lowest + (1 - lowest) * (i + 0.5) / bar.width;
        fill(pen.image, {bar.x + i, bar.y, 1, bar.height}, colours(t));
    }
    outline(pen.image, bar, pen.pixels(1), pale_ink, 0.6);
    const double below = bar.y + bar.height;
    for (const double v : {-0.5, -0.2, -0.05, 0.0, 0.05, 0.2, 0.5}) {
        if (v < 0 && !has_inside) continue;
        const double t = signed_root(v / range), at = place(t);
        draw_line(pen.image, {{at, below}, {at, below + 5 * u}}, pen.pixels(1), pale_ink);
        const Align align = t == lowest ? Align::left : t == 1 ? Align::right : Align::centre;
        pen.type.write(pen.image, with_minus(fmt::format("{:g}", v)), {at, below + 5 * u + size}, size,
                       pale_ink, Weight::regular, align);
    }
    return below + 52 * u;
}

double draw_key(const Pen& pen, const ShellInfo& info, double x, double y, double width) {
    struct Entry {
        const char* text;
        Rgb colour;
        double thickness;  // of the sample line, units; a filled box if it is thick
        double alpha = 1;
    };
    std::vector<Entry> entries = {{"mesh", mesh_colour, 3}, {"shell", shell_colour, 14, shell_alpha}};
    const bool has_inside = info.sign != SignRule::unsigned_rule;
    if (has_inside && info.epsilon_inner < 0) entries.push_back({"f = ε₁", inner_colour, 2.5});
    if (has_inside) entries.push_back({"f = 0", zero_colour, 2.5});
    entries.push_back({"f = ε₂", outer_colour, 2.5});

    const double u = pen.unit, sample = 22 * u, space = 7 * u;
    // The entries' own widths and equal gaps between them fill the column.
    double used = 0;
    for (const Entry& e : entries) used += sample + space + pen.type.width(e.text, small * u);
    const double gap = (width - used) / double(entries.size() - 1);
    for (const Entry& e : entries) {
        const int height = pen.pixels(e.thickness);
        fill(pen.image,
             {int(std::lround(x)), int(std::lround(y - 5.4 * u - 0.5 * height)), int(std::lround(sample)),
              height},
             e.colour, e.alpha);
        pen.type.write(pen.image, e.text, {x + sample + space, y}, small * u, ink);
        x += sample + space + pen.type.width(e.text, small * u) + gap;
    }
    return y + 28 * u;
}

}  // namespace its::picture
