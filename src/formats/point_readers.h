#pragma once

#include <string_view>
#include <vector>

#include "its/points.h"

/// One reader per file format. Each takes the whole file as bytes, trusts none of them, and takes time and
/// memory in proportion to their number.
/// \throws InputError; the message does not name the file.
namespace its::formats {

std::vector<Vec3> parse_npy(std::string_view bytes);
std::vector<Vec3> parse_csv(std::string_view bytes);
std::vector<Vec3> parse_xyz(std::string_view bytes);
// .ply: parse_ply_points(), formats/readers.h

}  // namespace its::formats
