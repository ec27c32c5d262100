// Sides of a closed mesh and of the same mesh with holes, in alternation, one thread. Usage:
//   bench_open MESH [--depth=6 | --thickness=0.005] [--holes=1] [--radius=0.1] [--points=200000] [--rounds=15]
// Holes are all triangles whose first corner is within a radius of random vertices, both as parts of the
// longest side.
//   bench_open MESH --depth=6 --twin [--points=10000000]
// removes one triangle, and compares the sides of all points that are too far from it for it to matter.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "geometry/box.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/query.h"
#include "its/shell.h"
#include "its/stopwatch.h"
#include "main.h"

namespace its::bench {
namespace {

struct Options {
    std::string mesh;
    int depth = 6, holes = 1, rounds = 15;
    double radius = 0.1, thickness = 0;
    std::uint64_t points = 200'000;
    bool twin = false;
};

Options parse(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        const auto value = argument.substr(argument.find('=') + 1);
        if (argument.starts_with("--depth="))
            options.depth = std::stoi(value);
        else if (argument.starts_with("--thickness="))
            options.thickness = std::stod(value);
        else if (argument.starts_with("--holes="))
            options.holes = std::stoi(value);
        else if (argument.starts_with("--radius="))
            options.radius = std::stod(value);
        else if (argument.starts_with("--points="))
            options.points = std::stoull(value);
        else if (argument.starts_with("--rounds="))
            options.rounds = std::stoi(value);
        else if (argument == "--twin")
            options.twin = true;
        else if (argument.starts_with("--"))
            refuse(argument);
        else
            options.mesh = argument;
    }
    if (options.mesh.empty()) throw OptionError("usage: bench_open MESH [options]");
    return options;
}

using Random = std::mt19937_64;

double uniform(Random& random) {
    return double(random() >> 11) * 0x1p-53;
}

std::vector<Vec3> box_points(const Box& box, std::uint64_t count, Random& random) {
    std::vector<Vec3> points(count);
    for (Vec3& p : points)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = box.min[axis] + uniform(random) * (box.max[axis] - box.min[axis]);
    return points;
}

Mesh with_holes(Mesh mesh, int holes, double radius, Random& random) {
    std::vector<Vec3> centres;
    for (int i = 0; i < holes; ++i) {
        const Triangle& t = mesh.triangles[random() % mesh.triangles.size()];
        centres.push_back(mesh.vertices[t[0]]);
    }
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return std::ranges::any_of(centres,
                                   [&](const Vec3& c) { return norm(mesh.vertices[t[0]] - c) < radius; });
    });
    return mesh;
}

ThinShell shell_of(const Mesh& mesh, const Options& options, double size, SignRule sign) {
    BuildOptions build_options;
    build_options.sign = sign;
    if (options.thickness > 0)
        build_options.thickness = options.thickness * size;
    else
        build_options.depth = options.depth;
    return build(mesh, build_options);
}

/// Beyond this distance from the triangle's centre its solid angle, at most its area over the squared distance
/// to it, is below 2π: then w is within ½ of the closed mesh's.
double margin(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& centre) {
    const double radius = std::max({norm(a - centre), norm(b - centre), norm(c - centre)});
    return (radius + std::sqrt(0.5 * norm(cross(b - a, c - a)) / (2 * std::numbers::pi))) * (1 + 1e-9);
}

int compare_twins(const Options& options, const Mesh& mesh, const Box& box, double size) {
    Random random(7);
    Mesh open = mesh;
    const std::size_t removed = random() % mesh.triangles.size();
    open.triangles.erase(open.triangles.begin() + std::ptrdiff_t(removed));
    const Triangle& t = mesh.triangles[removed];
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 centre = (1.0 / 3) * (a + b + c);
    const double off = margin(a, b, c, centre);
    const Query closed(shell_of(mesh, options, size, SignRule::winding)),
        holed(shell_of(open, options, size, SignRule::generalized));
    const std::vector<Vec3> points = box_points(box, options.points, random);
    std::vector<std::int8_t> expected(points.size()), found(points.size());
    closed.classify(points, expected);
    holed.classify(points, found);
    std::uint64_t compared = 0, differ = 0, uncertain = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        uncertain += found[i] == std::int8_t(Side::uncertain) ? 1 : 0;
        if (!(norm(points[i] - centre) > off)) continue;
        ++compared;
        differ += expected[i] != found[i] ? 1 : 0;
    }
    fmt::print("{} points, {} farther than {:.3g} from triangle {}: {} differ, {} of all uncertain\n",
               points.size(), compared, off, removed, differ, uncertain);
    return differ == 0 ? 0 : 1;
}

int run(int argc, char** argv) {
    const Options options = parse(argc, argv);
    const Mesh mesh = read_mesh(options.mesh).mesh;
    const Box box = geometry::bounds(mesh.vertices, mesh.triangles);
    const double size = std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
    if (options.twin) return compare_twins(options, mesh, box, size);

    Random random(1);
    const Mesh open = with_holes(mesh, options.holes, options.radius * size, random);
    const MeshReport report = inspect(open);
    const ThinShell closed_shell = shell_of(mesh, options, size, SignRule::winding),
                    open_shell = shell_of(open, options, size, SignRule::generalized);
    const Query closed(closed_shell);
    const Stopwatch indexing;
    const Query holed(open_shell);
    const double index = indexing.seconds();
    const std::vector<Vec3> points = box_points(box, options.points, random);
    std::vector<std::int8_t> codes(points.size());
    double best[2] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (int round = 0; round < options.rounds; ++round)
        for (int which = 0; which < 2; ++which) {
            const std::clock_t begin = std::clock();  // processor time
            (which == 0 ? closed : holed).classify(points, codes, {.threads = 1});
            best[which] = std::min(best[which], double(std::clock() - begin) / CLOCKS_PER_SEC);
        }
    const double each = 1e9 / double(points.size());
    fmt::print(
        "{} open edges; closed {:.2f} ns, open {:.2f} ns, ratio {:.2f}; {} uncertain; index {:.1f} ms, {:.2f} "
        "MB\n",
        report.open_edges, each * best[0], each * best[1], best[1] / best[0],
        std::count(codes.begin(), codes.end(), std::int8_t(Side::uncertain)), 1e3 * index,
        1e-6 * double(holed.memory_bytes()));
    return 0;
}

}  // namespace
}  // namespace its::bench

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv,
                               "bench_open MESH [--depth=6 | --thickness=0.005] [--holes=1] [--radius=0.1] "
                               "[--points=200000] [--rounds=15] [--twin]",
                               its::bench::run);
}
