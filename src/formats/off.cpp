#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "formats/readers.h"
#include "formats/text.h"
#include "its/mesh_file.h"

// The format is Geomview's (its manual, "OFF Files"): tokens are free of lines up to the last vertex, and a
// face's colour ends with its line. Other programs write a line for each vertex, with colours of three or four
// numbers, and leave the number of edges out.
namespace its::formats {

namespace {

[[noreturn]] void fail(const Text& text, std::string_view what) {
    throw InputError(fmt::format("line {}: {}", text.line_number(), what));
}

/// What is said of a vertex, in this order: coordinates, normal, colour, texture coordinates.
struct Layout {
    bool texture = false, colour = false, normal = false, homogeneous = false;
    std::size_t colours = 4;  ///< numbers of a colour
    bool by_line = false;     ///< each vertex has a line of its own; else just as many numbers as it needs

    std::size_t coordinates() const { return homogeneous ? 4 : 3; }
    /// Numbers besides the colour.
    std::size_t others() const { return coordinates() + (normal ? 3 : 0) + (texture ? 2 : 0); }
    std::size_t numbers() const { return others() + (colour ? colours : 0); }
};

/// A whole number that ends where a word does.
std::int64_t whole_number(Text& text, std::string_view what) {
    text.skip_space_and_comments();
    const auto value = text.integer();
    const bool ends = text.at_end() || Text::is_space(text.peek()) || text.peek() == '#';
    if (!value || *value < 0 || !ends) fail(text, fmt::format("the number of {} is expected", what));
    return *value;
}

/// Reads the keyword, if there is one: [ST][C][N][4][n]OFF, where the first count may follow without a blank.
Layout read_keyword(Text& text) {
    Layout layout;
    bool dimension_follows = false;
    const std::string_view rest = text.rest();
    std::size_t length = 0;
    for (const std::string_view prefix : {"ST", "C", "N", "4", "n"}) {
        if (!rest.substr(length).starts_with(prefix)) continue;
        length += prefix.size();
        layout.texture |= prefix == "ST";
        layout.colour |= prefix == "C";
        layout.normal |= prefix == "N";
        layout.homogeneous |= prefix == "4";
        dimension_follows |= prefix == "n";
    }
    if (!same_word(rest.substr(length, 3), "off")) return {};
    for (length += 3; length > 0; --length) text.advance();
    text.skip_blanks();
    if (text.rest().starts_with("BINARY")) fail(text, "binary OFF is not read; write it as text, or as .ply");
    if (dimension_follows)
        if (const auto dimension = whole_number(text, "dimensions"); dimension != 3)
            fail(text, fmt::format("vertices of {} dimensions are not read, only of three", dimension));
    return layout;
}

/// The number of words of the next line that has any besides a comment, and goes behind it; 0 at the end.
std::size_t take_line(Text& text) {
    text.skip_space_and_comments();
    Text line(text.line());
    std::size_t words = 0;
    for (line.skip_blanks(); !line.at_end() && line.peek() != '#'; line.skip_blanks(), ++words)
        while (!line.at_end() && !Text::is_space(line.peek()) && line.peek() != '#') line.advance();
    return words;
}

/// The number of edges, which need not be right, nor there: what stands after the line of the counts before is
/// the first vertex if the line after it looks the same.
void skip_edge_count(Text& text, std::uint64_t vertices) {
    text.skip_blanks();
    if (text.at_line_end() || text.peek() == '#') {
        Text ahead = text;
        const std::size_t first = take_line(ahead), second = take_line(ahead);
        if (first >= 3 && (first == second || vertices == 1)) return;
    }
    whole_number(text, "edges");
}

/// Looks at the lines ahead, to see whether each vertex has its own and how many numbers a colour has.
void look_ahead(Text text, std::uint64_t vertices, std::uint64_t faces, Layout& layout) {
    Text first_line = text;
    const std::size_t first = take_line(first_line), others = layout.others();
    // A line may have several vertices.
    if (layout.colour && first % (others + 4) != 0 && first % (others + 3) == 0) layout.colours = 3;

    std::uint64_t lines = 0;
    bool alike = true, enough = true;
    for (; lines < vertices && !text.at_end(); ++lines) {
        const std::size_t words = take_line(text);
        if (words == 0) break;
        alike = alike && words == first;
        enough = enough && words >= layout.coordinates();
    }
    if (lines < vertices || !enough) return;
    std::uint64_t rest = 0;
    while (rest <= faces && take_line(text) > 0) ++rest;
    layout.by_line = rest == faces || (rest > faces && alike && first >= layout.numbers());
}

/// The numbers of one vertex, and how many there are.
struct Row {
    std::array<double, 16> numbers{};
    std::size_t count = 0;
};

/// False at the end of the file.
/// \throws InputError on what is no number
bool read_row(Text& text, const Layout& layout, Row& row) {
    const std::size_t most = layout.by_line ? row.numbers.size() : layout.numbers();
    for (row.count = 0; row.count < most; ++row.count) {
        if (layout.by_line && row.count > 0) {
            text.skip_blanks();
            if (text.at_line_end() || text.peek() == '#') return true;
        } else {
            text.skip_space_and_comments();
            if (text.at_end()) return false;
        }
        const auto value = text.number();
        if (!value) fail(text, "a number is expected");
        row.numbers[row.count] = *value;
    }
    if (layout.by_line) text.skip_line();
    return true;
}

/// \return whether all numbers of the row have a meaning
bool add_vertex(const Row& row, const Layout& layout, MeshBuilder& mesh) {
    const auto& [n, count] = row;
    const double w = layout.homogeneous ? n[3] : 1;
    mesh.add_vertex(w == 1 ? Vec3{n[0], n[1], n[2]} : Vec3{n[0] / w, n[1] / w, n[2] / w});
    const std::size_t others = layout.others(), colours = count - std::min(count, others);
    if (count < others || (layout.colour ? colours != 3 && colours != 4 : colours != 0))
        return count <= layout.numbers();
    if (!mesh.wants_attributes()) return true;
    const std::uint64_t vertex = mesh.vertex_count() - 1;
    std::size_t at = layout.coordinates();
    if (layout.normal) mesh.normals.set_vertex(vertex, {n[at], n[at + 1], n[at + 2]}), at += 3;
    if (layout.colour) {
        mesh.set_text_colour(vertex, {float(n[at]), float(n[at + 1]), float(n[at + 2]),
                                      colours == 4 ? float(n[at + 3]) : MeshBuilder::opaque});
        at += colours;
    }
    if (layout.texture) mesh.texture.set_vertex(vertex, {n[at], n[at + 1]});
    return true;
}

void read_vertices(Text& text, std::uint64_t vertices, const Layout& layout, MeshBuilder& mesh) {
    std::uint64_t read = 0, longer = 0, first_longer = 0;
    Row row;
    for (; read < vertices && read_row(text, layout, row); ++read) {
        if (add_vertex(row, layout, mesh)) continue;
        if (longer++ == 0) first_longer = read;
    }
    if (longer > 0)
        mesh.warn(
            fmt::format("{} vertices have more numbers on their line than the keyword says, which are not "
                        "read (the first is vertex {})",
                        longer, first_longer));
    if (read < vertices)
        mesh.warn(fmt::format("the header says {} vertices, the file has {}: it has been cut", vertices, read));
}

/// Its indices, and up to the end of the line its colour: at most four numbers.
bool read_face(Text& text, MeshBuilder& mesh, bool& colours) {
    text.skip_space_and_comments();
    if (text.at_end()) return false;
    const std::int64_t corners = whole_number(text, "a face's corners");
    for (std::int64_t i = 0; i < corners; ++i) {
        text.skip_space_and_comments();
        if (text.at_end()) return false;
        const auto index = text.integer();
        if (!index) fail(text, "the index of a vertex is expected");
        mesh.add_corner(*index);
    }
    mesh.end_face();
    for (int numbers = 0;; ++numbers) {
        text.skip_blanks();
        if (text.at_line_end() || text.peek() == '#') break;
        if (numbers == 4 || !text.number())
            fail(text, "more than a face and its colour, which ends the line: one to four numbers");
        colours = true;
    }
    return true;
}

}  // namespace

MeshFile parse_off(std::string_view bytes, const ReadOptions& options) {
    MeshBuilder mesh(bytes.size(), options);
    Text text(bytes);
    text.skip_space_and_comments();
    Layout layout = read_keyword(text);
    const auto vertices = std::uint64_t(whole_number(text, "vertices")),
               faces = std::uint64_t(whole_number(text, "faces"));
    if (vertices > 0xfffffffe)
        fail(text, fmt::format("{} vertices: more than 4294967294 cannot be read", vertices));
    skip_edge_count(text, vertices);
    look_ahead(text, vertices, faces, layout);
    mesh.reserve_vertices(vertices, text.bytes_left(), 6);
    read_vertices(text, vertices, layout, mesh);
    mesh.reserve_triangles(faces, text.bytes_left(), 8);
    bool face_colours = false;
    std::uint64_t read = 0;
    while (read < faces && read_face(text, mesh, face_colours)) ++read;
    if (face_colours && options.attributes) mesh.warn_not_carried("colours of faces");
    if (read < faces) {
        mesh.drop_face();
        mesh.warn(fmt::format("the header says {} faces, the file has {}: it has been cut", faces, read));
    }
    text.skip_space_and_comments();
    if (!text.at_end())
        mesh.warn(fmt::format("line {}: the file goes on after its {} faces; that is not read",
                              text.line_number(), faces));
    return mesh.finish("off");
}

}  // namespace its::formats
