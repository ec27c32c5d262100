#include "support/zoo.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <utility>

#include "../../examples/model.h"
#include "geometry/vec3.h"

namespace its::zoo {

namespace {

constexpr double pi = std::numbers::pi;

/// SplitMix64: the same numbers on every platform, unlike the distributions of <random>.
struct Random {
    std::uint64_t state;

    std::uint64_t next() {
        std::uint64_t z = (state += 0x9e3779b97f4a7c15ull);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return z ^ (z >> 31);
    }
    double uniform() { return double(next() >> 11) * 0x1p-53; }
    std::uint64_t below(std::uint64_t count) { return next() % count; }
};

/// Two triangles for the quad a b c d.
void add_quad(Mesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
}

Mesh icosahedron() {
    const double p = std::numbers::phi;
    Mesh mesh;
    mesh.vertices = {{-1, p, 0},  {1, p, 0},  {-1, -p, 0}, {1, -p, 0}, {0, -1, p},  {0, 1, p},
                     {0, -1, -p}, {0, 1, -p}, {p, 0, -1},  {p, 0, 1},  {-p, 0, -1}, {-p, 0, 1}};
    mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    return mesh;
}

/// Every triangle into four, through the middles of its edges.
Mesh subdivided(const Mesh& mesh) {
    Mesh fine;
    fine.vertices = mesh.vertices;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [place, added] = middles.try_emplace(std::minmax(a, b), std::uint32_t(fine.vertices.size()));
        if (added) fine.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
        return place->second;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
        const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    return fine;
}

}  // namespace

Mesh tetrahedron() {
    return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

Mesh box(const Vec3& min, const Vec3& max) {
    Mesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.vertices.push_back({i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z});
    }
    add_quad(mesh, 0, 2, 3, 1);
    add_quad(mesh, 4, 5, 7, 6);
    add_quad(mesh, 0, 1, 5, 4);
    add_quad(mesh, 2, 6, 7, 3);
    add_quad(mesh, 0, 4, 6, 2);
    add_quad(mesh, 1, 3, 7, 5);
    return mesh;
}

Mesh sphere(const Vec3& centre, double radius, int level) {
    Mesh mesh = icosahedron();
    for (int i = 0; i < level; ++i) mesh = subdivided(mesh);
    for (Vec3& v : mesh.vertices) v = centre + (radius / norm(v)) * v;
    return mesh;
}

Mesh torus(double major, double minor, int major_steps, int minor_steps) {
    Mesh mesh;
    for (int i = 0; i < major_steps; ++i) {
        const double u = 2 * pi * i / major_steps;
        for (int j = 0; j < minor_steps; ++j) {
            const double v = 2 * pi * j / minor_steps, ring = major + minor * std::cos(v);
            mesh.vertices.push_back({ring * std::cos(u), ring * std::sin(u), minor * std::sin(v)});
        }
    }
    const auto at = [&](int i, int j) {
        return std::uint32_t(i % major_steps * minor_steps + j % minor_steps);
    };
    for (int i = 0; i < major_steps; ++i) {
        for (int j = 0; j < minor_steps; ++j) {
            add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        }
    }
    return mesh;
}

Mesh twisted_knot(int along, int around) {
    return examples::twisted_knot(along, around);
}

Mesh hollow_sphere(int level) {
    return joined(sphere({0, 0, 0}, 1.0, level), reversed(sphere({0.1, 0.05, -0.02}, 0.6, level)));
}

Mesh overlapping_spheres(int level) {
    return joined(sphere({0, 0, 0}, 1.0, level), sphere({0.9, 0.2, 0.1}, 0.8, level));
}

Mesh sheet(int n) {
    Mesh mesh;
    for (int j = 0; j <= n; ++j) {
        for (int i = 0; i <= n; ++i) mesh.vertices.push_back({double(i) / n, double(j) / n, 0});
    }
    const auto at = [&](int i, int j) { return std::uint32_t(j * (n + 1) + i); };
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
    return mesh;
}

Mesh moebius_strip(int n) {
    constexpr int across = 4;
    Mesh mesh;
    for (int i = 0; i < n; ++i) {
        const double t = 2 * pi * i / n;
        for (int j = 0; j <= across; ++j) {
            const double w = 0.4 * (2.0 * j / across - 1), ring = 1 + w * std::cos(t / 2);
            mesh.vertices.push_back({ring * std::cos(t), ring * std::sin(t), w * std::sin(t / 2)});
        }
    }
    const auto at = [&](int i, int j) {  // after one turn the strip meets itself upside down
        return std::uint32_t(i < n ? i * (across + 1) + j : across - j);
    };
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < across; ++j) {
            add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        }
    }
    return mesh;
}

