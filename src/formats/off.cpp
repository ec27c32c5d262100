#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "formats/readers.h"
#include "formats/text.h"
#include "its/mesh_file.h"

namespace its::formats {

namespace {

[[noreturn]] void fail(const Text& text, std::string_view what) {
    throw InputError(fmt::format("line {}: {}", text.line_number(), what));
}

/// What follows the coordinates of a vertex.
struct Columns {
    bool texture = false, colour = false, normal = false;
};

/// Reads the keyword, if there is one: [ST][C][N][4][n]OFF, where the first count may follow without a blank.
/// Only three coordinates and text are known here.
Columns read_keyword(Text& text) {
    Columns columns;
    const std::string_view rest = text.rest();
    std::size_t length = 0;
    for (const std::string_view prefix : {"ST", "C", "N", "4", "n"}) {
        if (!rest.substr(length).starts_with(prefix)) continue;
        if (prefix == "4" || prefix == "n") {
            if (!rest.substr(length + 1).starts_with("OFF") && !rest.substr(length + 1).starts_with("nOFF"))
                continue;
            fail(text, "vertices of other than three coordinates (4OFF, nOFF) are not read");
        }
        length += prefix.size();
        columns.texture |= prefix == "ST";
        columns.colour |= prefix == "C";
        columns.normal |= prefix == "N";
    }
    if (!same_word(rest.substr(length, 3), "off")) return {};
    for (length += 3; length > 0; --length) text.advance();
    text.skip_blanks();
    if (text.rest().starts_with("BINARY")) fail(text, "binary OFF is not read; write it as text, or as .ply");
    return columns;
}

/// The next number, over line ends and comments. \throws InputError if there is something else.
/// Empty at the end of the file.
std::optional<double> next_number(Text& text) {
    text.skip_space_and_comments();
    if (text.at_end()) return {};
    const auto value = text.number();
    if (!value) fail(text, "a number is expected");
    return value;
}

std::uint64_t read_count(Text& text, std::string_view what) {
    text.skip_space_and_comments();
    const auto value = text.integer();
    if (!value || *value < 0) fail(text, fmt::format("the number of {} is expected", what));
    return std::uint64_t(*value);
}

/// The rest of a vertex's line: normal, three or four numbers of colour, texture coordinates.
void read_attributes(Text& text, const Columns& columns, MeshBuilder& mesh) {
    std::array<double, 10> rest{};  // one more than there can be
    std::size_t count = 0, at = 0;
    for (; count < rest.size(); ++count) {
        text.skip_blanks();
        const auto value = text.number();
        if (!value) break;
        rest[count] = *value;
    }
    const std::size_t others = (columns.normal ? 3 : 0) + (columns.texture ? 2 : 0);
    const std::size_t colour = count - std::min(count, others);
    if (count < others || (columns.colour ? colour != 3 && colour != 4 : colour != 0)) return;
    const std::uint64_t vertex = mesh.vertex_count() - 1;
    if (columns.normal) mesh.normals.set_vertex(vertex, {rest[0], rest[1], rest[2]}), at = 3;
    if (columns.colour) {
        mesh.set_text_colour(vertex, {float(rest[at]), float(rest[at + 1]), float(rest[at + 2]),
                                      colour == 4 ? float(rest[at + 3]) : MeshBuilder::opaque});
        at += colour;
    }
    if (columns.texture) mesh.texture.set_vertex(vertex, {rest[at], rest[at + 1]});
}

bool read_vertex(Text& text, const Columns& columns, MeshBuilder& mesh) {
    Vec3 p;
    for (int axis = 0; axis < 3; ++axis) {
        const auto value = next_number(text);
        if (!value) return false;
        p[axis] = *value;
    }
    mesh.add_vertex(p);
    if (mesh.wants_attributes()) read_attributes(text, columns, mesh);
    text.skip_line();
    return true;
}

bool read_face(Text& text, MeshBuilder& mesh, bool& colours) {
    text.skip_space_and_comments();
    if (text.at_end()) return false;
    const auto corners = text.integer();
    if (!corners || *corners < 0) fail(text, "the number of a face's corners is expected");
    for (std::int64_t i = 0; i < *corners; ++i) {
        text.skip_space_and_comments();
        if (text.at_end()) return false;
        const auto index = text.integer();
        if (!index) fail(text, "the index of a vertex is expected");
        mesh.add_corner(*index);
    }
    mesh.end_face();
    if (mesh.wants_attributes()) {
        text.skip_blanks();
        colours |= text.number().has_value();
    }
    text.skip_line();
    return true;
}

}  // namespace

MeshFile parse_off(std::string_view bytes, const ReadOptions& options) {
    MeshBuilder mesh(bytes.size(), options);
    Text text(bytes);
    text.skip_space_and_comments();
    const Columns columns = read_keyword(text);
    const std::uint64_t vertices = read_count(text, "vertices"), faces = read_count(text, "faces");
    if (vertices > 0xfffffffe)
        fail(text, fmt::format("{} vertices: more than 4294967294 cannot be read", vertices));
    text.skip_line();  // the number of edges, which need not be right
    mesh.reserve_vertices(vertices, text.bytes_left(), 6);
    std::uint64_t read = 0;
    while (read < vertices && read_vertex(text, columns, mesh)) ++read;
    if (read < vertices) {
        mesh.warn(fmt::format("the header says {} vertices, the file has {}: it has been cut", vertices, read));
    }
    mesh.reserve_triangles(faces, text.bytes_left(), 8);
    bool face_colours = false;
    for (read = 0; read < faces && read_face(text, mesh, face_colours);) ++read;
    if (face_colours && options.attributes) mesh.warn_not_carried("colours of faces");
    if (read < faces) {
        mesh.drop_face();
        mesh.warn(fmt::format("the header says {} faces, the file has {}: it has been cut", faces, read));
    }
    return mesh.finish("off");
}

}  // namespace its::formats
