#pragma once

#include <span>

namespace its::page {

/// The page that CMake builds in web/ and compiles in, with a mark where the data goes.
std::span<const unsigned char> view_template();

}  // namespace its::page
