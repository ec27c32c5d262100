#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>  // tiny_gltf.h needs it
#include <map>

// Only the parser: no pictures, no files but through our callback, no globs of other libraries.
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>

#include "formats/affine.h"
#include "formats/readers.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"

namespace its::formats {

namespace {

using tinygltf::Model;

std::uint32_t little_endian_32(const char* bytes) {
    std::array<unsigned char, 4> b;
    std::memcpy(b.data(), bytes, 4);
    return std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 |
           std::uint32_t{b[3]} << 24;
}

/// Checks the header and the lengths of the chunks, and returns the JSON part. \throws InputError
std::string_view check_glb(std::string_view bytes) {
    const auto bad = [](std::string_view what) {
        throw InputError(fmt::format("not a usable GLB file: {}", what));
    };
    if (bytes.size() < 20) bad("its header has been cut");
    if (little_endian_32(bytes.data() + 4) != 2) bad("only version 2 is read");
    const std::uint64_t length = little_endian_32(bytes.data() + 8), json = little_endian_32(bytes.data() + 12);
    if (length > bytes.size()) bad(fmt::format("it has {} of {} bytes: it has been cut", bytes.size(), length));
    if (little_endian_32(bytes.data() + 16) != 0x4e4f534a) bad("the first chunk is not JSON");
    if (json == 0 || 20 + json > length) bad("its JSON is longer than the file");
    if (const std::uint64_t begin = 20 + json; begin < length) {
        if (begin + 8 > length) bad("its second chunk has no header");
        if (begin + 8 + little_endian_32(bytes.data() + begin) > length)
            bad("its second chunk is longer than the file");
    }
    return bytes.substr(20, json);
}

/// Refuses JSON that would exhaust the stack or the memory of its parsers: an empty node or material, three
/// bytes of JSON, takes a kilobyte of tinygltf's.
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

bool is_picture(const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    for (const char* known :
         {".png", ".jpg", ".jpeg", ".webp", ".ktx", ".ktx2", ".basis", ".dds", ".tga", ".bmp", ".gif"}) {
        if (extension == known) return true;
    }
    return false;
}

/// The files beside the model, as far as they may be read.
struct Siblings {
    const LoadSibling& load;
    std::uint64_t bytes = 0;  ///< of all so far
};

/// What tinygltf may load: plain paths at or below the file's own folder, 4 GiB in all, no pictures.
bool read_sibling(std::vector<unsigned char>* out, std::string* error, const std::string& path, void* user) {
    auto& [load, bytes] = *static_cast<Siblings*>(user);
    if (is_picture(path)) return false;  // a warning of tinygltf's that nobody reads
    const std::filesystem::path relative(path);
    bool plain = !path.empty() && relative.is_relative();
    for (const auto& part : relative) plain = plain && part != "..";
    try {
        if (!load || !plain)
            throw FileError(fmt::format("file '{}' is not at or below the folder of the model", path));
        const FileBytes file = load(path);
        const std::string_view data = text_of(file);
        bytes += data.size();
        if (bytes > 0xffffffff) throw FileError("its buffers have more than 4 GiB");
        out->assign(data.begin(), data.end());
        return true;
    } catch (const FileError& failure) {
        if (error) *error += failure.what();
        return false;
    }
}

Model load_model(std::string_view bytes, const LoadSibling& load) {
    const bool binary = bytes.starts_with("glTF");
    check_json(binary ? check_glb(bytes) : bytes, bytes.size());
    if (bytes.size() > 0xffffffff) throw InputError("glTF files beyond 4 GiB are not read");
    tinygltf::TinyGLTF loader;
    const auto no_image = [](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*,
                             int, void*) { return true; };
    loader.SetImageLoader(no_image, nullptr);
    Siblings siblings{load};
    loader.SetFsCallbacks(
        {[](const std::string&, void*) { return true; }, [](const std::string& path, void*) { return path; },
         read_sibling,
         [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; },
         &siblings});
    Model model;
    std::string error, warning;
    bool good = false;
    try {
        const auto size = static_cast<unsigned>(bytes.size());
        good = binary ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                                    reinterpret_cast<const unsigned char*>(bytes.data()), size)
                      : loader.LoadASCIIFromString(&model, &error, &warning, bytes.data(), size, "");
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& failure) {  // of the JSON library: a value of an unexpected type
        error = failure.what();
    }
    if (!good) {
        for (char& c : error) c = c == '\n' || c == '\r' ? ' ' : c;
        throw InputError(fmt::format("not a usable glTF file: {}", error.empty() ? "malformed" : error));
    }
    for (const std::string& extension : model.extensionsRequired) {
        if (extension == "KHR_draco_mesh_compression" || extension == "EXT_meshopt_compression") {
            throw InputError(
                fmt::format("it needs the extension {}, which is not read; write it uncompressed", extension));
        }
    }
    return model;
}

template <class T>
T load_number(const unsigned char* at) {
    T value;
    std::memcpy(&value, at, sizeof(T));  // glTF is little-endian, as are all machines that we build for
    return value;
}
static_assert(std::endian::native == std::endian::little);

/// Elements whose bytes are known to be there.
struct View {
    const unsigned char* data = nullptr;
    std::size_t count = 0, stride = 0;
    int component = 0;
    bool normalized = false;

