#pragma once

#include <filesystem>
#include <string>

#include "its/mesh.h"

namespace its {

/// The extension with its dot, in lower case.
std::string lower_extension(const std::filesystem::path& path);

}  // namespace its
