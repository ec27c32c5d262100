#include "weld.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace its::cli {

void WeldOption::declare(CLI::App& app) {
    const auto parse = [this](const std::string& text) {
        std::string_view number = text;
        percent_ = number.ends_with('%');
        if (percent_) number.remove_suffix(1);
        const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), value_);
        if (error != std::errc{} || stop != number.data() + number.size() || !std::isfinite(value_) ||
            value_ < 0)
            throw CLI::ValidationError("--weld",
                                       fmt::format("'{}' is no length: a number, in mesh units or with % "
                                                   "of the longest side, at least 0",
                                                   text));
    };
    app.add_option_function<std::string>(
           "--weld", parse,
           "Corners nearer than this become one first; mesh units, or with % of the\n"
           "longest side")
        ->type_name("LENGTH");
}

double WeldOption::length(const Mesh& mesh) const {
    if (!percent_ || value_ == 0) return value_;
    double longest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t v : t) {
                low = std::min(low, mesh.vertices[v][axis]);
                high = std::max(high, mesh.vertices[v][axis]);
            }
        longest = std::max(longest, high - low);
    }
    return value_ / 100 * longest;
}

Json weld_json(const WeldReport& report) {
    return {{"length", report.length},
            {"corners", report.corners},
            {"clusters", report.clusters},
            {"degenerate", report.degenerate},
            {"largest_move", report.largest_move}};
}

std::string weld_text(const WeldReport& report) {
    return fmt::format(
        "{} corners nearer than {:g} became {}, moved by at most {:g}; {} triangles became segments or "
        "points. All else is about the welded mesh",
        count_text(report.corners), report.length, count_text(report.clusters), report.largest_move,
        count_text(report.degenerate));
}

}  // namespace its::cli
