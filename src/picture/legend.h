#pragma once

#include <string>

#include "picture/plot.h"
#include "picture/text.h"

/// Everything around the plots: text, axes, colour bar, key.
namespace its::picture {

inline constexpr Rgb ink = {32, 34, 38}, pale_ink = {110, 115, 124}, hairline = {205, 208, 213},
                     paper = {255, 255, 255};

/// Draws text and lines in units of a thousandth of the plot's longer side.
struct Pen {
    Image& image;
    Typesetter& type;
    double unit;  ///< pixels

    int pixels(double units) const;
    /// A hairline from the left to the right end of a column; coordinates in pixels.
    void rule(double x, double y, double width) const;
};

/// How a plane is described in a picture.
struct PlaneText {
    std::string right, up;  ///< names of the picture's axes
    std::string title;      ///< "f on the plane z = 0.25, at 50 % of the extent"
    std::string normal;     ///< "(0.5, 0.5, 0.7071)", or nothing if the title says it
};

/// Ticks and coordinates along the left and lower side of a plot.
void draw_axes(const Pen& pen, const View& view, const PlaneText& text);

/// Title and table of facts; returns the y below it. x, y, width: the column, in pixels.
double draw_facts(const Pen& pen, const ShellInfo& info, const PlaneText& text, double x, double y,
                  double width);

/// The height that draw_facts() takes, in units.
double facts_height(const PlaneText& text);

/// The colour bar for |f| ≤ range·s; returns the y below it.
double draw_colour_bar(const Pen& pen, const DivergingMap& colours, bool has_inside, double range, double x,
                       double y, double width);

/// What the lines are; returns the y below it.
double draw_key(const Pen& pen, const ShellInfo& info, double x, double y, double width);

}  // namespace its::picture
