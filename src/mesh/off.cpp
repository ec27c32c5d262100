#include <fmt/format.h>

#include "mesh/readers.h"
#include "mesh/text.h"

namespace its {

namespace {

[[noreturn]] void fail(const Text& text, std::string_view what) {
    throw InputError(fmt::format("line {}: {}", text.line_number(), what));
}

/// Reads the keyword, if there is one: [ST][C][N][4][n]OFF, where the first count may follow without a blank.
/// Only three coordinates and text are known here.
void read_keyword(Text& text) {
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
    }
    if (!same_word(rest.substr(length, 3), "off")) return;
    for (length += 3; length > 0; --length) text.advance();
    text.skip_blanks();
    if (text.rest().starts_with("BINARY")) fail(text, "binary OFF is not read; write it as text, or as .ply");
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

bool read_vertex(Text& text, MeshBuilder& mesh) {
    Vec3 p;
    for (int axis = 0; axis < 3; ++axis) {
        const auto value = next_number(text);
        if (!value) return false;
        p[axis] = *value;
    }
    text.skip_line();  // colours, normals, texture coordinates
    mesh.add_vertex(p);
    return true;
}

bool read_face(Text& text, MeshBuilder& mesh) {
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
    text.skip_line();  // colours
    return true;
}

}  // namespace

MeshFile parse_off(std::string_view bytes) {
    MeshBuilder mesh(bytes.size());
    Text text(bytes);
    text.skip_space_and_comments();
    read_keyword(text);
    const std::uint64_t vertices = read_count(text, "vertices"), faces = read_count(text, "faces");
    if (vertices > 0xfffffffe)
        fail(text, fmt::format("{} vertices: more than 4294967294 cannot be read", vertices));
    text.skip_line();  // the number of edges, which need not be right
    mesh.reserve_vertices(vertices, text.bytes_left(), 6);
    std::uint64_t read = 0;
    while (read < vertices && read_vertex(text, mesh)) ++read;
    if (read < vertices) {
        mesh.warn(fmt::format("the header says {} vertices, the file has {}: it has been cut", vertices, read));
    }
    mesh.reserve_triangles(faces, text.bytes_left(), 8);
    for (read = 0; read < faces && read_face(text, mesh);) ++read;
    if (read < faces) {
        mesh.drop_face();
        mesh.warn(fmt::format("the header says {} faces, the file has {}: it has been cut", faces, read));
    }
    return mesh.finish("off");
}

}  // namespace its