    std::size_t component_size() const {
        return std::size_t(tinygltf::GetComponentSizeInBytes(std::uint32_t(component)));
    }

    /// Component k of element i; fixed-point ones as in the glTF specification, 3.6.2.2.
    double value(std::size_t i, std::size_t k) const {
        const unsigned char* const at = data + i * stride + k * component_size();
        const auto scaled = [&](double v, double largest) {
            return normalized ? std::max(v / largest, -1.0) : v;
        };
        switch (component) {
            case TINYGLTF_COMPONENT_TYPE_BYTE:
                return scaled(load_number<std::int8_t>(at), 127);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                return scaled(load_number<std::uint8_t>(at), 255);
            case TINYGLTF_COMPONENT_TYPE_SHORT:
                return scaled(load_number<std::int16_t>(at), 32767);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                return scaled(load_number<std::uint16_t>(at), 65535);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
                return load_number<std::uint32_t>(at);
            default:
                return double{load_number<float>(at)};
        }
    }

    void append_to(std::vector<double>& numbers, std::size_t components) const {
        numbers.reserve(numbers.size() + count * components);
        for (std::size_t i = 0; i < count; ++i) {
            for (std::size_t k = 0; k < components; ++k) numbers.push_back(value(i, k));
        }
    }
};

[[noreturn]] void bad_accessor(int index, std::string_view what) {
    throw InputError(fmt::format("glTF accessor {}: {}", index, what));
}

/// `count` elements of `components` numbers each. \throws InputError unless they lie within their buffer.
View view_of(const Model& model, int accessor, int buffer_view, std::size_t offset, int component,
             std::size_t components, std::size_t count) {
    if (buffer_view < 0 || std::size_t(buffer_view) >= model.bufferViews.size())
        bad_accessor(accessor, "it has no data");
    const tinygltf::BufferView& part = model.bufferViews[std::size_t(buffer_view)];
    if (part.buffer < 0 || std::size_t(part.buffer) >= model.buffers.size())
        bad_accessor(accessor, "it has no buffer");
    const std::vector<unsigned char>& bytes = model.buffers[std::size_t(part.buffer)].data;
    const int known = tinygltf::GetComponentSizeInBytes(std::uint32_t(component));
    if (known <= 0 || known > 4 || component == TINYGLTF_COMPONENT_TYPE_INT)
        bad_accessor(accessor, "unknown kind of number");

    const std::size_t size = std::size_t(known) * components;
    const std::size_t stride = part.byteStride != 0 ? part.byteStride : size;
    const std::size_t room = part.byteLength - std::min(part.byteLength, offset);
    if (part.byteOffset > bytes.size() || part.byteLength > bytes.size() - part.byteOffset ||
        offset > part.byteLength || (count > 0 && (room < size || count - 1 > (room - size) / stride))) {
        bad_accessor(accessor, "it lies outside of its buffer");
    }
    return {.data = bytes.data() + part.byteOffset + offset,
            .count = count,
            .stride = stride,
            .component = component};
}

/// The numbers of accessor `index`, one after the other. \throws InputError unless it has this type and its
/// bytes are there.
std::vector<double> numbers_of(const Model& model, int index, int type, MeshBuilder& mesh) {
    if (index < 0 || std::size_t(index) >= model.accessors.size()) bad_accessor(index, "there is none");
    const tinygltf::Accessor& accessor = model.accessors[std::size_t(index)];
    if (accessor.type != type) bad_accessor(index, "it has the wrong type");
    const auto components = std::size_t(std::max(tinygltf::GetNumComponentsInType(std::uint32_t(type)), 1));
    const bool sparse = accessor.sparse.isSparse;
    if (accessor.bufferView < 0 && !sparse) bad_accessor(index, "it has no data");
    mesh.charge_instance(accessor.count);
    std::vector<double> numbers;
    if (accessor.bufferView >= 0) {
        View view = view_of(model, index, accessor.bufferView, accessor.byteOffset, accessor.componentType,
                            components, accessor.count);
        view.normalized = accessor.normalized;
        view.append_to(numbers, components);
    } else {
        numbers.resize(accessor.count * components);  // zeros, says the specification
    }
    if (!sparse) return numbers;

    const auto& changes = accessor.sparse;
    const auto count = std::size_t(std::max(changes.count, 0));
    const View places =
        view_of(model, index, changes.indices.bufferView, std::size_t(changes.indices.byteOffset),
                changes.indices.componentType, 1, count);
    View values = view_of(model, index, changes.values.bufferView, std::size_t(changes.values.byteOffset),
                          accessor.componentType, components, count);
    values.normalized = accessor.normalized;
    for (std::size_t i = 0; i < count; ++i) {
        const double place = places.value(i, 0);
        if (!(place >= 0 && place < double(accessor.count))) bad_accessor(index, "a sparse index out of range");
        for (std::size_t k = 0; k < components; ++k)
            numbers[std::size_t(place) * components + k] = values.value(i, k);
    }
    return numbers;
}

/// A node's own transform: its matrix (column-major), or translation · rotation · scale.
Affine transform_of(const tinygltf::Node& node) {
    Affine map;
    if (const auto& m = node.matrix; m.size() == 16) {
        return {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
    }
    if (const auto& q = node.rotation; q.size() == 4) {
        const double x = q[0], y = q[1], z = q[2], w = q[3];
        map.x = {1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)};
        map.y = {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)};
        map.z = {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)};
    }
    if (const auto& s = node.scale; s.size() == 3) {
        map.x = s[0] * map.x, map.y = s[1] * map.y, map.z = s[2] * map.z;
    }
    if (const auto& t = node.translation; t.size() == 3) map.shift = {t[0], t[1], t[2]};
    return map;
}

