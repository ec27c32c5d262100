#pragma once

#include <cstdint>
#include <string>

#include "its/export.h"

/// How pictures and pages write numbers.
namespace its::display {

/// "−1.25·10⁻⁴", "0.0317", "12 800": `digits` significant digits, a power of ten where the number is small or
/// large.
std::string number_text(double value, int digits = 4);
/// "33 926": groups of three digits, with thin spaces where no line is broken.
std::string count_text(std::uint64_t value);

/// Text of a number with a true minus sign.
std::string with_minus(std::string text);

}  // namespace its::display
