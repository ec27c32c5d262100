// Simplifies a mesh as far as a tolerance allows; that it is kept is proven for every point, both ways.
#include <cstdio>
#include <cstdlib>

#include "its/mesh.h"
#include "its/mesh_file.h"
#include "its/simplify.h"

int main(int argc, char** argv) {
    if (argc != 4) {
        std::fprintf(stderr,
                     "usage: reduce MESH TOLERANCE OUT.obj|.stl|.ply|.off   (TOLERANCE in mesh units)\n");
        return 2;
    }
    try {
        const its::Mesh mesh = its::read_mesh(argv[1]).mesh;
        const its::Simplified result = its::simplify(mesh, {.tolerance = std::strtod(argv[2], nullptr)});
        its::write_mesh(result.mesh, argv[3]);
        std::printf("%zu triangles became %zu; every point is within %g\n", mesh.triangles.size(),
                    result.mesh.triangles.size(), result.report.proven_bound.value_or(0));
    } catch (const its::Error& error) {
        std::fprintf(stderr, "reduce: error: %s\n", error.what());
        return 2;
    }
}
