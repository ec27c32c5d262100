#include <fmt/format.h>

#include <new>

#include "base/input_file.h"
#include "base/quote.h"
#include "formats/point_readers.h"
#include "formats/readers.h"

namespace its {
using namespace formats;

namespace {

using Parse = std::vector<Vec3> (*)(std::string_view);

Parse parser_of(const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    if (extension == ".npy") return parse_npy;
    if (extension == ".csv") return parse_csv;
    if (extension == ".xyz") return parse_xyz;
    if (extension == ".ply") return parse_ply_points;
    throw OptionError(
        fmt::format("{}: points are read from and written to .npy, .csv, .xyz and .ply", shown(path)));
}

}  // namespace

void check_points_extension(const std::filesystem::path& path) {
    parser_of(path);
}

std::vector<Vec3> read_points(const std::filesystem::path& path) {
    const Parse parse = parser_of(path);
    const FileBytes file = read_bytes(path);
    const std::string name = shown(path);
    try {
        return parse(text_of(file));
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", name, quotable(error.what(), longest_line)));
    } catch (const std::bad_alloc&) {
        throw MemoryError(fmt::format("{}: its points need more memory than is free", name));
    }
}

}  // namespace its
