#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shell/shell_data.h"
#include "verify/view.h"

/// The triangle lists of surface cells, read by what docs/design/file-format.md says of sections 13 and 14.
namespace its::verifier {

/// Cell c lists triangle[begin[c]] … triangle[begin[c + 1] − 1], strictly ascending.
struct Lists {
    std::vector<std::uint64_t> begin{0};
    std::vector<std::uint32_t> triangle;
};

/// \return what is wrong with the bytes, or nothing: then `out` has a list for every surface cell
std::optional<std::string> decode_lists(const View& view, Lists& out);

}  // namespace its::verifier
