#include "formats/gltf_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/quote.h"
#include "formats/text.h"
#include "its/base.h"

namespace its::formats::gltf {

namespace {

using Json = nlohmann::json;

/// Refuses JSON that would exhaust the stack or the memory of its parser: an empty list, three bytes of JSON,
/// takes some sixty of its.
void check_json(std::string_view json, std::size_t file_bytes) {
    constexpr int deepest = 100;
    const std::uint64_t most = (std::uint64_t{1} << 20) + file_bytes / 32;
    std::uint64_t objects = 0;
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (in_string) {
            i += c == '\\';
            in_string = c != '"';
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            if (++depth > deepest) throw InputError("its JSON is nested more than 100 levels deep");
            if (++objects > most)
                throw InputError(
                    fmt::format("its JSON has more than {} objects and lists, out of all proportion", most));
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
}

[[noreturn]] void bad(std::string_view key, std::string_view wanted) {
    throw InputError(fmt::format("not a usable glTF file: '{}' is not {}", key, wanted));
}

/// The member of an object, or null.
const Json* member(const Json& object, const char* key) {
    if (!object.is_object()) return nullptr;
    const auto found = object.find(key);
    return found == object.end() || found->is_null() ? nullptr : &*found;
}

/// A member that is an object; one without members if there is none.
const Json& object_in(const Json& object, const char* key) {
    static const Json empty = Json::object();
    const Json* const found = member(object, key);
    if (found == nullptr) return empty;
    if (!found->is_object()) bad(key, "an object");
    return *found;
}

const Json& list_in(const Json& object, const char* key) {
    static const Json empty = Json::array();
    const Json* const found = member(object, key);
    if (found == nullptr) return empty;
    if (!found->is_array()) bad(key, "a list");
    return *found;
}

/// A whole number from 0 that is in the file as one, or as 1.0.
std::optional<std::size_t> whole_number(const Json& value) {
    if (value.is_number_unsigned()) return value.get<std::size_t>();
    if (!value.is_number_float()) return {};
    const double number = value.get<double>();
    return number >= 0 && number < 0x1p53 && number == double(std::size_t(number))
               ? std::optional(std::size_t(number))
               : std::nullopt;
}

std::size_t size_in(const Json& object, const char* key, std::size_t missing = 0) {
    const Json* const found = member(object, key);
    if (found == nullptr) return missing;
    const auto value = whole_number(*found);
    if (!value) bad(key, "a whole number");
    return *value;
}

/// The number of something in a list of the file.
int index_of(const Json& value, const char* key) {
    if (value.is_number_integer() && value == none) return none;
    const auto index = whole_number(value);
    if (!index || *index > std::size_t{std::numeric_limits<int>::max()}) bad(key, "a whole number");
    return int(*index);
}

int index_in(const Json& object, const char* key) {
    const Json* const found = member(object, key);
    return found == nullptr ? none : index_of(*found, key);
}

std::vector<int> indices_in(const Json& object, const char* key) {
    std::vector<int> found;
    for (const Json& value : list_in(object, key)) found.push_back(index_of(value, key));
    return found;
}

std::string text_in(const Json& object, const char* key) {
    const Json* const found = member(object, key);
    if (found == nullptr) return {};
    if (!found->is_string()) bad(key, "text");
    return found->get<std::string>();
}

bool truth_in(const Json& object, const char* key) {
    const Json* const found = member(object, key);
    if (found == nullptr) return false;
    if (!found->is_boolean()) bad(key, "true or false");
    return found->get<bool>();
}

/// N numbers, or none at all.
template <std::size_t N>
std::optional<std::array<double, N>> numbers_in(const Json& object, const char* key) {
    const Json* const found = member(object, key);
    if (found == nullptr) return {};
    std::array<double, N> numbers;
    if (!found->is_array() || found->size() != N) bad(key, fmt::format("{} numbers", N));
    for (std::size_t i = 0; i < N; ++i) {
        if (!(*found)[i].is_number()) bad(key, fmt::format("{} numbers", N));
        numbers[i] = (*found)[i].get<double>();
    }
    return numbers;
}

constexpr const char* meshopt_names[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

Buffer read_buffer(const Json& json) {
    Buffer buffer;
    if (member(json, "uri") != nullptr) buffer.uri = text_in(json, "uri");
    buffer.length = size_in(json, "byteLength");
    for (const char* const name : meshopt_names)
        buffer.fallback |= truth_in(object_in(object_in(json, "extensions"), name), "fallback");
    return buffer;
}

BufferView read_view(const Json& json) {
    BufferView view{index_in(json, "buffer"),
                    size_in(json, "byteOffset"),
                    size_in(json, "byteLength"),
                    size_in(json, "byteStride"),
                    {}};
    const Json& extensions = object_in(json, "extensions");
    for (const char* const name : meshopt_names) {
        if (member(extensions, name) == nullptr) continue;
        const Json& packed = object_in(extensions, name);
        view.meshopt = Meshopt{name,
                               text_in(packed, "mode"),
                               text_in(packed, "filter"),
                               index_in(packed, "buffer"),
                               size_in(packed, "byteOffset"),
                               size_in(packed, "byteLength"),
                               size_in(packed, "byteStride"),
                               size_in(packed, "count")};
    }
    return view;
}

Place read_place(const Json& json, int component) {
    return {index_in(json, "bufferView"), size_in(json, "byteOffset"), component};
}

Accessor read_accessor(const Json& json) {
    constexpr std::string_view types[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    Accessor accessor;
    accessor.place = read_place(json, int(std::min<std::size_t>(size_in(json, "componentType"), 0xffff)));
    accessor.count = size_in(json, "count");
    accessor.normalized = truth_in(json, "normalized");
    const std::string type = text_in(json, "type");
    for (std::size_t i = 0; i < std::size(types); ++i)
        if (type == types[i]) accessor.type = Type(i + 1);
    if (member(json, "sparse") != nullptr) {
        const Json& sparse = object_in(json, "sparse");
        const Json& indices = object_in(sparse, "indices");
        accessor.sparse =
            Sparse{size_in(sparse, "count"),
                   read_place(indices, int(std::min<std::size_t>(size_in(indices, "componentType"), 0xffff))),
                   read_place(object_in(sparse, "values"), accessor.place.component)};
    }
    return accessor;
}

Primitive read_primitive(const Json& json) {
    Primitive primitive;
    const Json& named = object_in(json, "attributes");
    for (std::size_t i = 0; i < attribute_names.size(); ++i)
        primitive.accessors[i] = index_in(named, attribute_names[i].data());
    primitive.indices = index_in(json, "indices");
    primitive.mode = std::int64_t(std::min<std::size_t>(size_in(json, "mode", triangles), 0xff));
    primitive.morphs = !list_in(json, "targets").empty();
    constexpr const char* name = "KHR_draco_mesh_compression";
    if (member(object_in(json, "extensions"), name) != nullptr) {
        const Json& packed = object_in(object_in(json, "extensions"), name);
        primitive.draco.emplace();
        primitive.draco->view = index_in(packed, "bufferView");
        for (std::size_t i = 0; i < attribute_names.size(); ++i)
            primitive.draco->ids[i] = index_in(object_in(packed, "attributes"), attribute_names[i].data());
    }
    return primitive;
}

Mesh read_mesh(const Json& json) {
    Mesh mesh;
    for (const Json& primitive : list_in(json, "primitives"))
        mesh.primitives.push_back(read_primitive(primitive));
    return mesh;
}

/// A node's own transform: its matrix (column-major), or translation · rotation · scale.
Affine read_transform(const Json& json) {
    if (const auto matrix = numbers_in<16>(json, "matrix")) {
        const auto& m = *matrix;
        return {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
    }
    const auto t = numbers_in<3>(json, "translation"), s = numbers_in<3>(json, "scale");
    const auto q = numbers_in<4>(json, "rotation");
    return placed(t ? Vec3{(*t)[0], (*t)[1], (*t)[2]} : Vec3{}, q.value_or(std::array<double, 4>{0, 0, 0, 1}),
                  s ? Vec3{(*s)[0], (*s)[1], (*s)[2]} : Vec3{1, 1, 1});
}

Node read_node(const Json& json) {
    Node node;
    node.map = read_transform(json);
    node.mesh = index_in(json, "mesh");
    node.skinned = index_in(json, "skin") != none;
    node.children = indices_in(json, "children");
    constexpr const char* name = "EXT_mesh_gpu_instancing";
    try {
        if (member(object_in(json, "extensions"), name) == nullptr) return node;
        const Json& named = object_in(object_in(object_in(json, "extensions"), name), "attributes");
        node.instances =
            Instances{index_in(named, "TRANSLATION"), index_in(named, "ROTATION"), index_in(named, "SCALE")};
    } catch (const InputError& error) {  // only bad where the extension is required
        node.bad_instances = error.what();
    }
    return node;
}

template <class T>
void read_all(const Json& json, const char* key, std::vector<T>& found, T (*read)(const Json&)) {
    const Json& list = list_in(json, key);
    found.reserve(list.size());
    for (const Json& item : list) {
        if (!item.is_object()) bad(key, "a list of objects");
        found.push_back(read(item));
    }
}

}  // namespace

bool Model::needs(std::string_view extension) const {
    return std::find(required.begin(), required.end(), extension) != required.end();
}

Model parse_model(std::string_view text, std::size_t file_bytes) {
    check_json(text, file_bytes);
    while (text.ends_with('\0')) text.remove_suffix(1);  // padding that should be blanks
    Json json;
    try {
        json = Json::parse(text.begin(), text.end());
    } catch (const Json::exception& error) {
        throw InputError(fmt::format("not a usable glTF file: {}", quotable(error.what(), 120)));
    }
    if (!json.is_object()) throw InputError("not a usable glTF file: its JSON is no object");
    if (const std::string version = text_in(object_in(json, "asset"), "version");
        !version.empty() && !version.starts_with("2"))
        throw InputError(
            fmt::format("not a usable glTF file: its version is '{}'; only 2 is read", quotable(version, 20)));
    Model model;
    read_all(json, "buffers", model.buffers, read_buffer);
    read_all(json, "bufferViews", model.views, read_view);
    read_all(json, "accessors", model.accessors, read_accessor);
    read_all(json, "meshes", model.meshes, read_mesh);
    read_all(json, "nodes", model.nodes, read_node);
    for (const Json& scene : list_in(json, "scenes")) model.scenes.push_back(indices_in(scene, "nodes"));
    model.scene = std::max(index_in(json, "scene"), 0);
    model.materials = !list_in(json, "materials").empty() || !list_in(json, "images").empty();
    for (const Json& name : list_in(json, "extensionsRequired")) {
        if (!name.is_string()) bad("extensionsRequired", "a list of names");
        model.required.push_back(name.get<std::string>());
    }
    return model;
}

}  // namespace its::formats::gltf
