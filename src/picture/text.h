#pragma once

#include <memory>
#include <string_view>

#include "picture/canvas.h"

namespace its::picture {

enum class Weight { regular, medium };
enum class Align { left, centre, right };

/// Writes text with the fonts that are built into the library. Not thread-safe.
class Typesetter {
public:
    Typesetter();
    ~Typesetter();
    Typesetter(const Typesetter&) = delete;
    Typesetter& operator=(const Typesetter&) = delete;

    /// UTF-8 text on the baseline y; `size` is that of the em square in pixels.
    void write(Image& image, std::string_view text, Point2 at, double size, const Rgb& colour,
               Weight weight = Weight::regular, Align align = Align::left);

    /// The width of the text in pixels.
    double width(std::string_view text, double size, Weight weight = Weight::regular);

private:
    struct Faces;
    std::unique_ptr<Faces> faces_;
};

}  // namespace its::picture
