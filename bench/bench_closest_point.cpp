// Exact closest points beside Embree's point query and CGAL's AABB tree, one thread, in one run. Usage:
//   bench_closest_point MESH… [--points=N]
// Prints a Markdown table for each mesh: nanoseconds a point (the fastest of five rounds, the tools taking
// turns) for uniform points in the bounding box scaled by 1, 2, 4 and 10, and the largest difference of
// distances from the brute-force answer in extended precision on a sample, relative to the longest side.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "its/distance.h"
#include "its/mesh_file.h"
#include "its/stopwatch.h"
#include "main.h"
#include "peer_closest_point.h"

namespace its::bench {
namespace {

constexpr int rounds = 5;
constexpr std::size_t checked_points = 200;

Box bounds_of(const Mesh& mesh) {
    Box box{mesh.vertices[0], mesh.vertices[0]};
    for (const Vec3& v : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) {
            box.min[axis] = std::min(box.min[axis], v[axis]);
            box.max[axis] = std::max(box.max[axis], v[axis]);
        }
    return box;
}

std::vector<Vec3> uniform_points(const Box& box, double factor, std::size_t count) {
    std::mt19937_64 random(20240);
    std::uniform_real_distribution<double> uniform(-0.5 * factor, 0.5 * factor);
    std::vector<Vec3> points(count);
    for (Vec3& p : points)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = 0.5 * (box.min[axis] + box.max[axis]) + uniform(random) * (box.max[axis] - box.min[axis]);
    return points;
}

long double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
    long double length = 0, along = 0, distance = 0;
    for (int i = 0; i < 3; ++i) {
        const long double d = (long double)b[i] - a[i];
        length += d * d;
        along += ((long double)p[i] - a[i]) * d;
    }
    const long double t = length > 0 ? std::clamp<long double>(along / length, 0, 1) : 0;
    for (int i = 0; i < 3; ++i) {
        const long double d = (long double)p[i] - a[i] - t * ((long double)b[i] - a[i]);
        distance += d * d;
    }
    return std::sqrt(distance);
}

long double distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const long double edges =
        std::min({distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
    long double u[3], v[3], w[3];
    for (int i = 0; i < 3; ++i) {
        u[i] = (long double)b[i] - a[i];
        v[i] = (long double)c[i] - a[i];
        w[i] = (long double)p[i] - a[i];
    }
    const auto dot = [](const long double* x, const long double* y) {
        return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    };
    const long double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), wu = dot(w, u), wv = dot(w, v);
    const long double det = uu * vv - uv * uv;
    if (!(det > 0)) return edges;
    const long double s = (vv * wu - uv * wv) / det, t = (uu * wv - uv * wu) / det;
    if (s < 0 || t < 0 || s + t > 1) return edges;
    long double squared = 0;
    for (int i = 0; i < 3; ++i) squared += (w[i] - s * u[i] - t * v[i]) * (w[i] - s * u[i] - t * v[i]);
    return std::sqrt(squared);
}

struct Tool {
    std::string name;
    double build_seconds = 0;
    std::function<void(const std::vector<Vec3>&, std::vector<double>&)> distances;
};

double seconds_of(const std::function<void()>& work) {
    const Stopwatch watch;
    work();
    return watch.seconds();
}

std::vector<Tool> make_tools(const Mesh& mesh) {
    std::vector<Tool> tools;
    const auto add = [&](const char* name, auto make, auto query) {
        Tool tool{.name = name, .distances = {}};
        decltype(make()) index;
        tool.build_seconds = seconds_of([&] { index = make(); });
        tool.distances = [index, query](const std::vector<Vec3>& points, std::vector<double>& out) {
            query(*index, points, out);
        };
        tools.push_back(std::move(tool));
    };
    add(
        "ITS", [&] { return std::make_shared<ClosestPoints>(mesh, Run{.threads = 1}); },
        [](const ClosestPoints& closest, const std::vector<Vec3>& points, std::vector<double>& out) {
            std::vector<ClosestPoint> results(points.size());
            closest.find(points, results, {.threads = 1});
            for (std::size_t i = 0; i < points.size(); ++i) out[i] = results[i].distance;
        });
    for (const PeerClosestPoint& peer : closest_point_peers())
        add(
            peer.name, [&] { return peer.make(mesh); },
            [](const PeerIndex& index, const std::vector<Vec3>& points, std::vector<double>& out) {
                for (std::size_t i = 0; i < points.size(); ++i) out[i] = index.distance(points[i]);
            });
    return tools;
}

void compare(const std::string& path, std::size_t count) {
    const Mesh mesh = read_mesh(path).mesh;
    const Box box = bounds_of(mesh);
    const double side = std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
    const std::vector<Tool> tools = make_tools(mesh);
    fmt::print("\n{}, {} triangles, {} points a box\n\n| |", path.substr(path.rfind('/') + 1),
               mesh.triangles.size(), count);
    for (const Tool& tool : tools) fmt::print(" {} |", tool.name);
    fmt::print("\n|---|");
    for (std::size_t i = 0; i < tools.size(); ++i) fmt::print("--:|");
    fmt::print("\n| build, s |");
    for (const Tool& tool : tools) fmt::print(" {:.3f} |", tool.build_seconds);
    fmt::print("\n");
    for (const double factor : {1.0, 2.0, 4.0, 10.0}) {
        const std::vector<Vec3> points = uniform_points(box, factor, count);
        std::vector<double> best(tools.size(), std::numeric_limits<double>::infinity());
        std::vector<std::vector<double>> distances(tools.size(), std::vector<double>(count));
        for (int round = 0; round < rounds; ++round)
            for (std::size_t i = 0; i < tools.size(); ++i)
                best[i] = std::min(best[i], seconds_of([&] { tools[i].distances(points, distances[i]); }));
        fmt::print("| {}×: ns a point |", factor);
        for (const double seconds : best) fmt::print(" {:.0f} |", 1e9 * seconds / double(count));
        fmt::print("\n| error / longest side |");
        for (const auto& found : distances) {
            long double worst = 0;
            for (std::size_t p = 0; p < count; p += std::max<std::size_t>(1, count / checked_points)) {
                long double exact = std::numeric_limits<long double>::infinity();
                for (const Triangle& t : mesh.triangles)
                    exact = std::min(exact, distance_to_triangle(points[p], mesh.vertices[t[0]],
                                                                 mesh.vertices[t[1]], mesh.vertices[t[2]]));
                worst = std::max(worst, std::abs(exact - found[p]));
            }
            fmt::print(" {:.1e} |", double(worst / side));
        }
        fmt::print("\n");
    }
}

}  // namespace

int run(int argc, char** argv) {
    std::size_t count = 100'000;
    std::vector<std::string> meshes;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word.starts_with("--points="))
            count = std::stoull(word.substr(word.find('=') + 1));
        else if (word.starts_with("--"))
            refuse(word);
        else
            meshes.push_back(word);
    }
    if (meshes.empty() || count == 0) throw OptionError("at least one mesh and one point are needed");
    for (const std::string& mesh : meshes) compare(mesh, count);
    return 0;
}

}  // namespace its::bench

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv, "bench_closest_point MESH... [--points=N]", its::bench::run);
}
