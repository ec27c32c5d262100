#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "formats/readers.h"
#include "formats/text.h"
#include "its/mesh_file.h"

namespace its::formats {

namespace {

enum class Scalar : std::uint8_t { none, int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct Property {
    std::string_view name;
    Scalar type = Scalar::none;
    Scalar count_type = Scalar::none;  ///< of a list's length; none if it is no list
};

struct Element {
    std::string_view name;
    std::uint64_t count = 0;
    std::vector<Property> properties;
};

enum class Format : std::uint8_t { ascii, little, big };

struct Header {
    Format format = Format::ascii;
    bool names_texture = false;  ///< a comment names a picture
    std::vector<Element> elements;
};

/// The data end before what the header promises.
struct Cut {};

std::size_t size_of(Scalar type) {
    constexpr std::array<std::size_t, 9> sizes = {0, 1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[std::size_t(type)];
}

Scalar scalar_of(std::string_view name, const Text& text) {
    constexpr std::pair<std::string_view, Scalar> names[] = {
        {"char", Scalar::int8},      {"int8", Scalar::int8},       {"uchar", Scalar::uint8},
        {"uint8", Scalar::uint8},    {"short", Scalar::int16},     {"int16", Scalar::int16},
        {"ushort", Scalar::uint16},  {"uint16", Scalar::uint16},   {"int", Scalar::int32},
        {"int32", Scalar::int32},    {"uint", Scalar::uint32},     {"uint32", Scalar::uint32},
        {"float", Scalar::float32},  {"float32", Scalar::float32}, {"double", Scalar::float64},
        {"float64", Scalar::float64}};
    for (const auto& [known, type] : names) {
        if (known == name) return type;
    }
    throw InputError(fmt::format("line {}: unknown type of a PLY property", text.line_number() - 1));
}

std::string_view next_word(Text& line) {
    line.skip_blanks();
    return line.word();
}

void read_property(Text& line, const Text& text, Header& header) {
    if (header.elements.empty()) throw InputError("a PLY property before the first element");
    Property property;
    std::string_view word = next_word(line);
    if (word == "list") {
        property.count_type = scalar_of(next_word(line), text);
        word = next_word(line);
    }
    property.type = scalar_of(word, text);
    property.name = next_word(line);
    header.elements.back().properties.push_back(property);
}

/// Reads up to and including the line end_header.
Header read_header(Text& text) {
    Header header;
    text.line();  // "ply"
    bool format_known = false;
    for (;;) {
        if (text.at_end()) throw InputError("the PLY header has no end: the file has been cut");
        Text line(text.line());
        const std::string_view keyword = next_word(line);
        if (keyword == "end_header") break;
        if (keyword == "format") {
            const std::string_view name = next_word(line);
            if (name != "ascii" && name != "binary_little_endian" && name != "binary_big_endian") {
                throw InputError(
                    "unknown PLY format: must be ascii, binary_little_endian or binary_big_endian");
            }
            header.format = name == "ascii"               ? Format::ascii
                            : name == "binary_big_endian" ? Format::big
                                                          : Format::little;
            format_known = true;
        } else if (keyword == "element") {
            Element element;
            element.name = next_word(line);
            line.skip_blanks();
            const auto count = line.integer();
            if (!count || *count < 0) {
                throw InputError(
                    fmt::format("line {}: the number of elements is missing", text.line_number() - 1));
            }
            element.count = std::uint64_t(*count);
            header.elements.push_back(std::move(element));
        } else if (keyword == "property") {
            read_property(line, text, header);
        } else if (keyword == "comment") {
            header.names_texture |= same_word(next_word(line), "texturefile");
        }  // obj_info, and what nobody knows
    }
    if (!format_known) throw InputError("the PLY header has no line 'format'");
    return header;
}

class AsciiData {
public:
    explicit AsciiData(Text& text) : text_(text) {}
    /// \throws Cut, InputError
    double next(Scalar) {
        text_.skip_space();
        if (text_.at_end()) throw Cut{};
        if (const auto value = text_.number()) return *value;
        throw InputError(fmt::format("line {}: a number is expected", text_.line_number()));
    }
    void skip(Scalar type, std::uint64_t count) {
        while (count-- > 0) next(type);
    }
    std::size_t bytes_left() const { return text_.bytes_left(); }
    static std::size_t bytes_of(Scalar) { return 2; }

private:
    Text& text_;
};

class BinaryData {
public:
    BinaryData(std::string_view bytes, bool little)
        : at_(bytes.data()),
          end_(at_ + bytes.size()),
          swap_(little != (std::endian::native == std::endian::little)) {}
    /// \throws Cut
    double next(Scalar type) {
        switch (type) {
            case Scalar::int8:
                return number<std::int8_t>();
            case Scalar::uint8:
                return number<std::uint8_t>();
            case Scalar::int16:
                return number<std::int16_t>();
            case Scalar::uint16:
                return number<std::uint16_t>();
            case Scalar::int32:
                return number<std::int32_t>();
            case Scalar::uint32:
                return number<std::uint32_t>();
            case Scalar::float32:
                return double{number<float>()};
            case Scalar::float64:
                return number<double>();
            case Scalar::none:
                break;
        }
        throw Cut{};
    }
    void skip(Scalar type, std::uint64_t count) {
        if (count > bytes_left() / size_of(type)) throw Cut{};
        at_ += count * size_of(type);
    }
    std::size_t bytes_left() const { return std::size_t(end_ - at_); }
    static std::size_t bytes_of(Scalar type) { return size_of(type); }

private:
    template <class T>
    T number() {
        if (bytes_left() < sizeof(T)) throw Cut{};
        std::array<char, sizeof(T)> raw;
        std::memcpy(raw.data(), at_, sizeof(T));
        at_ += sizeof(T);
        if (swap_) std::reverse(raw.begin(), raw.end());
        return std::bit_cast<T>(raw);
    }

    const char* at_;
    const char* end_;
    bool swap_;
};

/// An index from a file: whole numbers only; −1 for what cannot be one.
std::int64_t index_of(double value) {
    return value >= 0 && value < 0x1p32 && value == std::floor(value) ? std::int64_t(value) : -1;
}

template <class Data>
std::uint64_t list_length(Data& data, const Property& list) {
    const double length = data.next(list.count_type);
    if (!(length >= 0 && length < 0x1p53 && length == std::floor(length))) {
        throw InputError(fmt::format("a PLY list of length {}: the file is damaged", length));
    }
    return std::uint64_t(length);
}

template <class Data>
void skip_property(Data& data, const Property& property) {
    data.skip(property.type, property.count_type == Scalar::none ? 1 : list_length(data, property));
}

/// Bytes that an element takes at least.
template <class Data>
std::size_t least_bytes(const Element& element) {
    std::size_t sum = 0;
    for (const Property& p : element.properties) {
        sum += Data::bytes_of(p.count_type == Scalar::none ? p.type : p.count_type);
    }
    return std::max<std::size_t>(sum, 1);
}

/// What the scalar properties of vertices mean: the numbers of a row.
enum Field : std::uint8_t { x, y, z, normal, red = normal + 3, alpha = red + 3, texture, fields = texture + 2 };

int field_of(const Property& p) {
    if (p.count_type != Scalar::none) return -1;
    constexpr std::pair<std::string_view, int> names[] = {{"x", x},
                                                          {"y", y},
                                                          {"z", z},
                                                          {"nx", normal},
                                                          {"ny", normal + 1},
                                                          {"nz", normal + 2},
                                                          {"red", red},
                                                          {"green", red + 1},
                                                          {"blue", red + 2},
                                                          {"r", red},
                                                          {"g", red + 1},
                                                          {"b", red + 2},
                                                          {"diffuse_red", red},
                                                          {"diffuse_green", red + 1},
                                                          {"diffuse_blue", red + 2},
                                                          {"alpha", alpha},
                                                          {"a", alpha},
                                                          {"s", texture},
                                                          {"t", texture + 1},
                                                          {"u", texture},
                                                          {"v", texture + 1},
                                                          {"texture_u", texture},
                                                          {"texture_v", texture + 1}};
    for (const auto& [known, field] : names)
        if (p.name == known) return field;
    return -1;
}

/// A vertex's numbers, by field.
using Row = std::array<double, std::size_t{fields}>;

/// The largest number that stands for 1 in a colour of this type.
double unit_of(Scalar type) {
    return type == Scalar::uint8 ? 255 : type == Scalar::uint16 ? 65535 : 1;
}

/// Hands over the attributes of the vertex added last, as far as the bits of `found` say that there are any.
void add_attributes(const Row& row, unsigned found, MeshBuilder& mesh) {
    if (!mesh.wants_attributes()) return;
    const auto has = [&](unsigned first, unsigned count) {
        const unsigned bits = ((1u << count) - 1) << first;
        return (found & bits) == bits;
    };
    const std::uint64_t vertex = mesh.vertex_count() - 1;
    if (has(normal, 3)) mesh.normals.set_vertex(vertex, {row[normal], row[normal + 1], row[normal + 2]});
    if (has(red, 3))
        mesh.colours.set_vertex(vertex, {float(row[red]), float(row[red + 1]), float(row[red + 2]),
                                         has(alpha, 1) ? float(row[alpha]) : 1.0F});
    if (has(texture, 2) && !mesh.texture.by_corner)
        mesh.texture.set_vertex(vertex, {row[texture], row[texture + 1]});
}

/// \param mesh  has reserve_vertices() and add_vertex(); `row_added` is called after the latter
template <class Data, class Vertices, class RowAdded>
void read_vertices(Data& data, const Element& element, Vertices& mesh, std::uint64_t& done,
                   RowAdded&& row_added) {
    std::vector<int> places;
    std::vector<double> units;
    unsigned found = 0;
    for (const Property& p : element.properties) {
        places.push_back(field_of(p));
        if (places.back() >= 0) found |= 1u << places.back();
        units.push_back(places.back() >= red && places.back() <= alpha ? unit_of(p.type) : 1);
    }
    if ((found & 7) != 7) throw InputError("the PLY vertices have no x, y and z");
    mesh.reserve_vertices(element.count, data.bytes_left(), least_bytes<Data>(element));
    for (; done < element.count; ++done) {
        Row row{};
        for (std::size_t i = 0; i < places.size(); ++i) {
            if (places[i] >= 0) {
                row[std::size_t(places[i])] = data.next(element.properties[i].type) / units[i];
            } else {
                skip_property(data, element.properties[i]);
            }
        }
        mesh.add_vertex({row[x], row[y], row[z]});
        row_added(row, found);
    }
}

/// Which property holds the vertices of a face or strip.
std::size_t index_property(const Element& element) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const Property& p = element.properties[i];
        if (p.count_type != Scalar::none && (p.name == "vertex_indices" || p.name == "vertex_index")) return i;
    }
    throw InputError(fmt::format("the PLY element '{}' has no list vertex_indices", element.name));
}

/// A face's list of texture coordinates, u and v of each of its `corners` corners. They become the values of
/// the corners added last; if the list is of another length, it is passed over.
template <class Data>
void read_texture_list(Data& data, const Property& list, MeshBuilder& mesh) {
    std::uint64_t left = list_length(data, list);
    const std::size_t corners = mesh.face_corners();
    if (corners == 0 || left != 2 * std::uint64_t{corners}) return data.skip(list.type, left);
    for (std::size_t i = 0; i < corners; ++i) {
        const double u = data.next(list.type), v = data.next(list.type);
        mesh.texture.set_corner(mesh.corner_count() - corners + i + 1, std::int64_t(mesh.texture.size()));
        mesh.texture.add({u, v});
    }
}

bool has_texture_list(const Header& header) {
    for (const Element& element : header.elements)
        for (const Property& p : element.properties)
            if (element.name == "face" && p.name == "texcoord" && p.count_type != Scalar::none) return true;
    return false;
}

template <class Data>
void read_faces(Data& data, const Element& element, MeshBuilder& mesh, std::uint64_t& done) {
    const std::size_t indices = index_property(element);
    mesh.reserve_triangles(element.count, data.bytes_left(), least_bytes<Data>(element) + 3);
    for (; done < element.count; ++done) {
        for (std::size_t i = 0; i < element.properties.size(); ++i) {
            const Property& p = element.properties[i];
            if (i != indices) {
                if (mesh.wants_attributes() && p.name == "texcoord" && p.count_type != Scalar::none)
                    read_texture_list(data, p, mesh);
                else
                    skip_property(data, p);
                continue;
            }
            for (std::uint64_t left = list_length(data, p); left > 0; --left) {
                mesh.add_corner(index_of(data.next(p.type)));
            }
        }
        mesh.end_face();
    }
}

/// Strips of triangles, separated by −1. A triangle with a repeated index only steers the strip.
template <class Data>
void read_strips(Data& data, const Element& element, MeshBuilder& mesh, std::uint64_t& done) {
    const std::size_t indices = index_property(element);
    for (; done < element.count; ++done) {
        for (std::size_t i = 0; i < element.properties.size(); ++i) {
            const Property& p = element.properties[i];
            if (i != indices) {
                skip_property(data, p);
                continue;
            }
            StripReader strip(mesh);
            for (std::uint64_t left = list_length(data, p); left > 0; --left) {
                const double value = data.next(p.type);
                if (value == -1) {
                    strip.restart();
                } else {
                    strip.add(index_of(value));
                }
            }
        }
    }
}

template <class Data>
void read_body(Data& data, const Header& header, MeshBuilder& mesh) {
    bool any_faces = false;
    mesh.texture.by_corner = has_texture_list(header);
    if (header.names_texture && mesh.wants_attributes()) mesh.warn_not_carried("materials and textures");
    for (const Element& element : header.elements) {
        if (element.properties.empty()) continue;  // takes no bytes, however many there are
        std::uint64_t done = 0;
        try {
            if (element.name == "vertex") {
                for (const Property& p : element.properties)
                    mesh.byte_colours |= field_of(p) == red && p.type == Scalar::uint8;
                read_vertices(data, element, mesh, done,
                              [&](const Row& row, unsigned found) { add_attributes(row, found, mesh); });
            } else if (element.name == "face") {
                any_faces = true;
                read_faces(data, element, mesh, done);
            } else if (element.name == "tristrips") {
                any_faces = true;
                read_strips(data, element, mesh, done);
            } else {
                for (; done < element.count; ++done) {
                    for (const Property& p : element.properties) skip_property(data, p);
                }
            }
        } catch (const Cut&) {
            mesh.drop_face();
            mesh.warn(fmt::format("the file ends in element '{}' number {} of {}: it has been cut",
                                  element.name, done + 1, element.count));
            return;
        }
    }
    if (!any_faces) throw InputError("it holds no faces: a cloud of points");
}

/// Vertices that are no mesh's.
struct Points {
    std::vector<Vec3> points;

