#include <fmt/format.h>

#include <array>
#include <limits>
#include <string>

#include "formats/readers.h"
#include "formats/text.h"
#include "its/mesh_file.h"

namespace its::formats {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Walks through the statements of a file. A backslash at a line's end joins it with the next, except in
/// comments and names, which may end with one ("g C:\\parts\\").
class Statements {
public:
    explicit Statements(std::string_view bytes) : text_(bytes) {}

    /// The next line, joined with those that it goes on in; false at the end.
    bool next(std::string_view& statement) {
        if (text_.at_end()) return false;
        statement = text_.line();
        if (!goes_on(statement) || !has_numbers(statement)) return true;
        joined_.clear();
        for (bool more = true; more; joined_ += ' ') {
            more = goes_on(statement);
            joined_.append(statement.substr(0, statement.size() - (more ? 1 : 0)));
            if (text_.at_end()) break;
            if (more) statement = text_.line();
        }
        statement = joined_;
        return true;
    }

private:
    static bool goes_on(std::string_view line) {
        return line.ends_with('\\') && line.find('#') == std::string_view::npos;
    }
    static bool has_numbers(std::string_view line) {
        Text text(line);
        text.skip_blanks();
        std::string_view keyword = text.word();
        if (keyword.ends_with('\\')) keyword.remove_suffix(1);
        for (const std::string_view known :
             {"v",    "vt",   "vn",   "vp",   "f",    "fo", "l",    "p",    "curv", "curv2",
              "surf", "parm", "trim", "hole", "scrv", "sp", "bmat", "step", "deg",  "con"})
            if (keyword == known) return true;
        return false;
    }

    Text text_;
    std::string joined_;
};

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
/// Coordinates with a weight w are homogeneous: the point is (x, y, z) / w. \return whether they were divided
bool read_vertex(Text& text, MeshBuilder& mesh) {
    std::array<double, 7> row{nan, nan, nan, 1, 0, 0, MeshBuilder::opaque};
    const std::size_t count = read_numbers(text, row);
    const double w = count == 4 ? row[3] : 1;
    Vec3 position = count >= 3 ? Vec3{row[0], row[1], row[2]} : Vec3{nan, nan, nan};
    if (w != 1) position = {position.x / w, position.y / w, position.z / w};
    mesh.add_vertex(position);
    if (count >= 6 && mesh.wants_attributes())
        mesh.set_text_colour(mesh.vertex_count() - 1,
                             {float(row[3]), float(row[4]), float(row[5]), float(row[6])});
    return w != 1;
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
        if (text.at_end() || text.peek() == '#') break;
        const auto index = text.integer();
        const char after = text.peek();
        if (!index || !(after == '/' || text.at_end() || Text::is_space(after) || after == '#')) {
            mesh.drop_face();
            mesh.add_unreadable_face();
            return;
        }
        const auto count = std::int64_t(mesh.vertex_count());
        mesh.add_corner(*index > 0 ? *index - 1 : *index < 0 && *index >= -count ? count + *index : -1);
        if (after == '/') {
            if (mesh.wants_attributes()) read_corner_attributes(text, mesh);
            while (!text.at_end() && !Text::is_space(text.peek()) && text.peek() != '#') text.advance();
        }
    }
    mesh.end_face();
}

}  // namespace

MeshFile parse_obj(std::string_view bytes, const ReadOptions& options) {
    MeshBuilder mesh(bytes.size(), options);
    mesh.texture.by_corner = mesh.normals.by_corner = true;
    bool materials = false;
    std::uint64_t free_form = 0, divided = 0;
    Statements statements(bytes);
    for (std::string_view statement; statements.next(statement);) {
        Text text(statement);
        text.skip_blanks();
        const std::string_view keyword = text.word();
        if (keyword == "v") {
            divided += read_vertex(text, mesh) ? 1 : 0;
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
    if (divided > 0)
        mesh.warn(fmt::format("{} vertices have a weight (v x y z w): x, y and z are divided by it", divided));
    if (materials && options.attributes) mesh.warn_not_carried("materials and textures");
    return mesh.finish("obj");
}

}  // namespace its::formats
