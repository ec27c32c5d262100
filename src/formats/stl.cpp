#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "formats/readers.h"
#include "formats/text.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"
#include "mesh/point_index.h"

namespace its::formats {

namespace {

constexpr std::size_t header_bytes = 84, facet_bytes = 50;

std::uint32_t little_endian_32(const char* bytes) {
    std::array<unsigned char, 4> b;
    std::memcpy(b.data(), bytes, 4);
    return std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 |
           std::uint32_t{b[3]} << 24;
}

/// Corners by position, numbered in the order of the file.
class Corners {
public:
    Corners(std::size_t expected, MeshBuilder& mesh) : points_(expected), mesh_(mesh) {}

    /// Adds a corner to the face being built.
    void add(const Vec3& p) {
        if (!finite(p)) return mesh_.add_nonfinite_corner();
        if (points_.size() >= 0xfffffffe)
            throw InputError("more than 4294967294 vertices; cut the mesh into parts");
        mesh_.add_corner(points_.insert(p));
    }
    /// Hands the points over.
    void finish() {
        mesh_.reserve_vertices(points_.size(), points_.size(), 1);
        for (const Vec3& p : points_.points()) mesh_.add_vertex(p);
    }

private:
    mesh::PointIndex points_;
    MeshBuilder& mesh_;
};

/// Goes behind the name of a solid, which may be anything: to the end of the line, or to its first facet where
/// that is on the same line.
void skip_name(Text& text) {
    for (Text ahead = text; !ahead.at_line_end();) {
        ahead.skip_blanks();
        const Text facet = ahead;
        if (!same_word(ahead.word(), "facet")) continue;
        ahead.skip_blanks();
        if (!same_word(ahead.word(), "normal")) continue;
        text = facet;
        return;
    }
    text.skip_line();
}

Vec3 read_point(Text& text) {
    Vec3 p{NAN, NAN, NAN};
    for (int axis = 0; axis < 3; ++axis) {
        text.skip_space();
        const auto value = text.number();
        if (!value) break;
        p[axis] = *value;
    }
    return p;
}

/// What the words of a text file mean: the beginning or end of something.
enum class Word : std::uint8_t { other, vertex, end_facet, facet, solid, end_solid };

/// The next word; "end loop" is "endloop".
Word next_word(Text& text) {
    const std::string_view word = text.word();
    if (same_word(word, "vertex")) return Word::vertex;
    if (same_word(word, "facet")) return Word::facet;
    if (same_word(word, "solid")) return Word::solid;
    if (word.size() < 3 || !same_word(word.substr(0, 3), "end")) return Word::other;
    std::string_view what = word.substr(3);
    if (what.empty()) {
        text.skip_space();
        what = text.word();
    }
    if (same_word(what, "loop") || same_word(what, "facet")) return Word::end_facet;
    return same_word(what, "solid") ? Word::end_solid : Word::other;
}

MeshFile parse_ascii(std::string_view bytes) {
    MeshBuilder mesh(bytes.size());
    Corners corners(bytes.size() / 512, mesh);
    Text text(bytes);
    std::uint64_t open = 0, incomplete = 0;  // corners of the facet being read; facets without an end
    bool ended = false;
    const auto end_facet = [&](bool complete) {
        if (open > 0 && !complete) ++incomplete, mesh.drop_face();
        if (open > 0 && complete) mesh.end_face();
        open = 0;
    };
    for (text.skip_space(); !text.at_end(); text.skip_space()) {
        const Word word = next_word(text);
        if (word == Word::other) continue;
        if (word == Word::vertex) {
            corners.add(read_point(text));
            ++open;
            continue;
        }
        end_facet(word == Word::end_facet);
        ended = word == Word::end_solid;
        if (word == Word::solid || word == Word::end_solid) skip_name(text);
    }
    end_facet(false);
    corners.finish();
    if (incomplete > 0) mesh.warn(fmt::format("{} facet(s) left out: without an end", incomplete));
    if (!ended) mesh.warn("no 'endsolid' at the end: the file may have been cut");
    return mesh.finish("stl-ascii");
}

/// How many bytes of attributes follow a facet, as it says.
std::size_t attribute_bytes(const char* facet) {
    return std::size_t{static_cast<unsigned char>(facet[48])} |
           std::size_t{static_cast<unsigned char>(facet[49])} << 8;
}

/// The facets of a binary file: how many, and whether attributes follow each.
struct Facets {
    std::uint64_t count = 0;
    bool attributes = false;
};

/// Whether `claimed` facets, each followed by as many bytes as it says, are the whole file. Most files have no
/// such bytes, and many a colour where their number should be.
bool attributes_follow(std::string_view bytes, std::uint64_t claimed) {
    std::size_t at = header_bytes;
    for (std::uint64_t i = 0; i < claimed; ++i) {
        if (bytes.size() - at < facet_bytes) return false;
        const std::size_t more = attribute_bytes(bytes.data() + at);
        if (bytes.size() - at - facet_bytes < more) return false;
        at += facet_bytes + more;
    }
    return at == bytes.size();
}

/// \throws InputError where the file cannot be what its header says
Facets find_facets(std::string_view bytes, MeshBuilder& mesh) {
    const std::uint64_t claimed = little_endian_32(bytes.data() + 80);
    const std::uint64_t room = (bytes.size() - header_bytes) / facet_bytes;
    const std::uint64_t rest = (bytes.size() - header_bytes) % facet_bytes;
    if (claimed == room && rest == 0) return {claimed};
    // Programs that do not know the number beforehand write 0 or −1.
    if ((claimed == 0 || claimed == 0xffffffff) && room > 0 && rest == 0) {
        mesh.warn(fmt::format("the header does not say how many triangles there are, the file has {}: all read",
                              room));
        return {room};
    }
    if (claimed > 0 && attributes_follow(bytes, claimed)) {
        mesh.warn(fmt::format("{} bytes of attributes not read",
                              bytes.size() - header_bytes - claimed * facet_bytes));
        return {claimed, true};
    }
    // A file cut to less than a thousandth cannot be told from random bytes.
    if (claimed / 1024 > room) {
        throw InputError(fmt::format(
            "the header says {} triangles, the file has room for {}: no STL file, or cut", claimed, room));
    }
    if (claimed > room) {
        mesh.warn(fmt::format("the header says {} triangles, the file has room for {}: it has been cut",
                              claimed, room));
        return {room};
    }
    mesh.warn(fmt::format("{} bytes after the last triangle not read",
                          bytes.size() - header_bytes - claimed * facet_bytes));
    return {claimed};
}

MeshFile parse_binary(std::string_view bytes) {
    if (bytes.size() < header_bytes) {
        throw InputError(
            fmt::format("{} bytes are too few for a binary STL file, whose header alone has 84", bytes.size()));
    }
    MeshBuilder mesh(bytes.size());
    const auto [count, attributes] = find_facets(bytes, mesh);
    Corners corners(std::size_t(count) / 2 + 2, mesh);
    mesh.reserve_triangles(count, std::size_t(count), 1);
    const char* at = bytes.data() + header_bytes;
    for (std::uint64_t i = 0; i < count; ++i) {
        for (int corner = 0; corner < 3; ++corner) {
            Vec3 p;
            for (int axis = 0; axis < 3; ++axis) {  // the normal, 12 bytes, comes first
                p[axis] = double{std::bit_cast<float>(little_endian_32(at + 12 + 12 * corner + 4 * axis))};
            }
            corners.add(p);
        }
        mesh.end_face();
        at += facet_bytes + (attributes ? attribute_bytes(at) : 0);
    }
    corners.finish();
    return mesh.finish("stl-binary");
}

}  // namespace

bool is_ascii_stl(std::string_view bytes) {
    if (bytes.size() >= header_bytes &&
        (bytes.size() - header_bytes) / facet_bytes == little_endian_32(bytes.data() + 80) &&
        (bytes.size() - header_bytes) % facet_bytes == 0) {
        return false;
    }
    Text text(bytes);
    text.skip_space();
    if (!same_word(text.rest().substr(0, 5), "solid")) return false;
    for (const char c : text.rest().substr(0, 1024)) {  // text has no control characters but white space
        if (static_cast<unsigned char>(c) < 0x20 && !Text::is_space(c)) return false;
    }
    return true;
}

MeshFile parse_stl(std::string_view bytes) {
    return is_ascii_stl(bytes) ? parse_ascii(bytes) : parse_binary(bytes);
}

}  // namespace its::formats
