#pragma once

#include <vector>

#include "picture/canvas.h"
#include "picture/section.h"

/// Draws f, its contours, cells and the mesh's section into a rectangle of a picture.
namespace its::picture {

inline constexpr Rgb inner_colour = {21, 76, 148};  ///< f = ε₁
inline constexpr Rgb zero_colour = {32, 140, 84};   ///< f = 0
inline constexpr Rgb outer_colour = {172, 28, 44};  ///< f = ε₂
inline constexpr Rgb mesh_colour = {18, 18, 20};
inline constexpr Rgb cell_colour = {70, 74, 82};
inline constexpr Rgb shell_colour = {255, 226, 122};  ///< fills ε₁ ≤ f ≤ ε₂
inline constexpr double shell_alpha = 0.65;

/// The part of the plane that a rectangle shows: mesh units of its upper left corner, and of one pixel.
struct View {
    PixelRect rect;
    Point2 corner;
    double pixel = 1;

    Point2 to_plane(const Point2& p) const {  ///< from pixels within the rectangle
        return {corner.x + p.x * pixel, corner.y - p.y * pixel};
    }
    Point2 to_pixels(const Point2& p) const { return {(p.x - corner.x) / pixel, (corner.y - p.y) / pixel}; }
};

/// A view with `centre` in the middle of `rect` and `width` mesh units wide.
View make_view(const PixelRect& rect, const Point2& centre, double width);

struct PlotStyle {
    double range = 1;         ///< |f| of the strongest colour, mesh units
    double contour_step = 0;  ///< distance of the faint contours, mesh units; 0: none
    double contour_width = 1.5, mesh_width = 1.5, cell_width = 1;  ///< of lines, pixels
    double cell_alpha = 0;                                         ///< 0: no cells
};

/// The part of a pixel in which lower ≤ f ≤ upper, if f grows by `slope` ≥ 0 over the pixel and is `f` at its
/// centre.
double band_coverage(double f, double slope, double lower, double upper);

/// Draws into view.rect, in parallel; the same for any number of threads.
void plot(Image& image, const ThinShell& shell, const Plane& plane, const std::vector<Segment>& section,
          const std::vector<CellSection>& cells, const View& view, const PlotStyle& style,
          const DivergingMap& colours);

}  // namespace its::picture
