#include <array>
#include <limits>

#include "formats/readers.h"
#include "formats/text.h"
#include "its/mesh_file.h"

namespace its::formats {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The numbers up to the end of the line, at most N.
template <std::size_t N>
std::size_t read_numbers(Text& text, std::array<double, N>& numbers) {
    std::size_t count = 0;
    while (count < N) {
        text.skip_blanks();
        const auto value = text.number();
        if (!value) break;
        numbers[count++] = *value;
    }
    return count;
}

/// "v x y z [w | r g b [a]]"; what is missing or no number is NaN, so that later indices stay right.
void read_vertex(Text& text, MeshBuilder& mesh) {
    Vec3 position{nan, nan, nan};
    for (int axis = 0; axis < 3; ++axis) {
        text.skip_blanks();
        const auto value = text.number();
        if (!value) break;
        position[axis] = *value;
    }
    mesh.add_vertex(position);
    if (!mesh.wants_attributes()) return;
    std::array<double, 4> rest{0, 0, 0, MeshBuilder::opaque};
    const std::size_t count = read_numbers(text, rest);
    if (count < 3) return;
    mesh.set_text_colour(mesh.vertex_count() - 1,
                         {float(rest[0]), float(rest[1]), float(rest[2]), float(rest[3])});
}

/// A number of a texture coordinate or normal, if one is here: from 0, of `count` so far.
std::int64_t read_index(Text& text, std::size_t count) {
    const auto index = text.integer().value_or(0);
    return index > 0 ? index - 1 : index < 0 ? std::int64_t(count) + index : -1;
}

/// "/vt", "//vn" or "/vt/vn" of the corner added last. What is no number there is none.
void read_corner_attributes(Text& text, MeshBuilder& mesh) {
    text.advance();
    const std::int64_t texture = read_index(text, mesh.texture.size());
    if (texture >= 0) mesh.texture.set_corner(mesh.corner_count(), texture);
    if (text.peek() != '/') return;
    text.advance();
    const std::int64_t normal = read_index(text, mesh.normals.size());
    if (normal >= 0) mesh.normals.set_corner(mesh.corner_count(), normal);
}

/// "f v v/vt v//vn v/vt/vn …"; negative numbers count back from the last vertex so far.
void read_face(Text& text, MeshBuilder& mesh) {
    for (;;) {
        text.skip_blanks();
        if (text.at_line_end() || text.peek() == '#') break;
        const auto index = text.integer();
        const char after = text.peek();
        if (!index ||
            !(after == '/' || text.at_end() || Text::is_space(after) || after == '#' || after == '\\')) {
            mesh.drop_face();
            mesh.add_unreadable_face();
            return;
        }
        const auto count = std::int64_t(mesh.vertex_count());
        mesh.add_corner(*index > 0 ? *index - 1 : *index < 0 && *index >= -count ? count + *index : -1);
        if (after == '/') {
            if (mesh.wants_attributes()) read_corner_attributes(text, mesh);
            text.word();
        }
    }
    mesh.end_face();
}

}  // namespace

MeshFile parse_obj(std::string_view bytes, const ReadOptions& options) {
    MeshBuilder mesh(bytes.size(), options);
    mesh.texture.by_corner = mesh.normals.by_corner = true;
    bool materials = false;
    Text text(bytes);
    std::uint64_t free_form = 0;
    for (; !text.at_end(); text.skip_line()) {
        text.skip_blanks();
        const std::string_view keyword = text.word();
        if (keyword == "v") {
            read_vertex(text, mesh);
        } else if (keyword == "f" || keyword == "fo") {
            read_face(text, mesh);
        } else if (keyword == "vt" && options.attributes) {
            std::array<double, 2> uv{0, 0};
            read_numbers(text, uv);
            mesh.texture.add(uv);
        } else if (keyword == "vn" && options.attributes) {
            std::array<double, 3> n{0, 0, 0};
            read_numbers(text, n);
            mesh.normals.add({n[0], n[1], n[2]});
        } else if (keyword == "usemtl") {
            materials = true;
        } else if (keyword == "surf") {
            ++free_form;
        }
    }
    if (free_form > 0) mesh.warn("free-form surfaces are not read: only polygons");
    if (materials && options.attributes) mesh.warn_not_carried("materials and textures");
    return mesh.finish("obj");
}

}  // namespace its::formats
