#include <limits>

#include "mesh/readers.h"
#include "mesh/text.h"

namespace its {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// "v x y z [w | r g b]"; what is missing or no number is NaN, so that later indices stay right.
void read_vertex(Text& text, MeshBuilder& mesh) {
    Vec3 position{nan, nan, nan};
    for (int axis = 0; axis < 3; ++axis) {
        text.skip_blanks();
        const auto value = text.number();
        if (!value) break;
        position[axis] = *value;
    }
    mesh.add_vertex(position);
}

/// "f v v/vt v//vn v/vt/vn …"; negative numbers count back from the last vertex so far. Numbers of texture
/// coordinates and normals are not looked at.
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
        if (after == '/') text.word();
        const auto count = std::int64_t(mesh.vertex_count());
        mesh.add_corner(*index > 0 ? *index - 1 : *index < 0 && *index >= -count ? count + *index : -1);
    }
    mesh.end_face();
}

}  // namespace

MeshFile parse_obj(std::string_view bytes) {
    MeshBuilder mesh(bytes.size());
    Text text(bytes);
    std::uint64_t free_form = 0;
    for (; !text.at_end(); text.skip_line()) {
        text.skip_blanks();
        const std::string_view keyword = text.word();
        if (keyword == "v") {
            read_vertex(text, mesh);
        } else if (keyword == "f" || keyword == "fo") {
            read_face(text, mesh);
        } else if (keyword == "surf") {
            ++free_form;
        }
    }
    if (free_form > 0) mesh.warn("free-form surfaces are not read: only polygons");
    return mesh.finish("obj");
}

}  // namespace its
