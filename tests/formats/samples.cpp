#include "formats/samples.h"

namespace its::samples {

std::vector<std::filesystem::path> seeds() {
    std::vector<std::filesystem::path> found;
    const auto folder = std::filesystem::path(ITS_SOURCE_DIR) / "tests" / "fuzz" / "seeds";
    for (const char* format : {"obj", "stl", "ply", "off", "gltf", "3mf"}) {
        for (const auto& entry : std::filesystem::directory_iterator(folder / format))
            found.push_back(entry.path());
    }
    return found;
}

}  // namespace its::samples
