#include "fuzz_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    return its::fuzz::check_reader([](std::string_view bytes) { return its::formats::parse_3mf(bytes); }, data,
                                   size);
}
