// One mesh at one depth: builds its shell and counts samples on M that lie outside of it. One JSON object on
// standard output; exit 1 on a violation, 2 if the mesh is refused. tools/validate runs it over a folder.
#include <fmt/core.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <unordered_map>
#include <vector>

#include "its/mesh_file.h"
#include "its/shell.h"
#include "its/stopwatch.h"
#include "main.h"

namespace {

using its::Vec3;

constexpr std::uint64_t seed = 20240;
constexpr std::size_t blue_samples = 10'000, uniform_samples = 1'000'000;

Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Vec3 operator*(double s, const Vec3& a) {
    return {s * a.x, s * a.y, s * a.z};
}
double norm(const Vec3& a) {
    return std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z);
}

/// Points of M, uniform by area; if it has none, uniform by triangle.
class Sampler {
public:
    explicit Sampler(const its::Mesh& mesh) : mesh_(mesh) {
        double sum = 0;
        for (const its::Triangle& t : mesh.triangles) {
            const Vec3 u = mesh.vertices[t[1]] - mesh.vertices[t[0]],
                       v = mesh.vertices[t[2]] - mesh.vertices[t[0]];
            running_.push_back(
                sum += 0.5 * norm({u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x}));
        }
        if (!(sum > 0))
            for (std::size_t i = 0; i < running_.size(); ++i) running_[i] = double(i + 1);
    }

    double area() const { return running_.back(); }

    Vec3 next() {
        const auto at = std::upper_bound(running_.begin(), running_.end(), unit_(random_) * area());
        const auto index = std::min(std::size_t(at - running_.begin()), running_.size() - 1);
        const its::Triangle& t = mesh_.triangles[index];
        double u = unit_(random_), v = unit_(random_);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const Vec3 a = mesh_.vertices[t[0]];
        return a + u * (mesh_.vertices[t[1]] - a) + v * (mesh_.vertices[t[2]] - a);
    }

private:
    const its::Mesh& mesh_;
    std::vector<double> running_;
    std::mt19937_64 random_{seed};
    std::uniform_real_distribution<double> unit_{0, 1};
};

/// Poisson-disk samples by dart throwing (Cook 1986): no two nearer than a radius, which is lowered until there
/// are enough. It starts at 0.7 of that of the densest packing; random packing saturates at 0.78.
std::vector<Vec3> blue_noise(Sampler& sampler) {
    double radius = 0.7 * std::sqrt(2 * sampler.area() / (std::sqrt(3.0) * double(blue_samples)));
    std::vector<Vec3> points;
    while (points.size() < blue_samples) {
        std::unordered_multimap<std::uint64_t, std::size_t> grid;
        const auto key = [&](const Vec3& p, int dx, int dy, int dz) {
            std::uint64_t h = 0;
            for (const std::int64_t c :
                 {std::int64_t(std::floor(p.x / radius)) + dx, std::int64_t(std::floor(p.y / radius)) + dy,
                  std::int64_t(std::floor(p.z / radius)) + dz})
                h = (h ^ std::uint64_t(c)) * 0x9e3779b97f4a7c15ull;
            return h;
        };
        const auto free = [&](const Vec3& p) {
            for (int i = 0; i < 27; ++i) {
                const auto [begin, end] = grid.equal_range(key(p, i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
                for (auto it = begin; it != end; ++it)
                    if (norm(points[it->second] - p) < radius) return false;
            }
            return true;
        };
        for (std::size_t i = 0; i < points.size(); ++i) grid.emplace(key(points[i], 0, 0, 0), i);
        for (std::size_t dart = 0; dart < 10 * blue_samples && points.size() < blue_samples; ++dart) {
            const Vec3 p = sampler.next();
            if (radius > 0 && !free(p)) continue;
            if (radius > 0) grid.emplace(key(p, 0, 0, 0), points.size());
            points.push_back(p);
        }
        radius *= 0.8;
    }
    return points;
}

std::uint64_t peak_bytes() {
    struct rusage usage {};
    getrusage(RUSAGE_SELF, &usage);
    return std::uint64_t(usage.ru_maxrss) * 1024;
}

int validate(const char* file, int depth) {
    const its::MeshFile read = its::read_mesh(file);
    const its::Mesh& mesh = read.mesh;
    const std::uint64_t before = peak_bytes();
    const its::Stopwatch watch;
    its::BuildOptions options;
    options.depth = depth;
    options.run.threads = 1;
    const its::ThinShell shell = its::build(mesh, options);
    const double seconds = watch.seconds();
    const std::uint64_t peak = peak_bytes();

    const its::ShellInfo& info = shell.info();
    std::uint64_t violations = 0, samples = 0;
    double lowest = 0, highest = 0;
    const auto test = [&](const Vec3& p) {
        const double f = shell.value(p);
        lowest = std::min(lowest, f);
        highest = std::max(highest, f);
        violations += !(f >= info.epsilon_inner && f <= info.epsilon_outer);
        ++samples;
    };
    Sampler sampler(mesh);
    for (const Vec3& p : blue_noise(sampler)) test(p);
    for (std::size_t i = 0; i < uniform_samples; ++i) test(sampler.next());
    for (const its::Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) test(mesh.vertices[v]);

    nlohmann::ordered_json json;
    json["sign"] = its::name(info.sign);
    json["sign_reason"] = info.sign_reason;
    json["warnings"] = read.warnings.size();
    json["triangles"] = mesh.triangles.size();
    json["depth"] = depth;
    json["thickness"] = info.thickness() / info.scale;
    json["surface_cells"] = info.surface_cells;
    json["samples"] = samples;
    json["violations"] = violations;
    json["least_margin"] =
        std::min(lowest - info.epsilon_inner, info.epsilon_outer - highest) / info.cell_width;
    json["seconds"] = seconds;
    json["bytes"] = peak - std::min(before, peak);
    json["peak_bytes"] = peak;
    fmt::print("{}\n", json.dump());
    return violations > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv, "validate_mesh MESH DEPTH", [](int count, char** words) {
        if (count != 3) its::bench::refuse(words[count - 1]);
        return validate(words[1], std::atoi(words[2]));
    });
}
