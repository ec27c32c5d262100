#include "length.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace its::cli {

CLI::Option* LengthOption::declare(CLI::App& app, const std::string& option, const std::string& description,
                                   Range range) {
    const auto parse = [this, option, range](const std::string& text) {
        std::string_view number = text;
        percent_ = number.ends_with('%');
        if (percent_) number.remove_suffix(1);
        const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), value_);
        if (error != std::errc{} || stop != number.data() + number.size() || !std::isfinite(value_) ||
            (range != Range::any && value_ < 0) || (range == Range::positive && value_ == 0))
            throw CLI::ValidationError(option,
                                       fmt::format("'{}' is no length: a number, in mesh units or with % "
                                                   "of the longest side{}",
                                                   text,
                                                   range == Range::any        ? ""
                                                   : range == Range::positive ? ", larger than 0"
                                                                              : ", at least 0"));
    };
    return app.add_option_function<std::string>(option, parse, description)->type_name("LENGTH");
}

double LengthOption::length(const Mesh& mesh) const {
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

}  // namespace its::cli
