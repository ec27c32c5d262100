#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "its/base.h"

/// Files of points, and of what was found at points.
namespace ITS_API its {

/// Reads points, by extension.
///
/// .npy: an array of n × 3 numbers, integers or floating point of up to 8 bytes, either byte order, C or
/// Fortran order.
///
/// .csv: a line each, separated by comma, semicolon or tab (with the last two, decimal signs may be commas). An
/// optional first line of names, where x, y and z
/// say which columns are the coordinates (else the first three).
///
/// .xyz: a line each, separated by blanks; the first three numbers.
///
/// .ply: the vertices, text or binary; no faces are needed.
///
/// In text, lines that are empty or begin with # are skipped. NaN and infinite coordinates are kept. Sizes that
/// a file claims are checked against the file before memory is taken.
/// \throws FileError if the file cannot be read; InputError, naming the line where there is one, if it is not
///         what its extension says; OptionError (unknown extension); MemoryError.
std::vector<Vec3> read_points(const std::filesystem::path& path);

/// Numbers found at each point: names.size() of them a point, those of one point together.
struct PointColumns {
    std::vector<std::string> names;
    std::span<const double> values;
};

/// Writes a code for each point, and columns of numbers, by extension, to a temporary name that is then
/// renamed.
///
/// .npy: without columns n integers of 8 bits; with m − 1 of them n × m numbers of 64 bits, the code first.
///
/// .csv: a line of names (x, y, z, code and the columns'), then a line each.
///
/// .xyz: the same lines, separated by blanks and without names.
///
/// .ply: vertices, binary and little-endian: x, y, z as double, code as int (some programs skip char), the
/// columns as double.
///
/// Numbers in text read back as the same bits.
/// \throws FileError; OptionError (unknown extension, or arrays that do not fit each other).
void write_points(const std::filesystem::path& path, std::span<const Vec3> points,
                  std::span<const std::int8_t> codes, std::span<const PointColumns> columns = {});

/// Refuses an extension that the two functions above do not know.
/// \throws OptionError.
void check_points_extension(const std::filesystem::path& path);

}  // namespace its
