#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "display/numbers.h"
#include "its/inspect.h"
#include "its/memory.h"
#include "its/picture.h"
#include "its/surface.h"
#include "mesh/normals.h"
#include "picture/legend.h"
#include "picture/text.h"
#include "picture/tracer.h"
#include "shell/shell_data.h"

namespace its {
using namespace picture;

namespace {

// Layout, in units of a thousandth of the picture's width; labels stand in the lower part of each panel.
constexpr double picture_height = 600, text_size = 16, margin = 26, label_height = 62;
constexpr double min_unit = 0.7;       // smaller type could not be read
constexpr double frame_margin = 0.09;  // around a body in its panel
constexpr double floor_reach = 1.7;    // of s; shadows fade out there

constexpr double crease = 40;          // degrees; sharper edges are drawn sharp
constexpr double contour_step = 0.02;  // of s, on the innermost cut
constexpr double field_range = 0.25;   // of s, the strongest colour there
/// The cuts are this far apart, of the outer surface's extent; the outermost removes most.
constexpr double step = 0.2;

constexpr double key_azimuth = 50, key_height = 1.3;  // of the key light: degrees left of the camera; tangent

constexpr Rgb outer_paint = {224, 108, 96}, mesh_paint = {216, 211, 202}, inner_paint = {82, 132, 204};
constexpr Rgb shell_paint = {255, 214, 92};

double radians(double degrees) {
    return degrees * std::numbers::pi / 180;
}

void check(const RenderOptions& o) {
    const auto require = [](bool right, const std::string& message) {
        if (!right) throw OptionError(message);
    };
    require(o.width >= 256 && o.width <= 8192, fmt::format("width {}: must be 256 to 8192 pixels", o.width));
    require(o.up >= 0 && o.up <= 2, fmt::format("upward axis {}: must be 0, 1 or 2", o.up));
    require(std::isfinite(o.azimuth), "the azimuth must be finite");
    require(o.elevation >= 0 && o.elevation <= 80,
            fmt::format("elevation {}: must be 0 to 80 degrees", o.elevation));
    require(std::isfinite(o.cut), "the direction of the cuts must be finite");
    require(o.at >= 0 && o.at <= 1, fmt::format("position {} of the cuts: must be 0 to 1", o.at));
    require(o.samples >= 1 && o.samples <= 4096, fmt::format("samples {}: must be 1 to 4096", o.samples));
    require_threads(o.run.threads);
}

/// Between the mesh's coordinates and the scene's: units of s, centred, z upwards.
struct Frame {
    Vec3 centre;
    double scale = 1;
    int up = 2;

    Vec3 to_scene(const Vec3& p) const {
        Vec3 q;
        for (int i = 0; i < 3; ++i) q[i] = (p[axis(i)] - centre[axis(i)]) / scale;
        return q;
    }
    Vec3 to_mesh(const Vec3& q) const {
        Vec3 p;
        for (int i = 0; i < 3; ++i) p[axis(i)] = centre[axis(i)] + scale * q[i];
        return p;
    }

private:
    /// A cyclic shift, which keeps right-handed axes right-handed.
    int axis(int scene_axis) const { return (scene_axis + up + 1) % 3; }
};

Body make_body(const Mesh& mesh, const Frame& frame, const Rgb& paint) {
    Body body{mesh, {}, {}, to_light(paint)};
    for (Vec3& v : body.mesh.vertices) v = frame.to_scene(v);
    if (!mesh.triangles.empty()) body.bounds = octree::bounds(body.mesh);
    body.normals = mesh::vertex_normals(body.mesh.vertices, body.mesh.triangles, crease);
    return body;
}

/// Everything that is drawn.
struct Model {
    const ThinShell& shell;
    Frame frame;
    Body outer, mesh, inner;
    double outer_level, inner_level;

