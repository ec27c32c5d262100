// Signs of open meshes beside their distances. Usage:
//   bench_signs MESH… [--depths=7-9] [--threads=1,2] [--repeat=3] [--cases=NAME,…] [--save=FOLDER]
// Holes are cut into each mesh, with fixed seeds, and shells are built with generalized winding numbers.
// Prints a Markdown table; seconds are the least of the repetitions. --save writes the open meshes as PLY.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numeric>
#include <random>
#include <sstream>

#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/shell.h"
#include "main.h"

namespace its::bench {
namespace {

struct Options {
    std::vector<std::string> meshes, cases;
    int low = 7, high = 9, repeat = 3;
    std::vector<int> threads = {1, 2};
    std::filesystem::path save;
};

std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> parts;
    std::stringstream list(text);
    for (std::string part; std::getline(list, part, ',');) parts.push_back(part);
    return parts;
}

Options parse(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument.starts_with("--depths=")) {
            if (std::sscanf(argument.c_str(), "--depths=%d-%d", &options.low, &options.high) != 2)
                throw OptionError(argument + ": expected --depths=LOW-HIGH");
        } else if (argument.starts_with("--threads=")) {
            options.threads.clear();
            for (const std::string& n : split(argument.substr(10))) options.threads.push_back(std::stoi(n));
        } else if (argument.starts_with("--repeat=")) {
            options.repeat = std::stoi(argument.substr(9));
        } else if (argument.starts_with("--cases=")) {
            options.cases = split(argument.substr(8));
        } else if (argument.starts_with("--save=")) {
            options.save = argument.substr(7);
        } else if (argument.starts_with("--")) {
            refuse(argument);
        } else {
            options.meshes.push_back(argument);
        }
    }
    if (options.meshes.empty()) throw OptionError("usage: bench_signs MESH… [options]");
    return options;
}

Vec3 area_vector(const Mesh& mesh, const Triangle& t) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 u{b.x - a.x, b.y - a.y, b.z - a.z}, v{c.x - a.x, c.y - a.y, c.z - a.z};
    return {0.5 * (u.y * v.z - u.z * v.y), 0.5 * (u.z * v.x - u.x * v.z), 0.5 * (u.x * v.y - u.y * v.x)};
}

double area(const Mesh& mesh, const Triangle& t) {
    const Vec3 n = area_vector(mesh, t);
    return std::hypot(n.x, n.y, n.z);
}

/// The mesh without some of its triangles.
Mesh keep(const Mesh& mesh, const std::vector<bool>& removed) {
    Mesh open;
    open.vertices = mesh.vertices;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (!removed[t]) open.triangles.push_back(mesh.triangles[t]);
    return open;
}

/// Without what is lowest along an axis, a part of the area.
Mesh cut(const Mesh& mesh, int axis, double part) {
    std::vector<std::size_t> order(mesh.triangles.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto height = [&](std::size_t t) {
        double sum = 0;
        for (const std::uint32_t v : mesh.triangles[t]) sum += mesh.vertices[v][axis];
        return sum;
    };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return height(a) < height(b); });
    double left = 0;
    for (const Triangle& t : mesh.triangles) left += part * area(mesh, t);
    std::vector<bool> removed(order.size());
    for (const std::size_t t : order) {
        left -= area(mesh, mesh.triangles[t]);
        if (left < 0) break;
        removed[t] = true;
    }
    return keep(mesh, removed);
}

/// Without `count` patches of `size` triangles each, grown from random ones.
Mesh punctured(const Mesh& mesh, int count, std::size_t size) {
    std::vector<std::vector<std::uint32_t>> around(mesh.vertices.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t]) around[v].push_back(std::uint32_t(t));
    std::mt19937_64 random(1);
    std::vector<bool> removed(mesh.triangles.size());
    for (int i = 0; i < count; ++i) {
        std::vector<std::uint32_t> patch{std::uint32_t(random() % mesh.triangles.size())};
        for (std::size_t next = 0; next < patch.size() && patch.size() < size; ++next)
            for (const std::uint32_t v : mesh.triangles[patch[next]])
                for (const std::uint32_t t : around[v])
                    if (patch.size() < size && std::find(patch.begin(), patch.end(), t) == patch.end())
                        patch.push_back(t);
        for (const std::uint32_t t : patch) removed[t] = true;
    }
    return keep(mesh, removed);
}

