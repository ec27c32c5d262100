#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "display/numbers.h"
#include "its/inspect.h"
#include "its/picture.h"
#include "mesh/arrays.h"
#include "mesh/require.h"
#include "octree/lattice.h"
#include "picture/legend.h"
#include "picture/plot.h"
#include "picture/section.h"
#include "picture/text.h"
#include "shell/access.h"

namespace its {
using namespace picture;

namespace {

// Layout, in units of a thousandth of the plot's longer side; type would be too small to read below min_unit
// pixels.
constexpr double margin = 38, axis_space = 46, gap = 44, column_width = 410;
constexpr double min_inset_height = 240;
constexpr double min_unit = 0.56;

constexpr double surround = 0.09;         // of s, shown around the mesh
constexpr double min_aspect = 0.84;       // of the plot's shorter to its longer side
constexpr double colour_range = 0.5;      // of s: no inside is deeper
constexpr double contour_spacing = 0.05;  // of s

/// The inset shows this many thicknesses of the shell, or cells if that is more.
constexpr double inset_thicknesses = 5, inset_cells = 2.5;

void check(const SliceOptions& options) {
    if (options.normal && (!finite(*options.normal) || *options.normal == Vec3{}))
        throw OptionError("the normal of the plane must be finite and not zero");
    if (options.through && !finite(*options.through))
        throw OptionError("the point of the plane must be finite");

    if (options.axis < 0 || options.axis > 2)
        throw OptionError(fmt::format("axis {}: must be 0, 1 or 2", options.axis));
    if (!(options.at >= 0 && options.at <= 1))
        throw OptionError(fmt::format("position {} of the plane: must be 0 to 1", options.at));
    if (options.size < 64 || options.size > 8192)
        throw OptionError(fmt::format("size {}: must be 64 to 8192 pixels", options.size));
    require_threads(options.run.threads);
}

/// What the large plot shows: centre and sides, mesh units.
struct Window {
    Point2 centre;
    double width, height;
};

/// The plane that the options ask for.
/// \param extent  of the shell's mesh, along the plane's axes
Plane place(Plane plane, const Box& extent, const SliceOptions& options) {
    plane.offset =
        options.through ? plane.height(*options.through) : std::lerp(extent.min.z, extent.max.z, options.at);
    return plane;
}

/// The offset as text: what is below a millionth of the picture's width is rounding, and reads as 0.
std::string offset_text(double offset, const Box& extent) {
    const double width = std::max(extent.max.x - extent.min.x, extent.max.y - extent.min.y);
    return number_text(std::abs(offset) < 1e-6 * width ? 0.0 : offset);
}

PlaneText describe(const Plane& plane, const Box& extent, const SliceOptions& options) {
    constexpr std::string_view names[] = {"x", "y", "z"};
    const std::string at = options.through ? "" : fmt::format(", at {:.4g} % of the extent", 100 * options.at);
    const std::string offset = offset_text(plane.offset, extent);
    if (options.normal) {
        const auto& [x, y, z] = plane.normal;
        return {"u", "v", fmt::format("f on the plane n·x = {}{}", offset, at),
                fmt::format("({}, {}, {})", number_text(x), number_text(y), number_text(z))};
    }
    const int axis = options.axis;
    return {std::string(names[axis == 0]), std::string(names[axis == 2 ? 1 : 2]),
            fmt::format("f on the plane {} = {}{}", names[axis], offset, at), ""};
}

Window choose_window(const Box& extent, double scale) {
    const Vec3 &low = extent.min, &high = extent.max;
    Window window{{low.x + 0.5 * (high.x - low.x), low.y + 0.5 * (high.y - low.y)},
                  high.x - low.x + 2 * surround * scale,
                  high.y - low.y + 2 * surround * scale};
    window.width = std::max(window.width, min_aspect * window.height);
    window.height = std::max(window.height, min_aspect * window.width);
    return window;
}

/// The middle of a section's segment where f comes nearest to ε₁ or ε₂, at least `distance` from the window's
/// border.
std::optional<Point2> choose_inset(const ThinShell& shell, const Plane& plane,
                                   const std::vector<Segment>& section, const Window& window, double distance) {
    const ShellInfo& info = shell.info();
    std::optional<Point2> best;
    double highest = -1;
    for (const Segment& s : section) {
        const Point2 p{s.a.x + 0.5 * (s.b.x - s.a.x), s.a.y + 0.5 * (s.b.y - s.a.y)};
        if (std::abs(p.x - window.centre.x) > 0.5 * window.width - distance ||
            std::abs(p.y - window.centre.y) > 0.5 * window.height - distance)
            continue;
        const double f = shell.value(plane.lift(p));
        const double bound = f < 0 ? info.epsilon_inner : info.epsilon_outer;
        const double part = bound != 0 ? f / bound : 0;
        if (part > highest) highest = part, best = p;
    }
    return best;
}

struct Scene {
    const ThinShell& shell;
    Plane plane;
    std::vector<Segment> section;
    std::vector<CellSection> cells;
    DivergingMap colours;
};

/// A frame around the part of the plot that is magnified.
void draw_frame(const Pen& pen, const View& plot_view, const View& inset) {
    const Point2 a = plot_view.to_pixels(inset.to_plane({0, 0}));
    const Point2 b = plot_view.to_pixels(inset.to_plane({double(inset.rect.width), double(inset.rect.height)}));
    const double least = 5 * pen.unit;  // half a side: a smaller frame could not be seen
    const double half_x = std::max(0.5 * (b.x - a.x), least), half_y = std::max(0.5 * (b.y - a.y), least);
    const double x = plot_view.rect.x + 0.5 * (a.x + b.x), y = plot_view.rect.y + 0.5 * (a.y + b.y);
    const PixelRect frame{int(std::lround(x - half_x)), int(std::lround(y - half_y)),
                          int(std::lround(2 * half_x)), int(std::lround(2 * half_y))};
    const int line = pen.pixels(2);
    outline(pen.image, {frame.x - line, frame.y - line, frame.width + 2 * line, frame.height + 2 * line}, line,
            paper, 0.8);
    outline(pen.image, frame, line, ink);
}

void draw_inset(const Pen& pen, const Scene& scene, const Window& window, const View& main, PixelRect rect) {
    const ShellInfo& info = scene.shell.info();
    const double width = std::min(std::max(inset_thicknesses * info.thickness(), inset_cells * info.cell_width),
                                  0.5 * std::min(window.width, window.height));
    const auto centre = choose_inset(scene.shell, scene.plane, scene.section, window, 0.5 * width);
    const double x = rect.x, size = 16.5 * pen.unit;
    if (!centre) {
        pen.type.write(pen.image, "The plane does not cut the mesh.", {x, double(rect.y)}, size, pale_ink);
        return;
    }
    const double range = width;
    const View view = [&] {
        const int caption = pen.pixels(12);
        rect.y += caption, rect.height -= caption;
        return make_view(rect, *centre, width);
    }();
    pen.type.write(pen.image, fmt::format("The frame, magnified {:.3g} ×", main.pixel / view.pixel),
                   {x, rect.y - 12 * pen.unit}, size, ink, Weight::medium);
    pen.type.write(pen.image, fmt::format("colours to ±{} s", number_text(range / info.scale, 2)),
                   {x + rect.width, rect.y - 12 * pen.unit}, 15 * pen.unit, pale_ink, Weight::regular,
                   Align::right);
    PlotStyle style;
    style.range = range;
    style.contour_width = std::max(1.5, 2.2 * pen.unit);
    style.mesh_width = std::max(1.5, 2.6 * pen.unit);
    style.cell_width = pen.pixels(1);
    style.cell_alpha = 0.3;
    plot(pen.image, scene.shell, scene.plane, scene.section, scene.cells, view, style, scene.colours);
    outline(pen.image, rect, pen.pixels(2), ink);
    draw_frame(pen, main, view);
}

Image draw(const ThinShell& shell, const SliceOptions& options) {
    const ShellInfo& info = shell.info();
    const Plane facing = options.normal ? normal_plane(*options.normal) : axis_plane(options.axis);
    const Box box = extent(shell.mesh(), facing);
    const Plane plane = place(facing, box, options);
    const PlaneText text = describe(plane, box, options);
    const mesh::Native mesh(options.mesh ? *options.mesh : shell.mesh_view());
    mesh::require_usable(mesh);
    const Scene scene{shell,
                      plane,
                      mesh_section(mesh, plane, 0.5 * box.min.z + 0.5 * box.max.z),
                      cell_section(shell::Access::data(shell), plane),
                      {}};
    const Window window = choose_window(box, info.scale);

    const double unit = std::max(options.size / 1000.0, min_unit);
    const auto whole = [&](double units) { return int(std::lround(units * unit)); };
    const double longer = std::max(window.width, window.height);
    PixelRect rect{whole(margin + axis_space), whole(margin),
                   int(std::lround(options.size * window.width / longer)),
                   int(std::lround(options.size * window.height / longer))};
    const int column = rect.x + rect.width + whole(gap);

    // The column has all but the inset a fixed height, and the inset goes down to the plot's lower side.
    const double text_height = facts_height(text) + 10 + 16 + 52 + 28 + 12;
    const int height = std::max(rect.height, whole(text_height + min_inset_height));
    rect.y += (height - rect.height) / 2;
    Image image{
        column + whole(column_width + margin), whole(margin) + height + whole(axis_space + 0.5 * margin), {}};
    image.rgb.assign(3 * std::size_t(image.width) * std::size_t(image.height), 255);

    Typesetter type;
    const Pen pen{image, type, unit};
    PlotStyle style;
    style.range = colour_range * info.scale;
    style.contour_step = contour_spacing * info.scale;
    style.contour_width = style.mesh_width = std::max(1.25, 1.5 * unit);
    style.cell_alpha = options.cells ? 0.35 : 0;
    const View view = make_view(rect, window.centre, window.width);
    plot(image, shell, plane, scene.section, scene.cells, view, style, scene.colours);
    outline(image, rect, pen.pixels(1), pale_ink);
    draw_axes(pen, view, text);

    const double x = column, width = column_width * unit;
    const bool has_inside = info.sign != SignRule::unsigned_rule;
    double y = draw_facts(pen, info, text, x, margin * unit, width);
    y = draw_colour_bar(pen, scene.colours, has_inside, colour_range, x, y, width);
    y = draw_key(pen, info, x, y, width);
    const int top = int(std::lround(y + 8 * unit));
    draw_inset(pen, scene, window, view, {column, top, int(width), whole(margin) + height - top});
    return image;
}

}  // namespace

Image slice(const ThinShell& shell, const SliceOptions& options) {
    check(options);
    return run_call(options.run, "slice", [&](const Progress&) { return draw(shell, options); });
}

}  // namespace its
