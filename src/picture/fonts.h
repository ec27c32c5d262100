#pragma once

#include <span>

/// Font files that CMake compiles into the library, so that pictures need none where they are drawn.
namespace its::picture {

std::span<const unsigned char> font_regular();
std::span<const unsigned char> font_medium();

}  // namespace its::picture
