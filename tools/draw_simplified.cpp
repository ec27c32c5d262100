// Draws a mesh, and what quadrics alone and ITS make of it at the same number of triangles: the paper's
// figures.
//   draw_simplified MESH FACES OUT.png [UP [AZIMUTH]]      UP: x, y or z (default y); degrees (default 30)
// Results are drawn without smoothing. The distance of a triangle from the mesh is measured at 15 points of it.

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "display/colour.h"
#include "distance/closest_point.h"
#include "geometry/vec3.h"
#include "its/distance.h"
#include "its/mesh_file.h"
#include "its/picture.h"
#include "its/simplify.h"
#include "main.h"
#include "mesh/normals.h"
#include "picture/camera.h"
#include "picture/canvas.h"
#include "picture/text.h"
#include "picture/tracer.h"

namespace {

using namespace its;

constexpr int width = 1600, panel_height = 720, foot = 130, samples = 64;
constexpr double elevation = 14, crease = 40;  // degrees
constexpr double margin = 0.08;
constexpr display::Rgb mesh_paint = {216, 211, 202}, near_paint = {196, 206, 214}, warm_paint = {240, 190, 90},
                       far_paint = {206, 60, 52}, ink = {30, 32, 36}, pale_ink = {100, 104, 112};

Box bounds_of(const Mesh& mesh) {
    Box box{mesh.vertices[mesh.triangles[0][0]], mesh.vertices[mesh.triangles[0][0]]};
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            for (int i = 0; i < 3; ++i) {
                box.min[i] = std::min(box.min[i], mesh.vertices[v][i]);
                box.max[i] = std::max(box.max[i], mesh.vertices[v][i]);
            }
    return box;
}

/// Into the unit box around the origin, z upwards.
Mesh to_scene(Mesh mesh, const Box& box, int up) {
    const Vec3 size = box.max - box.min;
    const double scale = 1 / std::max({size.x, size.y, size.z});
    for (Vec3& v : mesh.vertices) {
        const Vec3 p = scale * (v - 0.5 * (box.min + box.max));
        v = {p[(up + 1) % 3], p[(up + 2) % 3], p[up]};
    }
    return mesh;
}

double distance_of(const Mesh& mesh, const Triangle& t, const distance::ClosestPointTree& tree) {
    constexpr int steps = 4;
    double worst = 0;
    for (int i = 0; i <= steps; ++i)
        for (int j = 0; i + j <= steps; ++j) {
            const double a = double(i) / steps, b = double(j) / steps;
            const Vec3 p =
                a * mesh.vertices[t[0]] + b * mesh.vertices[t[1]] + (1 - a - b) * mesh.vertices[t[2]];
            worst = std::max(worst, tree.find(p).squared);
        }
    return std::sqrt(worst);
}

picture::Body make_body(Mesh mesh, double smooth_below, const display::Rgb& paint) {
    picture::Body body{std::move(mesh), {}, {}, picture::to_light(paint)};
    if (!body.mesh.triangles.empty()) body.bounds = bounds_of(body.mesh);
    body.normals = mesh::vertex_normals(body.mesh.vertices, body.mesh.triangles, smooth_below);
    return body;
}

/// The triangles by how far they are: within half the bound, within the bound, beyond.
std::vector<picture::Body> by_distance(const Mesh& mesh, const Mesh& input, double bound) {
    const distance::ClosestPointTree tree(input.vertices, input.triangles);
    std::vector<Mesh> parts(3, Mesh{mesh.vertices, {}});
    for (const Triangle& t : mesh.triangles) {
        const double d = distance_of(mesh, t, tree);
        parts[d <= 0.5 * bound ? 0 : d <= bound ? 1 : 2].triangles.push_back(t);
    }
    return {make_body(parts[0], 0, near_paint), make_body(parts[1], 0, warm_paint),
            make_body(parts[2], 0, far_paint)};
}

struct Panel {
    std::string title, text;
    std::vector<picture::Body> bodies;
};

std::string describe(const Mesh& mesh, const Mesh& input, double diagonal) {
    const double far = std::max(mesh_distance(mesh, input).max, mesh_distance(input, mesh).max);
    return fmt::format("{} triangles, Hausdorff distance {:.5f}", mesh.triangles.size(), far / diagonal);
}

void write_key(Image& image, picture::Typesetter& type) {
    double x = 60;
    const double y = panel_height + foot - 22, size = 20;
    for (const auto& [paint, text] : {std::pair{near_paint, "within half the distance that is proven for ITS"},
                                      std::pair{warm_paint, "within that distance"},
                                      std::pair{far_paint, "farther (relative to the diagonal)"}}) {
        picture::fill(image, {int(x), int(y) - 15, 16, 16}, paint);
        type.write(image, text, {x + 26, y}, size, pale_ink);
        x += 26 + type.width(text, size) + 50;
    }
}

void draw(const std::string& path, std::uint64_t faces, const std::string& out, int up, double azimuth) {
    const Mesh file = read_mesh(path).mesh;
    const Mesh input = to_scene(file, bounds_of(file), up);
    const Box box = bounds_of(input);
    const double diagonal = norm(box.max - box.min);
    const Simplified ours = simplify(input, {.faces = faces});
    const Simplified quadrics = simplify(input, {.method = SimplifyMethod::qem, .faces = faces});
    const double bound = *ours.report.proven_bound;
    std::vector<Panel> panels(3);
    panels[0] = {"Input", fmt::format("{} triangles", input.triangles.size()), {}};
    panels[0].bodies.push_back(make_body(input, crease, mesh_paint));
    panels[1] = {"Quadric errors alone", describe(quadrics.mesh, input, diagonal),
                 by_distance(quadrics.mesh, input, bound)};
    panels[2] = {fmt::format("ITS, proven within {:.5f}", bound / diagonal),
                 describe(ours.mesh, input, diagonal), by_distance(ours.mesh, input, bound)};

    Image image{width, panel_height + foot,
                std::vector<std::uint8_t>(std::size_t(3) * width * (panel_height + foot), 255)};
    picture::Typesetter type;
    const double key = (azimuth - 50) * std::numbers::pi / 180, tangent = 1.3;
    const picture::Camera camera = picture::orbit_camera(azimuth, elevation);
    const picture::Footprint print = picture::footprint(camera, input);
    const Vec3 light = (1 / std::hypot(1, tangent)) * Vec3{std::cos(key), std::sin(key), tangent};
    for (int i = 0; i < 3; ++i) {
        const picture::PixelRect rect{i * width / 3, 0, width / 3, panel_height};
        std::vector<picture::Exhibit> exhibits;
        for (const picture::Body& body : panels[i].bodies)
            if (!body.mesh.triangles.empty()) exhibits.push_back({&body, {}, {}});
        picture::draw_studio(image, rect, picture::Studio(exhibits, light, box.min.z, 1.7),
                             picture::fit(camera, print, rect, margin), samples, {}, "draw");
        const double x = rect.x + 0.5 * rect.width;
        type.write(image, panels[i].title, {x, panel_height + 24.0}, 26, ink, picture::Weight::medium,
                   picture::Align::centre);
        type.write(image, panels[i].text, {x, panel_height + 56.0}, 20, pale_ink, picture::Weight::regular,
                   picture::Align::centre);
    }
    write_key(image, type);
    write_png(image, out);
}

int run(int argc, char** argv) {
    if (argc < 4) throw OptionError("a mesh, a number of faces and a picture are needed");
    const std::string up = argc > 4 ? argv[4] : "y";
    if (up != "x" && up != "y" && up != "z") throw OptionError("UP must be x, y or z");
    draw(argv[1], std::stoull(argv[2]), argv[3], up[0] - 'x', argc > 5 ? std::stod(argv[5]) : 30);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv, "draw_simplified MESH FACES OUT.png [UP [AZIMUTH]]", run);
}
