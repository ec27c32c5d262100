#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "formats/point_readers.h"
#include "formats/readers.h"

/// The readers of points; the first byte chooses one.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
    constexpr std::vector<its::Vec3> (*readers[])(std::string_view) = {
        its::formats::parse_npy, its::formats::parse_csv, its::formats::parse_xyz,
        its::formats::parse_ply_points};
    try {
        if (readers[data[0] % 4](bytes).size() > bytes.size()) std::abort();
    } catch (const its::InputError&) {
    }
    return 0;
}
