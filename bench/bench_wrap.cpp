// Wraps at a proven distance from a mesh, beside OpenVDB's offset with as large an error as measured. Usage:
//   bench_wrap MESH [--clearance=0.002] [--slack=0.0005] [--repeat=3] [--no-peers]
// Lengths are relative to the longest side. Prints a Markdown table; seconds are of the fastest repetition, on
// one thread, all included. The nearest and farthest points of each surface are measured by mesh_distance()'s
// points (farthest) and at vertices and midpoints of edges and triangles (nearest); for OpenVDB the voxel is
// halved until what lies between both is no more than ours.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/wrap.h"
#include "main.h"
#include "peer_surfaces.h"

namespace its::bench {
namespace {

constexpr const char* usage = "bench_wrap MESH [--clearance=0.002] [--slack=0.0005] [--repeat=3] [--no-peers]";

struct Options {
    std::string mesh;
    double clearance = 0.002, slack = 0.0005;
    int repeat = 3;
    bool peers = true;
};

Options parse(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument.starts_with("--clearance="))
            options.clearance = std::stod(argument.substr(12));
        else if (argument.starts_with("--slack="))
            options.slack = std::stod(argument.substr(8));
        else if (argument.starts_with("--repeat="))
            options.repeat = std::stoi(argument.substr(9));
        else if (argument == "--no-peers")
            options.peers = false;
        else if (argument.starts_with("--"))
            refuse(argument);
        else
            options.mesh = argument;
    }
    return options;
}

struct Spread {
    double nearest = 1e300, farthest = 0;
    double error() const { return farthest - nearest; }
};

/// Of a surface's distances from the mesh, at vertices and at midpoints of edges and triangles.
Spread measure(const Mesh& surface, const ClosestPoints& mesh) {
    std::vector<Vec3> points;
    const auto middle = [](const Vec3& a, const Vec3& b) {
        return Vec3{(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2};
    };
    for (const Triangle& t : surface.triangles) {
        const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
        points.insert(points.end(), {a, middle(a, b), middle(b, c), middle(c, a), middle(middle(a, b), c)});
    }
    std::vector<ClosestPoint> found(points.size());
    mesh.find(points, found);
    Spread spread;
    for (const ClosestPoint& p : found) {
        spread.nearest = std::min(spread.nearest, p.distance);
        spread.farthest = std::max(spread.farthest, p.distance);
    }
    return spread;
}

void print_row(const std::string& method, const Seconds& seconds, std::size_t triangles, const Spread& spread,
               double side, const std::string& proven) {
    fmt::print("| {} | {:.3f} | {:.3f} | {} | {:.6f} | {:.6f} | {} |\n", method, seconds.wall,
               seconds.processor, triangles, spread.nearest / side, spread.farthest / side, proven);
    std::fflush(stdout);
}

int run(int argc, char** argv) {
    const Options options = parse(argc, argv);
    const Mesh mesh = read_mesh(options.mesh).mesh;
    const Box box = inspect(mesh).bounds;
    const double side = std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
    const ClosestPoints closest(mesh);
    fmt::print("{}, {} triangles\n\n", options.mesh, mesh.triangles.size());
    fmt::print("| | wall s | processor s | triangles | nearest | farthest | proven |\n");
    fmt::print("|---|--:|--:|--:|--:|--:|---|\n");
    Seconds best;
    Wrap ours;
    WrapOptions wrapping{.clearance = options.clearance * side, .slack = options.slack * side};
    wrapping.run.threads = 1;
    for (int i = 0; i < options.repeat; ++i) {
        const Timer timer;
        ours = wrap(mesh, wrapping);
        best.keep_least(timer.seconds());
    }
    const Spread spread = measure(ours.mesh, closest);
    print_row("ITS", best, ours.mesh.triangles.size(), spread, side,
              fmt::format("{:.6f} to {:.6f}", ours.report.lowest / side, ours.report.highest / side));
#ifdef ITS_BENCH_OPENVDB
    const double level = (options.clearance + options.slack / 2) * side;
    constexpr std::size_t most_triangles = 40'000'000;
    for (double voxel = side / 128; options.peers; voxel /= 2) {
        double build = 0;
        const float half_width = std::max(3.0F, float(std::ceil(level / voxel)) + 2);
        const PeerSurface peer = volume_to_mesh(mesh, voxel, level, 1, build, half_width);
        const Spread other = measure(peer.mesh, closest);
        print_row(fmt::format("OpenVDB, voxel 1/{:.0f}", side / voxel),
                  {peer.seconds.wall + build, peer.seconds.processor + build}, peer.mesh.triangles.size(),
                  other, side, "no");
        if (other.error() <= spread.error() || peer.mesh.triangles.size() > most_triangles) break;
    }
#endif
    return 0;
}

}  // namespace
}  // namespace its::bench

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv, its::bench::usage, its::bench::run);
}
