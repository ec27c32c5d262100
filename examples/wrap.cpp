// Wraps a mesh: writes a surface around it that is proven to enclose all of it.
#include <cstdio>

#include "its/mesh.h"
#include "its/mesh_file.h"
#include "its/surface.h"

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "usage: wrap MESH OUT.obj|.stl|.ply|.off|.glb\n");
        return 2;
    }
    try {
        const its::ThinShell shell = its::build(its::read_mesh(argv[1]).mesh, {.depth = 6});
        const its::Surface surface =
            its::extract_surface(shell, {.side = its::SurfaceSide::outer, .measure = true});
        const its::SurfaceReport& report = surface.report;
        if (!report.certified) {
            std::fprintf(stderr, "wrap: no proof: %s\n", report.reason.c_str());
            return 1;
        }
        its::write_mesh(surface.mesh, argv[2]);
        std::printf("%zu triangles enclose the mesh; measured, they are within %g of it\n",
                    surface.mesh.triangles.size(), report.to_mesh.value_or(0));
    } catch (const its::Error& error) {
        std::fprintf(stderr, "wrap: error: %s\n", error.what());
        return 2;
    }
}
