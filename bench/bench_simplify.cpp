// Simplification beside plain quadrics, CGAL and meshoptimizer, as Markdown tables.
//
// To a number of faces, with a DEPTH also in the shell's ways:
//   bench_simplify [--no-peers] [--samples N] MESH:FACES[:DEPTH] …
// Within a distance, relative to the diagonal:
//   bench_simplify --tolerance RELATIVE [--envelope] MESH …
//
// One thread; a time is that of one run, without reading, measuring and (for peers) conversion. Distances are
// both ways, relative to the diagonal of the bounds, from N points each way (default 300,000) and the vertices.

#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "distance/closest_point.h"
#include "geometry/vec3.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/simplify.h"
#include "main.h"
#include "peer_simplify.h"
#include "simplify/intersections.h"

namespace {

using namespace its;

struct Settings {
    bool peers = true, envelope = false;
    std::uint64_t samples = 300'000;
    double tolerance = 0;
};

Vec3 unit_normal(const Mesh& mesh, const Triangle& t) {
    const Vec3 n = cross(mesh.vertices[t[1]] - mesh.vertices[t[0]], mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    const double length = norm(n);
    return length > 0 ? (1 / length) * n : Vec3{};
}

/// Mean angle, in degrees, between the result's normals and those of the mesh at the nearest point; by area, at
/// four points a triangle.
double normal_deviation(const Mesh& result, const Mesh& mesh, const distance::ClosestPointTree& tree) {
    double sum = 0, weight = 0;
    for (const Triangle& t : result.triangles) {
        const Vec3 a = result.vertices[t[0]], b = result.vertices[t[1]], c = result.vertices[t[2]];
        const Vec3 n = unit_normal(result, t);
        const double area = norm(cross(b - a, c - a));
        const Vec3 g = (1.0 / 3.0) * (a + b + c);
        for (const Vec3& p : {g, 0.5 * (g + a), 0.5 * (g + b), 0.5 * (g + c)}) {
            const Vec3 m = unit_normal(mesh, mesh.triangles[tree.find(p).triangle]);
            sum += area * std::acos(std::clamp(dot(n, m), -1.0, 1.0));
            weight += area;
        }
    }
    return weight > 0 ? sum / weight * 180 / M_PI : 0;
}

class Table {
public:
    Table(const Mesh& mesh, const Settings& settings)
        : mesh_(mesh), settings_(settings), tree_(mesh.vertices, mesh.triangles) {
        const Box box = inspect(mesh).bounds;
        diagonal_ = norm(box.max - box.min);
        fmt::print(
            "| method | faces | seconds | Hausdorff M→R | R→M | RMS M→R | R→M | normals, ° | "
            "self-intersections | "
            "proven bound |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    }
    double diagonal() const { return diagonal_; }

    void row(const std::string& name, const Mesh& result, double seconds, std::optional<double> bound = {}) {
        const MeshDistance there = mesh_distance(mesh_, result, settings_.samples, {.threads = 1});
        const MeshDistance back = mesh_distance(result, mesh_, settings_.samples, {.threads = 1});
        fmt::print("| {} | {} | {:.3f} | {:.5f} | {:.5f} | {:.6f} | {:.6f} | {:.1f} | {} | {} |\n", name,
                   result.triangles.size(), seconds, there.max / diagonal_, back.max / diagonal_,
                   there.root_mean_square / diagonal_, back.root_mean_square / diagonal_,
                   normal_deviation(result, mesh_, tree_),
                   simplifier::count_intersections(simplifier::Complex(result)),
                   bound ? fmt::format("{:.5f}", *bound / diagonal_) : "");
        std::fflush(stdout);
    }

    void ours(const std::string& name, SimplifyOptions options) {
        options.run.threads = 1;
        try {
            const Simplified s = simplify(mesh_, options);
            row(name, s.mesh, s.report.seconds.total, s.report.proven_bound);
        } catch (const Error& error) {
            fmt::print("| {} | {} |||||||||\n", name, error.what());
        }
    }

    template <class F>
    void peer(const std::string& name, F&& fn) {
        try {
            const bench::PeerResult r = fn();
            row(name, r.mesh, r.seconds);
        } catch (const std::exception& error) {
            fmt::print("| {} | {} |||||||||\n", name, error.what());
        }
    }

private:
    const Mesh& mesh_;
    const Settings& settings_;
    distance::ClosestPointTree tree_;
    double diagonal_ = 0;
};

/// Vertices with identical coordinates made one, as the peers need it.
Mesh welded(const Mesh& mesh) {
    return simplify(mesh, {.method = SimplifyMethod::qem, .faces = mesh.triangles.size()}).mesh;
}

void to_faces(const std::string& argument, const Settings& settings) {
    const std::size_t colon = argument.find(':'), second = argument.find(':', colon + 1);
    const std::string file = argument.substr(0, colon);
    const std::uint64_t faces = std::stoull(argument.substr(colon + 1));
    const Mesh mesh = welded(read_mesh(file).mesh);
    fmt::print("\n**{}**, {} triangles\n\n", std::filesystem::path(file).filename().string(),
               mesh.triangles.size());
    Table table(mesh, settings);
    if (second != std::string::npos) {
        const int depth = std::stoi(argument.substr(second + 1));
        const std::string at = fmt::format(", K = {}", depth);
        table.ours("vertex" + at, {.method = SimplifyMethod::vertex, .faces = faces, .depth = depth});
        table.ours("priority" + at, {.method = SimplifyMethod::priority, .faces = faces, .depth = depth});
        table.ours("certified" + at, {.faces = faces, .depth = depth});
    }
    table.ours("certified", {.faces = faces});
    table.ours("qem", {.method = SimplifyMethod::qem, .faces = faces});
    if (!settings.peers) return;
    table.peer("CGAL Garland–Heckbert", [&] { return bench::cgal_garland_heckbert(mesh, faces); });
    table.peer("CGAL Lindstrom–Turk", [&] { return bench::cgal_lindstrom_turk(mesh, faces); });
#ifdef ITS_BENCH_MESHOPTIMIZER
    table.peer("meshoptimizer", [&] { return bench::meshoptimizer(mesh, faces); });
#endif
}

void within(const std::string& file, const Settings& settings) {
    const Mesh mesh = welded(read_mesh(file).mesh);
    fmt::print("\n**{}**, {} triangles, within {} of the diagonal\n\n",
               std::filesystem::path(file).filename().string(), mesh.triangles.size(), settings.tolerance);
    Table table(mesh, settings);
    const double tolerance = settings.tolerance * table.diagonal();
    table.ours("certified", {.tolerance = tolerance});
    if (settings.envelope)
        table.peer("CGAL, polyhedral envelope", [&] { return bench::cgal_envelope(mesh, 4, tolerance); });
}

int run(int argc, char** argv) {
    Settings settings;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--no-peers")
            settings.peers = false;
        else if (word == "--envelope")
            settings.envelope = true;
        else if (word == "--samples" && i + 1 < argc)
            settings.samples = std::stoull(argv[++i]);
        else if (word == "--tolerance" && i + 1 < argc)
            settings.tolerance = std::stod(argv[++i]);
        else if (word.starts_with("--"))
            bench::refuse(word);
        else if (settings.tolerance > 0)
            within(word, settings);
        else
            to_faces(word, settings);
    }
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv,
                               "bench_simplify [--no-peers] [--samples N] MESH:FACES[:DEPTH]... | "
                               "bench_simplify --tolerance RELATIVE [--envelope] MESH...",
                               run);
}
