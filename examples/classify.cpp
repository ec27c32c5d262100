// Builds the shell of a mesh, and tells which of some points are inside.
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "its/mesh.h"
#include "its/mesh_file.h"
#include "its/query.h"
#include "its/shell.h"

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: classify MESH\n");
        return 2;
    }
    try {
        const its::Mesh mesh = its::read_mesh(argv[1]).mesh;
        const its::ThinShell shell = its::build(mesh, {.depth = 7});
        const its::ShellInfo& info = shell.info();
        std::printf("f in [%g, %g] on all of the mesh; inside is defined by: %s\n", info.epsilon_inner,
                    info.epsilon_outer, std::string(its::name(info.sign)).c_str());

        // A grid of points in the root cube, all at once. its::Query also has calls for single points.
        std::vector<its::Vec3> points;
        constexpr int n = 40;
        for (int i = 0; i < n * n * n; ++i) {
            const int index[3] = {i % n, i / n % n, i / n / n};
            its::Vec3 p;
            for (int axis = 0; axis < 3; ++axis) {
                const double low = info.root.min[axis], high = info.root.max[axis];
                p[axis] = low + (high - low) * (index[axis] + 0.5) / n;
            }
            points.push_back(p);
        }
        const its::Query query(shell);
        std::vector<std::int8_t> codes(points.size());
        query.classify(points, codes);

        std::size_t inside = 0;
        for (const std::int8_t code : codes) inside += code == std::int8_t(its::Side::inside);
        std::printf("%zu of %zu points are inside\n", inside, points.size());
    } catch (const its::Error& error) {
        std::fprintf(stderr, "classify: error: %s\n", error.what());
        return 2;
    }
}
