#include "picture/plot.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/parallel.h"
#include "geometry/trilinear.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "shell/access.h"

namespace its::picture {
namespace {

constexpr std::uint64_t rows_per_chunk = 16;

/// The least slope that contours are drawn with: they have their width wherever f is steeper than this.
constexpr double flat = 0.01;

/// Cells fade out where they become as small as a few pixels: lines that fill the plane would hide it.
double fading(double pixels) {
    return std::clamp((pixels - 3) / 6, 0.0, 1.0);
}

Coverage draw_cells(const std::vector<CellSection>& cells, const View& view, const PlotStyle& style) {
    Coverage coverage(view.rect.width, view.rect.height);
    if (style.cell_alpha == 0) return coverage;
    for (const CellSection& cell : cells) {
        const double strength = fading(cell.width / view.pixel);
        if (strength == 0) continue;
        Point2 from = view.to_pixels(cell.corner[std::size_t(cell.corners) - 1]);
        for (int i = 0; i < cell.corners; ++i) {
            const Point2 to = view.to_pixels(cell.corner[std::size_t(i)]);
            coverage.line({from, to}, style.cell_width, strength);
            from = to;
        }
    }
    return coverage;
}

Coverage draw_section(const std::vector<Segment>& section, const View& view, double width) {
    Coverage coverage(view.rect.width, view.rect.height);
    for (const Segment& s : section) coverage.line({view.to_pixels(s.a), view.to_pixels(s.b)}, width);
    return coverage;
}

/// ThinShell::value(), for points that are near each other: what is known around the last one is kept.
class Probe {
public:
    explicit Probe(const shell::ShellData& shell) : shell_(shell) {}

    double value(const Vec3& point) {
        const Vec3 u = shell_.lattice.to_lattice(point);
        const double cells = shell_.lattice.cells();
        const Vec3 in{std::clamp(u.x, 0.0, cells), std::clamp(u.y, 0.0, cells), std::clamp(u.z, 0.0, cells)};
        if (!known(in)) look_up(in);
        const Vec3 local = (1 / cell_.width) * (in - cell_.corner);
        return shell_.lattice.width * (geometry::trilinear(cell_.value, local) + norm(u - in));
    }

private:
    bool known(const Vec3& u) const {
        return u.x >= low_.x && u.x < low_.x + side_ && u.y >= low_.y && u.y < low_.y + side_ &&
               u.z >= low_.z && u.z < low_.z + side_;
    }
    /// Where locate() stops above the finest level, it has seen that no finer hat reaches into the eighth of
    /// its cell that holds the point: there, but not in all of the cell, f is the cell's function.
    void look_up(const Vec3& u) {
        cell_ = field::locate(shell_.octree, shell_.field, u);
        side_ = cell_.width > 1 ? 0.5 * cell_.width : 1.0;
        for (int axis = 0; axis < 3; ++axis)
            low_[axis] = cell_.corner[axis] + side_ * std::floor((u[axis] - cell_.corner[axis]) / side_);
    }

    const shell::ShellData& shell_;
    field::TrilinearCell cell_{};
    Vec3 low_;
    double side_ = 0;  // nothing is known yet
};

/// f at the centres of the pixels of rows [begin − 1, end + 1) and columns [−1, width + 1).
class Samples {
public:
    Samples(const ThinShell& shell, const Plane& plane, const View& view, int begin, int end)
        : begin_(begin - 1), stride_(view.rect.width + 2) {
        Probe f(shell::Access::data(shell));
        value_.reserve(std::size_t(end + 1 - begin_) * std::size_t(stride_));
        for (int y = begin_; y < end + 1; ++y)
            for (int x = -1; x <= view.rect.width; ++x)
                value_.push_back(f.value(plane.lift(view.to_plane({x + 0.5, y + 0.5}))));
    }
    double at(int x, int y) const {
        return value_[std::size_t(y - begin_) * std::size_t(stride_) + std::size_t(x + 1)];
    }
    /// How much f changes over the pixel; where it is flat, a small part of what a distance would change by.
    double slope(int x, int y, double pixel) const {
        const double dx = at(x + 1, y) - at(x - 1, y), dy = at(x, y + 1) - at(x, y - 1);
        return std::max(0.5 * std::hypot(dx, dy), flat * pixel);
    }

private:
    int begin_, stride_;
    std::vector<double> value_;
};

/// The colour of f at a pixel with the shell and contours over it.
class FieldPainter {
public:
    FieldPainter(const ShellInfo& info, const View& view, const PlotStyle& style, const DivergingMap& colours)
        : info_(info), view_(view), style_(style), colours_(colours) {}

    Rgb operator()(const Samples& f, int x, int y) const {
        const double value = f.at(x, y), slope = f.slope(x, y, view_.pixel);
        Rgb colour = colours_(signed_root(value / style_.range));
        if (style_.contour_step > 0) {
            const double nearest = style_.contour_step * std::round(value / style_.contour_step);
            if (nearest != 0) colour = mix(colour, mesh_colour, 0.16 * line(value, slope, nearest, 1));
        }
        colour = mix(colour, shell_colour,
                     shell_alpha * band_coverage(value, slope, info_.epsilon_inner, info_.epsilon_outer));
        return colour;
    }

    Rgb contours(Rgb colour, const Samples& f, int x, int y) const {
        const double value = f.at(x, y), slope = f.slope(x, y, view_.pixel);
        const bool has_inside = info_.sign != SignRule::unsigned_rule;
        const double width = style_.contour_width;
        if (has_inside) colour = mix(colour, zero_colour, line(value, slope, 0, width));
        if (has_inside && info_.epsilon_inner < 0)
            colour = mix(colour, inner_colour, line(value, slope, info_.epsilon_inner, width));
        return mix(colour, outer_colour, line(value, slope, info_.epsilon_outer, width));
    }

private:
    static double line(double f, double slope, double level, double width) {
        return band_coverage(f, slope, level - 0.5 * width * slope, level + 0.5 * width * slope);
    }

    const ShellInfo& info_;
    const View& view_;
    const PlotStyle& style_;
    const DivergingMap& colours_;
};

}  // namespace

View make_view(const PixelRect& rect, const Point2& centre, double width) {
    const double pixel = width / rect.width;
    return {rect, {centre.x - 0.5 * width, centre.y + 0.5 * rect.height * pixel}, pixel};
}

double band_coverage(double f, double slope, double lower, double upper) {
    const double covered = std::min(f + 0.5 * slope, upper) - std::max(f - 0.5 * slope, lower);
    return std::clamp(covered / slope, 0.0, 1.0);
}

void plot(Image& image, const ThinShell& shell, const Plane& plane, const std::vector<Segment>& section,
          const std::vector<CellSection>& cells, const View& view, const PlotStyle& style,
          const DivergingMap& colours) {
    const Coverage grid = draw_cells(cells, view, style);
    const Coverage mesh = draw_section(section, view, style.mesh_width);
    const FieldPainter painter(shell.info(), view, style, colours);
    const PixelRect& rect = view.rect;
    for_chunks(std::uint64_t(rect.height), rows_per_chunk,
               [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
                   const Samples f(shell, plane, view, int(begin), int(end));
                   for (int y = int(begin); y < int(end); ++y)
                       for (int x = 0; x < rect.width; ++x) {
                           Rgb colour = painter(f, x, y);
                           colour = mix(colour, cell_colour, style.cell_alpha * grid.at(x, y));
                           colour = painter.contours(colour, f, x, y);
                           set_pixel(image, rect.x + x, rect.y + y, mix(colour, mesh_colour, mesh.at(x, y)));
                       }
               });
}

}  // namespace its::picture