class SceneReader {
public:
    SceneReader(const Model& model, MeshBuilder& mesh)
        : model_(model), mesh_(mesh), seen_(model.nodes.size()) {}

    void read() {
        if (model_.nodes.empty()) {  // no scene: the meshes as they are
            for (std::size_t i = 0; i < model_.meshes.size(); ++i) add_mesh(int(i), Affine{});
        } else {
            for (const int root : roots()) read_tree(root);
        }
        if (skipped_ > 0) mesh_.warn(fmt::format("{} primitive(s) of points or lines not read", skipped_));
        if (skinned_) mesh_.warn("skins and morph targets are not applied");
    }

private:
    /// The vertices of an accessor: the first one's number, and how many.
    struct Points {
        std::int64_t first;
        std::size_t count;
    };

    /// The nodes of the default scene, or of the first, or all that are nobody's child.
    std::vector<int> roots() const {
        if (!model_.scenes.empty()) {
            const auto chosen = std::size_t(std::max(model_.defaultScene, 0));
            if (chosen >= model_.scenes.size()) throw InputError("the glTF default scene does not exist");
            return model_.scenes[chosen].nodes;
        }
        std::vector<bool> is_child(model_.nodes.size());
        for (const auto& node : model_.nodes) {
            for (const int child : node.children) {
                if (child >= 0 && std::size_t(child) < is_child.size()) is_child[std::size_t(child)] = true;
            }
        }
        std::vector<int> found;
        for (std::size_t i = 0; i < is_child.size(); ++i) {
            if (!is_child[i]) found.push_back(int(i));
        }
        return found;
    }

