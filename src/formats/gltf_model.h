#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/affine.h"

/// What a glTF file says, as far as it is about shape: the parts of its JSON, with types checked and nothing
/// else. https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
namespace its::formats::gltf {

/// Numbers of accessors, buffers, …; none is −1.
constexpr int none = -1;

struct Buffer {
    std::optional<std::string> uri;
    std::size_t length = 0;
    bool fallback = false;  ///< stands for what decompression makes, and has no data
};

/// Data compressed by meshoptimizer, in place of a view's own.
struct Meshopt {
    std::string extension, mode, filter;
    int buffer = none;
    std::size_t offset = 0, length = 0, stride = 0, count = 0;
};

struct BufferView {
    int buffer = none;
    std::size_t offset = 0, length = 0, stride = 0;
    std::optional<Meshopt> meshopt;
};

enum class Type : std::uint8_t { scalar = 1, vec2, vec3, vec4, other };

/// Where values are: in a view, some bytes from its beginning.
struct Place {
    int view = none;
    std::size_t offset = 0;
    int component = 0;  ///< kind of number, as in the file: 5120, …
};

struct Sparse {
    std::size_t count = 0;
    Place indices, values;
};

struct Accessor {
    Place place;
    std::size_t count = 0;
    Type type = Type::other;
    bool normalized = false;
    std::optional<Sparse> sparse;
};

/// The attributes that are read, and how they are called.
enum Attribute : std::uint8_t { position, colour, texture, normal, attributes };
constexpr std::array<std::string_view, attributes> attribute_names = {"POSITION", "COLOR_0", "TEXCOORD_0",
                                                                      "NORMAL"};

struct Draco {
    int view = none;
    std::array<int, attributes> ids = {none, none, none, none};
};

enum Mode : std::uint8_t { triangles = 4, strip = 5, fan = 6 };

struct Primitive {
    std::array<int, attributes> accessors = {none, none, none, none};
    int indices = none;
    std::int64_t mode = triangles;
    bool morphs = false;
    std::optional<Draco> draco;
};

struct Mesh {
    std::vector<Primitive> primitives;
};

/// Copies of a node: accessors of translations, rotations and scales.
struct Instances {
    int translation = none, rotation = none, scale = none;
};

struct Node {
    Affine map;
    int mesh = none;
    bool skinned = false;
    std::vector<int> children;
    std::optional<Instances> instances;
    std::string bad_instances;  ///< what is wrong with them, if they cannot be read
};

struct Model {
    std::vector<Buffer> buffers;
    std::vector<BufferView> views;
    std::vector<Accessor> accessors;
    std::vector<Mesh> meshes;
    std::vector<Node> nodes;
    std::vector<std::vector<int>> scenes;  ///< the roots of each
    int scene = 0;
    bool materials = false;
    std::vector<std::string> required;  ///< extensions

    bool needs(std::string_view extension) const;
};

/// \throws InputError if it is no JSON, or a part that is read has another type than the specification says
Model parse_model(std::string_view json, std::size_t file_bytes);

}  // namespace its::formats::gltf
