#include "picture/text.h"

#include <ft2build.h>
#include FT_FREETYPE_H
#include FT_OUTLINE_H

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "picture/fonts.h"

namespace its::picture {
namespace {

/// The next code point of UTF-8 text that is known to be valid: all of it is ours or a number.
std::uint32_t next_code(std::string_view& text) {
    const auto lead = static_cast<unsigned char>(text.front());
    text.remove_prefix(1);
    const int more = lead < 0x80 ? 0 : lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
    std::uint32_t code = more == 0 ? lead : lead & (0x3fu >> more);
    for (int i = 0; i < more && !text.empty(); ++i) {
        code = code << 6 | (static_cast<unsigned char>(text.front()) & 0x3f);
        text.remove_prefix(1);
    }
    return code;
}

}  // namespace

struct Typesetter::Faces {
    FT_Library library = nullptr;
    std::array<FT_Face, 2> face = {};

    Faces() {
        require(FT_Init_FreeType(&library));
        const std::span<const unsigned char> files[] = {font_regular(), font_medium()};
        for (std::size_t i = 0; i < face.size(); ++i)
            require(FT_New_Memory_Face(library, files[i].data(), FT_Long(files[i].size()), 0, &face[i]));
    }
    ~Faces() {
        if (library) FT_Done_FreeType(library);  // and its faces
    }

    static void require(FT_Error error) {
        if (error) throw Error("the built-in font cannot be used; rebuild the library");
    }

    /// Calls glyph(face, x) for each character, its outline loaded, x from 0; returns the text's width.
    template <class Glyph>
    double walk(std::string_view text, double size, Weight weight, Glyph&& glyph) {
        const FT_Face f = face[weight == Weight::medium];
        require(FT_Set_Char_Size(f, 0, FT_F26Dot6(std::lround(64 * size)), 72, 72));
        double x = 0;
        while (!text.empty()) {
            // Unhinted outlines at fractions of a pixel keep the designer's spacing.
            require(FT_Load_Char(f, next_code(text), FT_LOAD_NO_HINTING | FT_LOAD_NO_BITMAP));
            glyph(f, x);
            x += double(f->glyph->linearHoriAdvance) / 65536;
        }
        return x;
    }
};

Typesetter::Typesetter() : faces_(std::make_unique<Faces>()) {}
Typesetter::~Typesetter() = default;

double Typesetter::width(std::string_view text, double size, Weight weight) {
    return faces_->walk(text, size, weight, [](FT_Face, double) {});
}

void Typesetter::write(Image& image, std::string_view text, Point2 at, double size, const Rgb& colour,
                       Weight weight, Align align) {
    double begin = at.x;
    if (align != Align::left) begin -= width(text, size, weight) * (align == Align::centre ? 0.5 : 1.0);
    const int baseline = int(std::lround(at.y));
    faces_->walk(text, size, weight, [&](FT_Face face, double x) {
        const double left = std::floor(begin + x);
        FT_Outline_Translate(&face->glyph->outline, FT_Pos(std::lround(64 * (begin + x - left))), 0);
        Faces::require(FT_Render_Glyph(face->glyph, FT_RENDER_MODE_NORMAL));
        const FT_Bitmap& bitmap = face->glyph->bitmap;
        for (int row = 0; row < int(bitmap.rows); ++row)
            for (int column = 0; column < int(bitmap.width); ++column) {
                const int px = int(left) + face->glyph->bitmap_left + column;
                const int py = baseline - face->glyph->bitmap_top + row;
                if (px < 0 || py < 0 || px >= image.width || py >= image.height) continue;
                const double alpha = bitmap.buffer[std::ptrdiff_t(row) * bitmap.pitch + column] / 255.0;
                set_pixel(image, px, py, mix(pixel(image, px, py), colour, alpha));
            }
    });
}

}  // namespace its::picture