    double value(const Vec3& scene_point) const { return shell.value(frame.to_mesh(scene_point)); }
    bool has_inside() const { return shell.info().sign != SignRule::unsigned_rule; }
};

/// Whether a point is in the solid mesh. f tells outside of the shell; within it, the side of the next
/// triangle.
bool inside_mesh(const Model& model, const RayScene& mesh, const Vec3& point, const Vec3& direction) {
    const double f = model.value(point);
    const ShellInfo& info = model.shell.info();
    if (f > info.epsilon_outer || !model.has_inside()) return false;
    if (f < info.epsilon_inner || info.sign != SignRule::winding) return f <= 0;
    const auto hit = mesh.nearest({point, direction});
    return hit && dot(mesh::area_vector(model.mesh.mesh.vertices, model.mesh.mesh.triangles[hit->triangle]),
                      direction) > 0;
}

/// The bodies, each cut a step further than the one in it.
std::vector<Exhibit> cut_open(const Model& model, const RayScene& mesh, const RenderOptions& options) {
    const double angle = radians(options.azimuth - options.cut);
    const Vec3 n{std::cos(angle), std::sin(angle), 0};
    const Extent extent = extent_along(model.outer.mesh, n);
    const auto limit = [&](int steps) { return std::lerp(extent.low, extent.high, options.at + steps * step); };
    const Light shell_light = to_light(shell_paint);
    const auto outer_face = [&model, shell_light](const Vec3& p, double) -> std::optional<Light> {
        if (model.value(p) > model.outer_level) return std::nullopt;
        return shell_light;
    };
    const auto mesh_face = [&model, &mesh, n, shell_light](const Vec3& p, double) -> std::optional<Light> {
        if (!inside_mesh(model, mesh, p, -1 * n)) return std::nullopt;
        return 0.86 * shell_light;
    };
    const auto inner_face = [&model, colours = DivergingMap()](const Vec3& p,
                                                               double pixel) -> std::optional<Light> {
        const double f = model.value(p), s = model.shell.info().scale;
        if (f > model.inner_level) return std::nullopt;
        const Light light = to_light(colours(signed_root(f / (field_range * s))));
        const double nearest = contour_step * std::round(f / s / contour_step);
        const bool on_line = nearest < 0 && std::abs(f / s - nearest) < 0.6 * pixel;
        return on_line ? 0.72 * light : light;
    };
    std::vector<Exhibit> exhibits = {{&model.outer, {n, limit(-1)}, outer_face},
                                     {&model.mesh, {n, limit(0)}, mesh_face}};
    if (!model.inner.mesh.triangles.empty()) exhibits.push_back({&model.inner, {n, limit(1)}, inner_face});
    return exhibits;
}

/// One picture in the picture, with what is written below it.
struct Panel {
    PixelRect rect;
    std::vector<Exhibit> exhibits;
    std::string title, text;
    Rgb paint;
};

/// The large panel and three small ones: beside each other if the body is tall, else in a column.
std::array<PixelRect, 4> layout(int width, int height, const Footprint& f) {
    const bool tall = f.y.high - f.y.low > 1.05 * (f.x.high - f.x.low);
    const int side = int(std::lround((tall ? 0.19 : 0.33) * width));
    const int main = width - (tall ? 3 : 1) * side, third = height / 3;
    std::array<PixelRect, 4> rects = {PixelRect{0, 0, main, height}};
    for (int i = 0; i < 3; ++i)
        rects[std::size_t(i) + 1] =
            tall ? PixelRect{main + i * side, 0, side, height} : PixelRect{main, i * third, side, third};
    return rects;
}

std::string triangles_text(const Mesh& mesh) {
    return count_text(mesh.triangles.size()) + " triangles";
}

std::string level_text(const char* epsilon, double value) {
    return fmt::format("{} = {}", epsilon, number_text(value, 3));
}

void write_label(const Pen& pen, const Panel& panel) {
    const double size = text_size * pen.unit;
    const double x = panel.rect.x + 0.5 * panel.rect.width,
                 y = panel.rect.y + panel.rect.height - margin * pen.unit;
    pen.type.write(pen.image, panel.title, {x, y - 1.35 * size}, size, ink, Weight::medium, Align::centre);
    pen.type.write(pen.image, panel.text, {x, y}, 0.9 * size, pale_ink, Weight::regular, Align::centre);
}

/// What the colours of the large panel are, in a row with even gaps.
void write_key(const Pen& pen, const Panel& panel, const std::vector<std::pair<const char*, Rgb>>& entries) {
    const double size = text_size * pen.unit, chip = 0.8 * size, space = 0.45 * size, gap = 1.3 * size;
    double x = panel.rect.x + margin * pen.unit;
    const double y = panel.rect.y + panel.rect.height - margin * pen.unit;
    for (const auto& [text, paint] : entries) {
        fill(pen.image, {int(std::lround(x)), int(std::lround(y - 1.35 * size - chip)), int(chip), int(chip)},
             paint);
        x += chip + space;
        pen.type.write(pen.image, text, {x, y - 1.35 * size}, size, ink, Weight::medium);
        x += pen.type.width(text, size, Weight::medium) + gap;
    }
    pen.type.write(pen.image, panel.text, {panel.rect.x + margin * pen.unit, y}, 0.9 * size, pale_ink);
}

/// For each cell that a surface runs through: two surfaces, whole and cut open, with what rays need.
constexpr double bytes_per_cell = 720, bytes_per_triangle = 330, base_bytes = 5e6;

void check_memory(const ThinShell& shell, const RenderOptions& options) {
    const ShellInfo& info = shell.info();
    const double ratio = options.resolution > 0 ? std::ldexp(double(options.resolution), -info.depth) : 1.0;
    const double bytes = base_bytes + bytes_per_cell * double(info.surface_cells) * ratio * ratio +
                         bytes_per_triangle * double(info.mesh_triangles);
    require_memory(std::uint64_t(std::min(bytes, 1e18)), options.max_memory, "the picture",
                   "choose a smaller resolution of its surfaces");
}

Model make_model(const ThinShell& shell, const RenderOptions& options, Parts& parts) {
    check_memory(shell, options);
    const ShellInfo& info = shell.info();
    const Frame frame{0.5 * (info.root.min + info.root.max), info.scale, options.up};
    const auto surface = [&](SurfaceSide side, double until) {
        return extract_surface(shell,
                               {.side = side,
                                .resolution = options.resolution,
                                .max_memory = options.max_memory,
                                .run = {.threads = options.run.threads, .progress = parts.until(until)}});
    };
    const Surface outer = surface(SurfaceSide::outer, 0.1), inner = surface(SurfaceSide::inner, 0.2);
    return {shell,
            frame,
            make_body(outer.mesh, frame, outer_paint),
            make_body(shell.mesh(), frame, mesh_paint),
            make_body(inner.mesh, frame, inner_paint),
            outer.report.level,
            inner.report.level};
}

std::vector<std::pair<const char*, Rgb>> key_entries(const Model& model) {
    std::vector<std::pair<const char*, Rgb>> entries = {
        {"shell", shell_paint}, {"mesh", mesh_paint}, {"outer", outer_paint}};
    if (!model.inner.mesh.triangles.empty()) entries.insert(entries.begin(), {"inner", inner_paint});
    return entries;
}

std::vector<Panel> make_panels(const Model& model, const RayScene& mesh, const RenderOptions& options,
                               const std::array<PixelRect, 4>& rects) {
    const ShellInfo& info = model.shell.info();
    const bool has_inner = !model.inner.mesh.triangles.empty();
    const auto alone = [](const Body& body) { return std::vector<Exhibit>{{&body, {}, {}}}; };
    std::vector<Panel> panels(4);
    panels[0] = {rects[0], cut_open(model, mesh, options), "",
                 fmt::format("Depth {} · shell {} of the longest side thick", info.depth,
                             number_text(info.thickness() / info.scale, 3)),
                 paper};
    panels[1] = {rects[1], has_inner ? alone(model.inner) : std::vector<Exhibit>{},
                 has_inner ? "Inner surface" : "No inner surface",
                 has_inner ? level_text("f", model.inner_level) + " · " + triangles_text(model.inner.mesh)
                 : model.has_inside() ? "at this depth"
                                      : "the mesh has no inside",
                 inner_paint};
    panels[2] = {rects[2], alone(model.mesh), "Mesh", triangles_text(model.mesh.mesh), mesh_paint};
    panels[3] = {rects[3], alone(model.outer), "Outer surface",
                 level_text("f", model.outer_level) + " · " + triangles_text(model.outer.mesh), outer_paint};
    return panels;
}

Image draw(const Model& model, const RenderOptions& options, Parts& parts) {
    RayScene mesh_rays;
    mesh_rays.add(model.mesh.mesh);
    mesh_rays.commit();
    const int width = options.width, height = int(std::lround(picture_height / 1000 * width));
    Image image{width, height, std::vector<std::uint8_t>(3 * std::size_t(width) * std::size_t(height), 255)};
    Typesetter type;
    const Pen pen{image, type, std::max(width / 1000.0, min_unit)};

    const Camera camera = orbit_camera(options.azimuth, options.elevation);
    const Footprint print = footprint(camera, model.outer.mesh);
    const double floor = extent_along(model.outer.mesh, {0, 0, 1}).low;
    const double key = radians(options.azimuth - key_azimuth);
    const Vec3 key_light = (1 / std::hypot(1, key_height)) * Vec3{std::cos(key), std::sin(key), key_height};
    double done = 0.2;
    for (const Panel& panel : make_panels(model, mesh_rays, options, layout(width, height, print))) {
        PixelRect rect = panel.rect;
        rect.height -= int(label_height * pen.unit);
        const Studio studio(panel.exhibits, key_light, floor, floor_reach);
        Camera fitted = fit(camera, print, rect, frame_margin);
        draw_studio(image, panel.title.empty() ? panel.rect : rect, studio, fitted, options.samples,
                    parts.until(done += panel.title.empty() ? 0.5 : 0.1), "render");
        if (panel.title.empty()) {
            write_key(pen, panel, key_entries(model));
        } else {
            write_label(pen, panel);
        }
    }
    return image;
}

}  // namespace

Image render(const ThinShell& shell, const RenderOptions& options) {
    check(options);
    return run_call(options.run, "render", [&](const Progress& progress) {
        Parts parts(progress);
        const Model model = make_model(shell, options, parts);
        return draw(model, options, parts);
    });
}

}  // namespace its
