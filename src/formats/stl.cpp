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

/// Corners by position, numbered in the order of the file; what is not finite gets no number.
class Corners {
public:
    explicit Corners(std::size_t expected) : points_(expected) {}

    std::int64_t number(const Vec3& p) {
        if (!finite(p)) {
            ++nonfinite_;
            return -1;
        }
        if (points_.size() >= 0xfffffffe)
            throw InputError("more than 4294967294 vertices; cut the mesh into parts");
        return points_.insert(p);
    }
    /// Hands the points over, and says what was left out.
    void finish(MeshBuilder& mesh) {
        mesh.reserve_vertices(points_.size(), points_.size(), 1);
        for (const Vec3& p : points_.points()) mesh.add_vertex(p);
        if (nonfinite_ > 0) mesh.warn(fmt::format("{} corner(s) are not finite points", nonfinite_));
    }

private:
    mesh::PointIndex points_;
    std::uint64_t nonfinite_ = 0;
};

MeshFile parse_ascii(std::string_view bytes) {
    MeshBuilder mesh(bytes.size());
    Corners corners(bytes.size() / 512);
    Text text(bytes);
    std::uint64_t open = 0, incomplete = 0;  // corners of the facet being read; facets without an end
    bool ended = false;
    const auto end_facet = [&](bool complete) {
        if (open > 0 && !complete) ++incomplete, mesh.drop_face();
        if (open > 0 && complete) mesh.end_face();
        open = 0;
    };
    for (text.skip_space(); !text.at_end(); text.skip_space()) {
        const std::string_view word = text.word();
        if (same_word(word, "vertex")) {
            Vec3 p{NAN, NAN, NAN};
            for (int axis = 0; axis < 3; ++axis) {
                text.skip_space();
                const auto value = text.number();
                if (!value) break;
                p[axis] = *value;
            }
            mesh.add_corner(corners.number(p));
            ++open;
        } else if (same_word(word, "endloop") || same_word(word, "endfacet")) {
            end_facet(true);
        } else if (same_word(word, "facet")) {
            end_facet(false);
        } else if (same_word(word, "solid") || same_word(word, "endsolid")) {
            end_facet(false);
            ended = word.size() == 8;
            text.line();  // the name may be anything
        }
    }
    end_facet(false);
    corners.finish(mesh);
    if (incomplete > 0) mesh.warn(fmt::format("{} facet(s) left out: without an end", incomplete));
    if (!ended) mesh.warn("no 'endsolid' at the end: the file may have been cut");
    return mesh.finish("stl-ascii");
}

MeshFile parse_binary(std::string_view bytes) {
    if (bytes.size() < header_bytes) {
        throw InputError(
            fmt::format("{} bytes are too few for a binary STL file, whose header alone has 84", bytes.size()));
    }
    const std::uint64_t claimed = little_endian_32(bytes.data() + 80);
    const std::uint64_t room = (bytes.size() - header_bytes) / facet_bytes;
    MeshBuilder mesh(bytes.size());
    std::uint64_t count = claimed;
    // A file cut to less than a thousandth cannot be told from random bytes.
    if (claimed / 1024 > room) {
        throw InputError(fmt::format(
            "the header says {} triangles, the file has room for {}: no STL file, or cut", claimed, room));
    }
    if (claimed > room) {
        mesh.warn(fmt::format("the header says {} triangles, the file has room for {}: it has been cut",
                              claimed, room));
        count = room;
    } else if (claimed == 0 && room > 0 && bytes.size() == header_bytes + room * facet_bytes) {
        mesh.warn(fmt::format("the header says no triangles, the file has {}: all read", room));
        count = room;
    } else if (const std::uint64_t extra = bytes.size() - header_bytes - claimed * facet_bytes; extra > 0) {
        mesh.warn(fmt::format("{} bytes after the last triangle not read", extra));
    }
    Corners corners(std::size_t(count) / 2 + 2);
    mesh.reserve_triangles(count, std::size_t(count), 1);
    const char* at = bytes.data() + header_bytes;
    for (std::uint64_t i = 0; i < count; ++i, at += facet_bytes) {
        for (int corner = 0; corner < 3; ++corner) {
            Vec3 p;
            for (int axis = 0; axis < 3; ++axis) {  // the normal, 12 bytes, comes first
                p[axis] = double{std::bit_cast<float>(little_endian_32(at + 12 + 12 * corner + 4 * axis))};
            }
            mesh.add_corner(corners.number(p));
        }
        mesh.end_face();
    }
    corners.finish(mesh);
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
