#pragma once

#include <array>
#include <cstdint>

#include "its/shell.h"
#include "mesh/arrays.h"

namespace its::shell {

/// input_hash() where the depth is known.
std::array<std::uint64_t, 2> hash_of(const mesh::Arrays& mesh, const BuildOptions& options, int depth);

}  // namespace its::shell
