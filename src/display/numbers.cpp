#include "display/numbers.h"

#include <fmt/format.h>

#include <algorithm>

namespace its::display {
namespace {

/// ASCII digits and signs of an exponent as superscripts.
std::string superscript(int exponent) {
    static constexpr const char* digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string text;
    for (const char c : fmt::format("{}", exponent)) text += c == '-' ? "⁻" : digits[c - '0'];
    return text;
}

}  // namespace

ITS_API std::string with_minus(std::string text) {
    if (text.starts_with('-')) text.replace(0, 1, "−");
    return text;
}

ITS_API std::string number_text(double value, int digits) {
    if (value == 0) return "0";
    const std::string scientific = fmt::format("{:.{}e}", value, digits - 1);
    const std::size_t split = scientific.find('e');
    const int exponent = std::stoi(scientific.substr(split + 1));
    if (exponent < -3 || exponent > 5) {
        return with_minus(scientific.substr(0, split)) + "·10" + superscript(exponent);
    }
    return with_minus(fmt::format("{:.{}f}", value, std::max(0, digits - 1 - exponent)));
}

ITS_API std::string count_text(std::uint64_t value) {
    const std::string digits = fmt::format("{}", value);
    std::string text;
    for (std::size_t i = 0; i < digits.size(); ++i) {
        if (i > 0 && (digits.size() - i) % 3 == 0) text += ",";
        text += digits[i];
    }
    return text;
}

}  // namespace its::display