    void read_tree(int root) {
        std::vector<std::pair<int, Affine>> pending = {{root, Affine{}}};
        while (!pending.empty()) {
            const auto [index, outer] = pending.back();
            pending.pop_back();
            if (index < 0 || std::size_t(index) >= model_.nodes.size())
                throw InputError("a glTF node does not exist");
            if (seen_[std::size_t(index)])
                throw InputError(fmt::format("the glTF node {} has two parents", index));
            seen_[std::size_t(index)] = true;
            const tinygltf::Node& node = model_.nodes[std::size_t(index)];
            const Affine map = outer * transform_of(node);
            skinned_ = skinned_ || node.skin >= 0;
            if (node.mesh >= 0) add_mesh(node.mesh, map);
            for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
                pending.emplace_back(*child, map);
            }
        }
    }

    void add_mesh(int index, const Affine& map) {
        if (std::size_t(index) >= model_.meshes.size()) throw InputError("a glTF mesh does not exist");
        std::map<VertexAccessors, Points> points_of;  // of this mesh; primitives may share them
        for (const auto& primitive : model_.meshes[std::size_t(index)].primitives) {
            const int mode = primitive.mode == -1 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
            if (mode < TINYGLTF_MODE_TRIANGLES || mode > TINYGLTF_MODE_TRIANGLE_FAN) {
                ++skipped_;
                continue;
            }
            skinned_ = skinned_ || !primitive.targets.empty();
            const VertexAccessors accessors = accessors_of(primitive);
            if (!primitive.attributes.contains("POSITION"))
                continue;  // nothing to draw, says the specification
            const auto [points, added] =
                points_of.try_emplace(accessors, Points{std::int64_t(mesh_.vertex_count()), 0});
            if (added) points->second.count = add_vertices(accessors, map);
            add_primitive(primitive, mode, points->second, map.determinant() < 0);
        }
    }

    /// Those of POSITION, COLOR_0, TEXCOORD_0 and NORMAL; −1: none, or not asked for.
    using VertexAccessors = std::array<int, 4>;

    VertexAccessors accessors_of(const tinygltf::Primitive& primitive) const {
        constexpr const char* names[] = {"POSITION", "COLOR_0", "TEXCOORD_0", "NORMAL"};
        VertexAccessors accessors;
        for (std::size_t i = 0; i < accessors.size(); ++i) {
            const auto found = primitive.attributes.find(names[i]);
            const bool wanted = i == 0 || mesh_.wants_attributes();
            accessors[i] = wanted && found != primitive.attributes.end() ? found->second : -1;
        }
        return accessors;
    }

    std::size_t add_vertices(const VertexAccessors& accessors, const Affine& map) {
        const std::vector<double> p = numbers_of(model_, accessors[0], TINYGLTF_TYPE_VEC3, mesh_);
        const std::uint64_t first = mesh_.vertex_count();
        for (std::size_t i = 0; i < p.size(); i += 3) mesh_.add_vertex(map({p[i], p[i + 1], p[i + 2]}));
        if (accessors[1] >= 0) add_colours(accessors[1], first, p.size() / 3);
        if (accessors[2] >= 0) {  // their v points down
            const std::vector<double> uv = attribute(accessors[2], TINYGLTF_TYPE_VEC2, p.size() / 3);
            for (std::size_t i = 0; i < uv.size(); i += 2)
                mesh_.texture.set_vertex(first + i / 2, {uv[i], 1 - uv[i + 1]});
        }
        if (accessors[3] >= 0) {
            // Normals go by the cofactors of the map, which is its inverse transposed but for a factor.
            const Affine turned{cross(map.y, map.z), cross(map.z, map.x), cross(map.x, map.y), {}};
            const std::vector<double> n = attribute(accessors[3], TINYGLTF_TYPE_VEC3, p.size() / 3);
            const double side = map.determinant() < 0 ? -1 : 1;
            for (std::size_t i = 0; i < n.size(); i += 3) {
                const Vec3 normal = side * turned({n[i], n[i + 1], n[i + 2]});
                const double length = norm(normal);
                mesh_.normals.set_vertex(first + i / 3, length > 0 ? (1 / length) * normal : Vec3{});
            }
        }
        return p.size() / 3;
    }

    void add_colours(int accessor, std::uint64_t first, std::size_t count) {
        const bool in_range = std::size_t(accessor) < model_.accessors.size();
        const int type = in_range ? model_.accessors[std::size_t(accessor)].type : TINYGLTF_TYPE_VEC4;
        const std::size_t components = type == TINYGLTF_TYPE_VEC3 ? 3 : 4;
        const std::vector<double> c =
            attribute(accessor, components == 3 ? TINYGLTF_TYPE_VEC3 : TINYGLTF_TYPE_VEC4, count);
        for (std::size_t i = 0; i < c.size(); i += components)
            mesh_.colours.set_vertex(first + i / components, {float(c[i]), float(c[i + 1]), float(c[i + 2]),
                                                              components == 4 ? float(c[i + 3]) : 1.0F});
        mesh_.byte_colours |=
            model_.accessors[std::size_t(accessor)].componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
    }

    /// \throws InputError unless there are as many elements as vertices
    std::vector<double> attribute(int accessor, int type, std::size_t vertices) const {
        std::vector<double> numbers = numbers_of(model_, accessor, type, mesh_);
        if (model_.accessors[std::size_t(accessor)].count != vertices)
            bad_accessor(accessor,
                         fmt::format("it has not as many elements as there are vertices, {}", vertices));
        return numbers;
    }

    void add_primitive(const tinygltf::Primitive& primitive, int mode, const Points& points, bool mirrored) {
        std::vector<double> indices;
        const bool indexed = primitive.indices >= 0;
        if (indexed) {
            indices = numbers_of(model_, primitive.indices, TINYGLTF_TYPE_SCALAR, mesh_);
            const auto& accessor = model_.accessors[std::size_t(primitive.indices)];
            if (accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT || accessor.normalized)
                throw InputError("glTF indices must be whole numbers");
        }
        const std::size_t count = indexed ? indices.size() : points.count;
        const auto vertex = [&](std::size_t i) {
            const std::int64_t v = indexed ? std::int64_t(indices[i]) : std::int64_t(i);
            return v >= 0 && std::size_t(v) < points.count ? points.first + v : -1;
        };
        const std::size_t step = mode == TINYGLTF_MODE_TRIANGLES ? 3 : 1;
        mesh_.charge_instance(count / step);
        for (std::size_t i = 2; i < count; i += step) {
            const bool odd = mode == TINYGLTF_MODE_TRIANGLE_STRIP && i % 2 == 1;
            const std::int64_t a = vertex(mode == TINYGLTF_MODE_TRIANGLE_FAN ? 0 : i - 2), b = vertex(i - 1),
                               c = vertex(i);
            // In strips, a triangle with a repeated index only steers.
            if (step == 1 && (a == b || b == c || c == a) && a >= 0 && b >= 0 && c >= 0) continue;
            odd != mirrored ? mesh_.add_triangle(b, a, c) : mesh_.add_triangle(a, b, c);
        }
    }

    const Model& model_;
    MeshBuilder& mesh_;
    std::vector<bool> seen_;
    std::uint64_t skipped_ = 0;
    bool skinned_ = false;
};

}  // namespace

MeshFile parse_gltf(std::string_view bytes, const LoadSibling& load, const ReadOptions& options) {
    const Model model = load_model(bytes, load);
    MeshBuilder mesh(bytes.size(), options);
    SceneReader(model, mesh).read();
    if (options.attributes && !(model.materials.empty() && model.images.empty()))
        mesh.warn_not_carried("materials and textures");
    return mesh.finish(bytes.starts_with("glTF") ? "glb" : "gltf");
}

}  // namespace its::formats