Mesh soup(int triangles, std::uint64_t seed) {
    Random random{seed};
    Mesh mesh;
    for (int i = 0; i < triangles; ++i) {
        const Vec3 place{random.uniform() * 0.8, random.uniform() * 0.8, random.uniform() * 0.8};
        for (int corner = 0; corner < 3; ++corner) {
            const Vec3 offset{random.uniform(), random.uniform(), random.uniform()};
            mesh.vertices.push_back(place + 0.2 * offset);
        }
        const auto first = std::uint32_t(3 * i);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

Mesh plate(double thickness) {
    return box({0, 0, 0}, {1, 1, thickness});
}

Mesh single_triangle() {
    return {{{0, 0, 0}, {1, 0.2, 0.1}, {0.3, 0.9, 0.4}}, {{0, 1, 2}}};
}

Mesh degenerate() {
    Mesh mesh;
    mesh.vertices = {{0.25, 0.5, 0.75}, {0, 0, 0}, {1, 0.5, 0.25}, {0.5, 0.25, 0.125}};
    mesh.triangles = {{0, 0, 0}, {1, 2, 3}, {1, 2, 2}};
    return mesh;
}

Mesh transformed(const Mesh& mesh, const double rotation[9], const Vec3& shift, double scale) {
    Mesh moved = mesh;
    for (Vec3& v : moved.vertices) {
        const Vec3 p = v;
        for (int row = 0; row < 3; ++row) {
            const double* r = rotation + 3 * row;
            v[row] = shift[row] + scale * (r[0] * p.x + r[1] * p.y + r[2] * p.z);
        }
    }
    return moved;
}

Mesh reversed(const Mesh& mesh) {
    Mesh other = mesh;
    for (Triangle& t : other.triangles) std::swap(t[1], t[2]);
    return other;
}

Mesh joined(const Mesh& a, const Mesh& b) {
    Mesh both = a;
    const auto first = std::uint32_t(a.vertices.size());
    both.vertices.insert(both.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const Triangle& t : b.triangles) both.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    return both;
}

Mesh shuffled(const Mesh& mesh, std::uint64_t seed) {
    Random random{seed};
    Mesh other = mesh;
    for (std::size_t i = other.triangles.size(); i > 1; --i) {
        std::swap(other.triangles[i - 1], other.triangles[random.below(i)]);
    }
    for (Triangle& t : other.triangles) {
        const std::size_t turn = random.below(3);
        t = {t[turn], t[(turn + 1) % 3], t[(turn + 2) % 3]};
    }
    return other;
}

Mesh split_on_one_side(const Mesh& mesh, int count, std::uint64_t seed) {
    Random random{seed};
    Mesh out = mesh;
    for (int i = 0; i < count; ++i) {
        const std::size_t which = random.below(out.triangles.size()), k = random.below(3);
        const Triangle t = out.triangles[which];
        const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
        const double share = double(1 + random.below(3)) / 4;
        const Vec3 p = out.vertices[a], along = out.vertices[b] - p;
        const auto middle = std::uint32_t(out.vertices.size());
        out.vertices.push_back(p + share * along);
        out.triangles[which] = {a, middle, c};
        out.triangles.push_back({middle, b, c});
    }
    return out;
}

Mesh snapped(const Mesh& mesh) {
    double largest = 0;
    for (const Vec3& v : mesh.vertices)
        largest = std::max({largest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    const double step = std::ldexp(1.0, std::ilogb(largest) - 20);
    Mesh out = mesh;
    for (Vec3& v : out.vertices)
        v = {step * std::round(v.x / step), step * std::round(v.y / step), step * std::round(v.z / step)};
    return out;
}

Mesh slab_t_junction() {
    return {{{0, 0, 0},
             {0, 0, 1},
             {0, 4, 0},
             {0, 4, 1},
             {10, 0, 0},
             {10, 0, 1},
             {10, 4, 0},
             {10, 4, 1},
             {0, 0, 0.5}},
            {{0, 8, 3},
             {0, 3, 2},
             {4, 6, 7},
             {4, 7, 5},
             {0, 4, 5},
             {0, 5, 1},
             {2, 3, 7},
             {2, 7, 6},
             {0, 2, 6},
             {0, 6, 4},
             {1, 5, 7},
             {1, 7, 3},
             {8, 1, 3}}};
}

Mesh cube_t_junction() {
    return {
        {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, {0, 1, 1}, {1, 0, 0}, {1, 0, 1}, {1, 1, 0}, {1, 1, 1}, {0.5, 0, 0.5}},
        {{0, 1, 3},
         {0, 3, 2},
         {4, 6, 7},
         {4, 7, 5},
         {5, 8, 4},
         {0, 5, 1},
         {2, 3, 7},
         {2, 7, 6},
         {0, 2, 6},
         {0, 6, 4},
         {1, 5, 7},
         {1, 7, 3},
         {8, 0, 4}}};
}

std::vector<Entry> all() {
    // A rotation by rational entries: orthogonal exactly, up to rounding.
    const double turn[9] = {2.0 / 3, -1.0 / 3, 2.0 / 3, 2.0 / 3, 2.0 / 3, -1.0 / 3, -1.0 / 3, 2.0 / 3, 2.0 / 3};
    return {
        {"tetrahedron", tetrahedron(), true},
        {"box", box({-1, -2, -0.5}, {1, 2, 0.75}), true},
        {"sphere", sphere({0.1, 0.2, 0.3}, 1.0, 3), true},
        {"torus", torus(1.0, 0.35, 48, 20), true},
        {"twisted_knot", twisted_knot(160, 18), true},
        {"hollow_sphere", hollow_sphere(3), true},
        {"overlapping_spheres", overlapping_spheres(3), true},
        {"sheet", sheet(12), false},
        {"moebius_strip", moebius_strip(40), false},
        {"soup", soup(200, 7), false},
        {"plate_0.01", plate(0.01), true},
        {"plate_1e-4", plate(1e-4), true},
        {"single_triangle", single_triangle(), false},
        {"degenerate", degenerate(), false},
        {"turned_box", transformed(box({0, 0, 0}, {1, 2, 3}), turn, {0.3, -0.2, 0.1}, 0.5), true},
        {"far_torus", transformed(torus(1.0, 0.35, 24, 12), turn, {1000, -2000, 500}, 1.0), true},
        {"tiny_sphere", transformed(sphere({0, 0, 0}, 1.0, 2), turn, {0, 0, 0}, 1e-6), true},
        {"inside_out_sphere", reversed(sphere({0, 0, 0}, 1.0, 2)), true},
        {"shuffled_torus", shuffled(torus(1.0, 0.35, 24, 12), 5), true},
    };
}

std::vector<std::string> real_mesh_files() {
    const char* folder = std::getenv("ITS_TEST_MESHES");
    if (folder == nullptr || *folder == '\0') return {};
    std::ifstream manifest(std::filesystem::path(folder) / "MANIFEST.tsv");
    std::vector<std::string> files;
    std::size_t name = 0, status = 0;
    for (std::string line; std::getline(manifest, line);) {
        std::vector<std::string> fields;
        std::istringstream stream(line);
        for (std::string field; std::getline(stream, field, '\t');) fields.push_back(field);
        if (name == status) {  // the heading
            for (std::size_t i = 0; i < fields.size(); ++i) {
                if (fields[i] == "file") name = i;
                if (fields[i] == "status") status = i;
            }
        } else if (fields.size() > std::max(name, status) && fields[status] == "ok") {
            files.push_back((std::filesystem::path(folder) / fields[name]).string());
        }
    }
    return files;
}

}  // namespace its::zoo
