// Writes a model to try the other programs on: a twisted, knotted tube.
#include <charconv>
#include <cstdio>
#include <cstring>

#include "its/mesh_file.h"
#include "model.h"

namespace {

/// A whole number from 3 to 20000 in all of `text`, or 0.
int count(const char* text) {
    int value = 0;
    const char* end = text + std::strlen(text);
    const auto [stop, error] = std::from_chars(text, end, value);
    return error == std::errc{} && stop == end && value >= 3 && value <= 20000 ? value : 0;
}

}  // namespace

int main(int argc, char** argv) {
    const int along = argc == 4 ? count(argv[2]) : 600;
    const int around = argc == 4 ? count(argv[3]) : 25;
    if ((argc != 2 && argc != 4) || along == 0 || around == 0) {
        std::fprintf(stderr, "usage: make_model OUT.obj|.stl|.ply|.off [ALONG AROUND]   (3 to 20000 each)\n");
        return 2;
    }
    try {
        its::write_mesh(its::examples::twisted_knot(along, around), argv[1]);
    } catch (const its::Error& error) {
        std::fprintf(stderr, "make_model: error: %s\n", error.what());
        return 2;
    }
}
