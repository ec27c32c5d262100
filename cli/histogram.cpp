#include "histogram.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "report.h"

namespace its::cli {
namespace {

constexpr int width = 280, height = 120, top = 26, gap_x = 40, gap_y = 70, columns_a_row = 3;
constexpr int bars = 24;

/// Numbers of values in `bars` equal parts of [low, high].
std::vector<std::uint64_t> count(const std::vector<double>& values, double low, double high) {
    std::vector<std::uint64_t> counts(bars);
    for (const double value : values)
        ++counts[std::size_t(std::clamp(int(bars * ((value - low) / (high - low))), 0, bars - 1))];
    return counts;
}

std::string panel(const Column& column, int at) {
    const auto [least, most] = std::minmax_element(column.values.begin(), column.values.end());
    const bool logarithmic = *least > 0 && *most > 10 * *least;
    std::vector<double> values = column.values;
    if (logarithmic)
        for (double& value : values) value = std::log10(value);
    double low = *std::min_element(values.begin(), values.end()),
           high = *std::max_element(values.begin(), values.end());
    const double least_shown = *least, most_shown = *most;
    if (low == high) low -= 0.5, high += 0.5;
    const std::vector<std::uint64_t> counts = count(values, low, high);
    const std::uint64_t largest = *std::max_element(counts.begin(), counts.end());

    const int x = 20 + at % columns_a_row * (width + gap_x), y = 10 + at / columns_a_row * (height + gap_y);
    const int base = y + top + height;
    std::string svg = fmt::format("<text x=\"{}\" y=\"{}\" font-weight=\"bold\">{}{}</text>", x, y + 16,
                                  column.name, logarithmic ? " (log)" : "");
    for (int i = 0; i < bars; ++i) {
        const double tall = height * double(counts[std::size_t(i)]) / double(largest),
                     wide = double(width) / bars;
        svg += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#3465a4\">"
            "<title>{}</title></rect>",
            x + i * wide, base - tall, wide - 1, tall, count_text(counts[std::size_t(i)]));
    }
    svg += fmt::format("<line x1=\"{0}\" y1=\"{1}.5\" x2=\"{2}\" y2=\"{1}.5\" stroke=\"#555\"/>", x, base,
                       x + width);
    svg += fmt::format("<text x=\"{}\" y=\"{}\">{:.4g}</text>", x, base + 16, least_shown);
    svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{:.4g}</text>", x + width, base + 16,
                       most_shown);
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"#555\">{} meshes, at most {} a bar</text>",
        x + width / 2, base + 32, count_text(values.size()), count_text(largest));
    return svg;
}

}  // namespace

std::string histogram(const std::vector<Column>& columns) {
    const int rows = (int(columns.size()) + columns_a_row - 1) / columns_a_row;
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" font-family=\"sans-serif\" "
        "font-size=\"12\"><rect width=\"100%\" height=\"100%\" fill=\"white\"/>",
        columns_a_row * (width + gap_x), rows * (height + gap_y) + 10);
    for (std::size_t i = 0; i < columns.size(); ++i) svg += panel(columns[i], int(i));
    return svg + "</svg>\n";
}

}  // namespace its::cli
