// A user's program: what is thrown within the library is caught here as what it is.
#include <cstdio>
#include <cstring>

#include "its/mesh_file.h"
#include "its/query.h"

int main() {
    its::Mesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const its::Query query(its::build(mesh, {.depth = 3}));
    if (query.classify({0.1, 0.1, 0.1}) != its::Side::inside) return 1;
    int caught = 0;
    try {
        its::read_mesh("/nowhere.obj");
    } catch (const its::FileError& error) {
        caught += std::strstr(error.what(), "nowhere") != nullptr;
    }
    try {
        its::build(mesh, {.depth = 99});
    } catch (const its::InputError&) {
        return 1;
    } catch (const its::Error& error) {
        caught += dynamic_cast<const its::OptionError*>(&error) != nullptr;
    }
    try {
        its::build(mesh, {.depth = 3, .run = {.progress = [](std::string_view, double) { return false; }}});
    } catch (const its::Cancelled&) {
        ++caught;
    }
    std::printf("caught %d of 3\n", caught);
    return caught == 3 ? 0 : 1;
}
