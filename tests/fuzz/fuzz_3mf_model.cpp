#include "fuzz_mesh.h"
#include "mesh/archive.h"

extern "C" const char* __lsan_default_suppressions() {
    return "leak:libzip";  // see fuzz_3mf.cpp
}

/// The XML of a 3MF model, within a sound archive.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string types =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><Types "
        "xmlns=\"http://schemas.openxmlformats.org/package/2006/"
        "content-types\"><Default Extension=\"rels\" "
        "ContentType=\"application/vnd.openxmlformats-package.relationships+"
        "xml\"/><Default Extension=\"model\" "
        "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>";
    const std::string relations =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><Relationships "
        "xmlns=\"http://schemas.openxmlformats.org/package/2006/"
        "relationships\"><Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
        "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    const auto parse = [&](std::string_view xml) {
        return its::parse_3mf(its::pack({{"[Content_Types].xml", types},
                                         {"_rels/.rels", relations},
                                         {"3D/3dmodel.model", std::string(xml)}}));
    };
    return its::fuzz::check_reader(parse, data, size);
}
