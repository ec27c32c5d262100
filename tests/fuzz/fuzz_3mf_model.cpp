#include "formats/samples.h"
#include "fuzz_mesh.h"

/// The XML of a 3MF model, within a sound archive.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto parse = [](std::string_view xml) {
        return its::formats::parse_3mf(its::samples::zip({{"3D/3dmodel.model", std::string(xml)}}));
    };
    return its::fuzz::check_reader(parse, data, size);
}
