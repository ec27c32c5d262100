// Surfaces that wrap a mesh, beside CGAL's alpha wrapping and OpenVDB's volumeToMesh. Usage:
//   bench_surface MESH [--depths=6-9] [--threads=1,2] [--repeat=3] [--no-peers] [--no-slow]
// Prints Markdown tables. Seconds are of the fastest repetition, for our surfaces with the certificate;
// tightness is the one-sided Hausdorff distance from each surface to the mesh and back, measured by
// mesh_distance() for all, relative to the diagonal of the mesh's bounds. --no-slow leaves out
// the alpha wrap that takes half a minute.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/surface.h"
#include "main.h"
#include "peer_surfaces.h"

namespace its::bench {
namespace {

struct Options {
    std::string mesh;
    int low = 6, high = 9, repeat = 3;
    std::vector<int> threads = {1, 2};
    bool peers = true, slow = true;
};

Options parse(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument.starts_with("--depths=")) {
            if (std::sscanf(argument.c_str(), "--depths=%d-%d", &options.low, &options.high) != 2)
                throw OptionError(argument + ": expected --depths=LOW-HIGH");
        } else if (argument.starts_with("--threads=")) {
            options.threads.clear();
            std::stringstream list(argument.substr(10));
            for (std::string n; std::getline(list, n, ',');) options.threads.push_back(std::stoi(n));
        } else if (argument.starts_with("--repeat=")) {
            options.repeat = std::stoi(argument.substr(9));
        } else if (argument == "--no-peers") {
            options.peers = false;
        } else if (argument == "--no-slow") {
            options.slow = false;
        } else if (argument.starts_with("--")) {
            refuse(argument);
        } else {
            options.mesh = argument;
        }
    }
    if (options.mesh.empty()) throw OptionError("usage: bench_surface MESH [options]");
    return options;
}

void print_row(const std::string& method, const std::string& lattice, int threads, const Seconds& seconds,
               const Mesh& surface, const Mesh& mesh, double diagonal, const std::string& proven) {
    const double there = mesh_distance(surface, mesh).max, back = mesh_distance(mesh, surface).max;
    fmt::print("| {} | {} | {} | {:.3f} | {:.3f} | {} | {:.5f} | {:.5f} | {} |\n", method, lattice, threads,
               seconds.wall, seconds.processor, surface.triangles.size(), there / diagonal, back / diagonal,
               proven);
    std::fflush(stdout);
}

void run_ours(const Options& options, const Mesh& mesh, double diagonal) {
    for (int depth = options.low; depth <= options.high; ++depth) {
        BuildOptions build_options;
        build_options.depth = depth;
        const ThinShell shell = build(mesh, build_options);
        for (const int threads : options.threads) {
            Seconds both, best[2];
            Surface surface[2];
            for (int i = 0; i < options.repeat; ++i) {
                const Timer timer;
                for (int k = 0; k < 2; ++k) {
                    const Timer one;
                    surface[k] = Surface{};
                    surface[k] =
                        extract_surface(shell, {.side = k == 0 ? SurfaceSide::outer : SurfaceSide::inner,
                                                .run = {.threads = threads}});
                    best[k].keep_least(one.seconds());
                }
                both.keep_least(timer.seconds());
            }
            const std::string lattice = fmt::format("K = {}", depth);
            for (int k = 0; k < 2; ++k) {
                if (surface[k].report.empty) {
                    fmt::print("| ITS {} | {} | {} | {:.3f} | {:.3f} | empty | | | |\n",
                               name(surface[k].report.side), lattice, threads, best[k].wall, best[k].processor);
                    continue;
                }
                print_row(fmt::format("ITS {}", name(surface[k].report.side)), lattice, threads, best[k],
                          surface[k].mesh, mesh, diagonal, surface[k].report.certified ? "yes" : "no");
            }
            fmt::print("| ITS both | {} | {} | {:.3f} | {:.3f} | {} | | | |\n", lattice, threads, both.wall,
                       both.processor, surface[0].mesh.triangles.size() + surface[1].mesh.triangles.size());
            std::fflush(stdout);
        }
    }
}

void run_openvdb([[maybe_unused]] const Options& options, [[maybe_unused]] const Mesh& mesh,
                 [[maybe_unused]] double side, [[maybe_unused]] double diagonal) {
#ifdef ITS_BENCH_OPENVDB
    for (int depth = options.low; depth <= options.high; ++depth)
        for (const int threads : options.threads) {
            const double voxel = side / std::ldexp(1.0, depth);
            PeerSurface best;
            double build = 1e300;
            for (int i = 0; i < options.repeat; ++i) {
                double seconds = 0;
                PeerSurface surface = volume_to_mesh(mesh, voxel, 0.25 * voxel, threads, seconds);
                build = std::min(build, seconds);
                surface.seconds.keep_least(best.seconds);
                best = std::move(surface);
            }
            print_row(fmt::format("OpenVDB volumeToMesh at ¼ voxel (its grid: {:.3f} processor s)", build),
                      fmt::format("1/{}", 1 << depth), threads, best.seconds, best.mesh, mesh, diagonal, "no");
        }
#endif
}

void run_alpha_wrap([[maybe_unused]] const Options& options, [[maybe_unused]] const Mesh& mesh,
                    [[maybe_unused]] double diagonal) {
#ifdef ITS_BENCH_CGAL
    for (const int alpha : {30, 256}) {
        if (alpha > 30 && !options.slow) continue;
        const PeerSurface wrap = alpha_wrap(mesh, diagonal / alpha, diagonal / 256);
        print_row("CGAL alpha_wrap_3, offset 1/256", fmt::format("alpha 1/{}", alpha), 1, wrap.seconds,
                  wrap.mesh, mesh, diagonal, "outer only");
    }
#endif
}

int run(int argc, char** argv) {
    const Options options = parse(argc, argv);
    const Mesh mesh = read_mesh(options.mesh).mesh;
    const Box box = inspect(mesh).bounds;
    double side = 0, square = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double length = box.max[axis] - box.min[axis];
        side = std::max(side, length);
        square += length * length;
    }
    const double diagonal = std::sqrt(square);
    fmt::print("{}: {} triangles\n\n", options.mesh, mesh.triangles.size());
    fmt::print(
        "| method | lattice | threads | seconds | processor s | triangles | surface to mesh | mesh to surface "
        "| proven |\n");
    fmt::print("|---|---|--:|--:|--:|--:|--:|--:|---|\n");
    run_ours(options, mesh, diagonal);
    if (options.peers) {
        run_openvdb(options, mesh, side, diagonal);
        run_alpha_wrap(options, mesh, diagonal);
    }
    return 0;
}

}  // namespace
}  // namespace its::bench

int main(int argc, char** argv) {
    return its::bench::guarded(
        argc, argv, "bench_surface MESH [--depths=6-9] [--threads=1,2] [--repeat=3] [--no-peers] [--no-slow]",
        its::bench::run);
}