    void reserve_vertices(std::uint64_t claimed, std::size_t bytes_left, std::size_t bytes_each) {
        points.reserve(std::min<std::uint64_t>(claimed, bytes_left / bytes_each));
    }
    void add_vertex(const Vec3& position) { points.push_back(position); }
};

template <class Data>
std::vector<Vec3> read_points(Data& data, const Header& header) {
    for (const Element& element : header.elements) {
        const bool vertices = element.name == "vertex";
        if (element.properties.empty() && !vertices) continue;  // takes no bytes, however many there are
        Points found;
        std::uint64_t done = 0;
        try {
            if (vertices) {
                read_vertices(data, element, found, done, [](const Row&, unsigned) {});
                return std::move(found.points);
            }
            for (; done < element.count; ++done) {
                for (const Property& p : element.properties) skip_property(data, p);
            }
        } catch (const Cut&) {
            throw InputError(fmt::format("ends in element '{}' number {} of {}: it has been cut", element.name,
                                         done + 1, element.count));
        }
    }
    throw InputError("has no element 'vertex'");
}

}  // namespace

std::vector<Vec3> parse_ply_points(std::string_view bytes) {
    if (!bytes.starts_with("ply")) throw InputError("is not a PLY file");
    Text text(bytes);
    const Header header = read_header(text);
    if (header.format == Format::ascii) {
        AsciiData data(text);
        return read_points(data, header);
    }
    BinaryData data(text.rest(), header.format == Format::little);
    return read_points(data, header);
}

MeshFile parse_ply(std::string_view bytes, const ReadOptions& options) {
    MeshBuilder mesh(bytes.size(), options);
    Text text(bytes);
    const Header header = read_header(text);
    if (header.format == Format::ascii) {
        AsciiData data(text);
        read_body(data, header, mesh);
        return mesh.finish("ply-ascii");
    }
    BinaryData data(text.rest(), header.format == Format::little);
    read_body(data, header, mesh);
    return mesh.finish(header.format == Format::little ? "ply-binary-le" : "ply-binary-be");
}

}  // namespace its::formats
