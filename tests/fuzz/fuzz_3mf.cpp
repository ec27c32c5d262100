#include "fuzz_mesh.h"

/// lib3mf 1.8.1 never frees one small object of libzip for each file it reads.
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libzip";
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    return its::fuzz::check_reader([](std::string_view bytes) { return its::parse_3mf(bytes); }, data, size);
}