/// What scanners in three directions see under less than some 80°. Where it is ragged, each triangle has its
/// own limit.
Mesh scanned(const Mesh& mesh, bool ragged) {
    const double third = 2 * std::acos(-1.0) / 3;
    std::mt19937_64 random(1);
    std::vector<bool> removed(mesh.triangles.size(), true);
    for (std::size_t t = 0; t < removed.size(); ++t) {
        const Vec3 n = area_vector(mesh, mesh.triangles[t]);
        const double part = ragged ? double(random() >> 11) * 0x1p-53 : 0.5;
        const double limit = (0.1 + 0.15 * part) * std::hypot(n.x, n.y, n.z);
        for (int i = 0; i < 3; ++i)
            if (0.9 * (n.x * std::cos(i * third) + n.z * std::sin(i * third)) + 0.43 * n.y > limit)
                removed[t] = false;
    }
    return keep(mesh, removed);
}

struct Case {
    std::string name;
    std::function<Mesh(const Mesh&)> open;
};

const std::vector<Case>& all_cases() {
    static const std::vector<Case> cases = {
        {"as-is", [](const Mesh& m) { return m; }},
        {"five", [](const Mesh& m) { return punctured(m, 5, m.triangles.size() / 400); }},
        {"cut10", [](const Mesh& m) { return cut(m, 1, 0.1); }},
        {"cut30", [](const Mesh& m) { return cut(m, 1, 0.3); }},
        {"side50", [](const Mesh& m) { return cut(m, 0, 0.5); }},
        {"300", [](const Mesh& m) { return punctured(m, 300, 20); }},
        {"3000", [](const Mesh& m) { return punctured(m, 3000, 1); }},
        {"scan", [](const Mesh& m) { return scanned(m, false); }},
        {"ragged", [](const Mesh& m) { return scanned(m, true); }},
    };
    return cases;
}

void run_case(const std::string& model, const Case& which, const Mesh& mesh, const Options& options) {
    const Mesh open = which.open(mesh);
    if (!options.save.empty()) write_mesh(open, options.save / (model + "_" + which.name + ".ply"));
    const std::uint64_t edges = inspect(open).unbalanced_edges;
    if (edges == 0) return;
    for (int depth = options.low; depth <= options.high; ++depth)
        for (const int threads : options.threads) {
            BuildOptions build_options;
            build_options.depth = depth;
            build_options.run.threads = threads;
            build_options.sign = SignRule::generalized;
            double distance = 1e300, signs = 1e300;
            std::uint64_t cells = 0;
            for (int i = 0; i < options.repeat; ++i) {
                const ThinShell shell = build(open, build_options);
                const BuildSeconds& times = shell.build_seconds();
                cells = shell.info().surface_cells;
                signs = std::min(signs, times.signs);
                distance = std::min(distance, times.distance - times.signs);
            }
            fmt::print("| {} | {} | {} | {} | {} | {} | {} | {:.3f} | {:.3f} | {:.2f} |\n", model, which.name,
                       open.triangles.size(), edges, depth, threads, cells, distance, signs, signs / distance);
            std::fflush(stdout);
        }
}

int run(int argc, char** argv) {
    const Options options = parse(argc, argv);
    fmt::print(
        "| model | holes | triangles | boundary edges | K | threads | surface cells | distances, s | "
        "signs, s | ratio |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (const std::string& path : options.meshes) {
        const Mesh mesh = read_mesh(path).mesh;
        for (const Case& which : all_cases())
            if (options.cases.empty() || std::ranges::find(options.cases, which.name) != options.cases.end())
                run_case(std::filesystem::path(path).stem().string(), which, mesh, options);
    }
    return 0;
}

}  // namespace
}  // namespace its::bench

int main(int argc, char** argv) {
    return its::bench::guarded(
        argc, argv,
        "bench_signs MESH... [--depths=7-9] [--threads=1,2] [--repeat=3] [--cases=NAME,...] [--save=FOLDER]",
        its::bench::run);
}
