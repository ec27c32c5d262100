#pragma once

#include <span>

namespace its::page {

/// The page that CMake builds in web/ and compiles into the library, with a mark where the data goes; empty if
/// it was built without npm.
std::span<const unsigned char> view_template();

}  // namespace its::page
