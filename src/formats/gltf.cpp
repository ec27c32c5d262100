#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "base/quote.h"
#include "formats/affine.h"
#include "formats/colours.h"
#include "formats/gltf_data.h"
#include "formats/gltf_model.h"
#include "formats/readers.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"

namespace its::formats {

namespace gltf {

namespace {

std::uint32_t little_endian_32(const char* bytes) {
    std::array<unsigned char, 4> b;
    std::memcpy(b.data(), bytes, 4);
    return std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 |
           std::uint32_t{b[3]} << 24;
}

/// The parts of a GLB file; `binary` has no data if there is no such part.
struct Chunks {
    std::string_view json, binary;
};

/// \throws InputError unless the lengths of header and chunks fit
Chunks split_glb(std::string_view bytes) {
    const auto bad = [](std::string_view what) {
        throw InputError(fmt::format("not a usable GLB file: {}", what));
    };
    if (bytes.size() < 20) bad("its header has been cut");
    if (little_endian_32(bytes.data() + 4) != 2) bad("only version 2 is read");
    const std::uint64_t length = little_endian_32(bytes.data() + 8), json = little_endian_32(bytes.data() + 12);
    if (length > bytes.size()) bad(fmt::format("it has {} of {} bytes: it has been cut", bytes.size(), length));
    if (little_endian_32(bytes.data() + 16) != 0x4e4f534a) bad("the first chunk is not JSON");
    if (json == 0 || 20 + json > length) bad("its JSON is longer than the file");
    Chunks chunks{bytes.substr(20, json), {}};
    std::uint64_t begin = 20 + json;
    while (begin < length) {
        if (begin + 8 > length) bad("a chunk has no header");
        const std::uint64_t size = little_endian_32(bytes.data() + begin);
        if (begin + 8 + size > length) bad("a chunk is longer than the file");
        const bool is_binary = little_endian_32(bytes.data() + begin + 4) == 0x004e4942;
        if (is_binary && chunks.binary.data() == nullptr) chunks.binary = bytes.substr(begin + 8, size);
        begin += 8 + size;
    }
    return chunks;
}

/// Extensions that say nothing about shape.
bool is_about_looks(std::string_view extension) {
    for (const std::string_view prefix : {"KHR_materials_", "EXT_materials_", "KHR_texture_", "EXT_texture_"})
        if (extension.starts_with(prefix)) return true;
    for (const std::string_view known :
         {"KHR_lights_punctual", "EXT_lights_ies", "EXT_lights_image_based", "KHR_techniques_webgl",
          "MSFT_texture_dds", "KHR_xmp", "KHR_xmp_json_ld"})
        if (extension == known) return true;
    return false;
}

/// \throws InputError if the file cannot be understood without an extension that we do not know
void check_extensions(const Model& model) {
    for (const std::string& extension : model.required) {
        if (extension == "KHR_mesh_quantization" || extension == "EXT_mesh_gpu_instancing" ||
            is_about_looks(extension))
            continue;
        const bool meshopt = extension == "EXT_meshopt_compression" || extension == "KHR_meshopt_compression";
        if (meshopt && can_decode_meshopt()) continue;
        if (extension == "KHR_draco_mesh_compression" && can_decode_draco()) continue;
        throw InputError(fmt::format("it needs the glTF extension {}, which is not read; write it without",
                                     quotable(extension)));
    }
}

class SceneReader {
public:
    SceneReader(const Model& model, Data& data, MeshBuilder& mesh)
        : model_(model), data_(data), mesh_(mesh), seen_(model.nodes.size()) {}

    void read() {
        if (model_.nodes.empty()) {  // no scene: the meshes as they are
            for (std::size_t i = 0; i < model_.meshes.size(); ++i) add_mesh(int(i), Affine{});
        } else {
            for (const int root : roots()) read_tree(root);
        }
        if (skipped_ > 0) mesh_.warn(fmt::format("{} primitive(s) of points or lines not read", skipped_));
        if (skinned_) mesh_.warn("skins and morph targets are not applied");
        if (!plain_.empty())
            mesh_.warn(fmt::format("data of {} cannot be read: the file's uncompressed ones are", plain_));
    }

private:
    /// The nodes of the default scene, or of the first, or all that are nobody's child.
    std::vector<int> roots() const {
        if (!model_.scenes.empty()) {
            if (std::size_t(model_.scene) >= model_.scenes.size())
                throw InputError("the glTF default scene does not exist");
            return model_.scenes[std::size_t(model_.scene)];
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
            const Node& node = model_.nodes[std::size_t(index)];
            const Affine map = outer * node.map;
            skinned_ = skinned_ || node.skinned;
            if (node.mesh != none)
                for (const Affine& copy : copies(node)) add_mesh(node.mesh, map * copy);
            for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
                pending.emplace_back(*child, map);
            }
        }
    }

    /// Where a node's mesh is drawn, within the node: once, or where EXT_mesh_gpu_instancing says. Instances
    /// that cannot be read are an error only in a file that cannot do without them.
    std::vector<Affine> copies(const Node& node) {
        if (!node.instances && node.bad_instances.empty()) return {Affine{}};
        try {
            if (!node.instances) throw InputError(node.bad_instances);
            return instances(*node.instances);
        } catch (const InputError& error) {
            constexpr const char* name = "EXT_mesh_gpu_instancing";
            if (model_.needs(name)) throw InputError(fmt::format("{}: {}", name, error.what()));
            mesh_.warn(fmt::format("{}: {}; read without instances", name, quotable(error.what(), 90)));
            return {Affine{}};
        }
    }

    std::vector<Affine> instances(const Instances& of) {
        const auto read = [&](int accessor, Type type) {
            return accessor == none ? std::vector<double>{} : data_.numbers(accessor, type);
        };
        const std::vector<double> t = read(of.translation, Type::vec3), r = read(of.rotation, Type::vec4),
                                  s = read(of.scale, Type::vec3);
        const std::size_t count = std::max({t.size() / 3, r.size() / 4, s.size() / 3});
        const auto fits = [&](int accessor, std::size_t found) { return accessor == none || found == count; };
        if (of.translation == none && of.rotation == none && of.scale == none)
            throw InputError("neither translations nor rotations nor scales");
        if (!fits(of.translation, t.size() / 3) || !fits(of.rotation, r.size() / 4) ||
            !fits(of.scale, s.size() / 3))
            throw InputError("not as many translations as rotations and scales");
        std::vector<Affine> found;
        for (std::size_t i = 0; i < count; ++i) {
            std::array<double, 4> q = {0, 0, 0, 1};
            if (!r.empty()) {  // of length 1 but for the rounding of 8 or 16 bits
                std::copy_n(r.begin() + std::ptrdiff_t(4 * i), 4, q.begin());
                const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
                if (!(length > 0 && std::isfinite(length))) throw InputError("a rotation is none");
                for (double& x : q) x /= length;
            }
            const auto vector = [&](const std::vector<double>& from, double missing) {
                return from.empty() ? Vec3{missing, missing, missing}
                                    : Vec3{from[3 * i], from[3 * i + 1], from[3 * i + 2]};
            };
            found.push_back(placed(vector(t, 0), q, vector(s, 1)));
        }
        return found;
    }

    /// What the vertices of a primitive are made of.
    struct Source {
        std::array<int, attributes> accessors;
        const Draco* draco;
        auto operator<=>(const Source&) const = default;  // NOLINT(modernize-use-nullptr): its own
    };
    /// The vertices of a source: the first one's number, and how many.
    struct Points {
        std::int64_t first;
        std::size_t count;
    };

    void add_mesh(int index, const Affine& map) {
        if (std::size_t(index) >= model_.meshes.size()) throw InputError("a glTF mesh does not exist");
        mesh_.charge_instance(1);
        std::map<Source, Points> points_of;  // of this mesh; primitives may share them
        for (const Primitive& primitive : model_.meshes[std::size_t(index)].primitives) {
            if (primitive.mode < triangles || primitive.mode > fan) {
                ++skipped_;
                continue;
            }
            skinned_ = skinned_ || primitive.morphs;
            if (primitive.accessors[position] == none) continue;  // nothing to draw, says the specification
            const Unpacked* const unpacked = primitive.draco ? unpack(primitive) : nullptr;
            const Source source{wanted(primitive), unpacked != nullptr ? &*primitive.draco : nullptr};
            const auto [points, added] =
                points_of.try_emplace(source, Points{std::int64_t(mesh_.vertex_count()), 0});
            if (added) points->second.count = add_vertices(source.accessors, unpacked, map);
            add_primitive(primitive, unpacked, points->second, map.determinant() < 0);
        }
    }

    /// A primitive's accessors; none for attributes that were not asked for.
    std::array<int, attributes> wanted(const Primitive& primitive) const {
        std::array<int, attributes> accessors = primitive.accessors;
        if (!mesh_.wants_attributes()) std::fill(accessors.begin() + 1, accessors.end(), none);
        return accessors;
    }

    /// What Draco packed, unpacked once; null where it cannot be and the file has it uncompressed too.
    const Unpacked* unpack(const Primitive& primitive) {
        const Draco& packed = *primitive.draco;
        if (const auto known = unpacked_.find(&packed); known != unpacked_.end())
            return known->second ? &*known->second : nullptr;
        std::optional<Unpacked> found;
        try {
            std::array<Wanted, attributes> types;
            const std::array<int, attributes> accessors = wanted(primitive);
            for (std::size_t i = 0; i < std::size_t{attributes}; ++i) {
                if (accessors[i] == none) continue;
                const Accessor& accessor = data_.accessor(accessors[i]);
                types[i].type = accessor.type;
                const std::size_t bytes = component_size(accessor.place.component);
                if (accessor.normalized) types[i].unit = bytes == 1 ? 255 : 65535;
            }
            found = decode_draco(packed, data_.view(packed.view), types,
                                 [&](std::uint64_t claimed) { mesh_.charge_instance(claimed); });
        } catch (const InputError&) {
            constexpr const char* name = "KHR_draco_mesh_compression";
            if (model_.needs(name) || !data_.has_view(primitive.accessors[position])) throw;
            plain_ = name;
        }
        const auto& kept = unpacked_.emplace(&packed, std::move(found)).first->second;
        return kept ? &*kept : nullptr;
    }

    /// The numbers of an attribute, which has as many elements as there are vertices.
    std::vector<double> numbers(Attribute attribute, int accessor, Type type, const Unpacked* unpacked) {
        if (unpacked == nullptr || unpacked->numbers[attribute].empty()) return data_.numbers(accessor, type);
        mesh_.charge_instance(unpacked->numbers[attribute].size() / std::size_t(type));
        if (data_.accessor(accessor).type != type)
            throw InputError(fmt::format("glTF accessor {}: it has the wrong type", accessor));
        return unpacked->numbers[attribute];
    }

    std::size_t add_vertices(const std::array<int, attributes>& accessors, const Unpacked* unpacked,
                             const Affine& map) {
        const std::vector<double> p = numbers(position, accessors[position], Type::vec3, unpacked);
        const std::uint64_t first = mesh_.vertex_count();
        const std::size_t count = p.size() / 3;
        for (std::size_t i = 0; i < p.size(); i += 3) mesh_.add_vertex(map({p[i], p[i + 1], p[i + 2]}));
        const auto read = [&](Attribute attribute, Type type) {
            std::vector<double> found = numbers(attribute, accessors[attribute], type, unpacked);
            if (found.size() != count * std::size_t(type))
                throw InputError(
                    fmt::format("glTF accessor {}: it has not as many elements as there are vertices, {}",
                                accessors[attribute], count));
            return found;
        };
        if (accessors[colour] != none) {
            const bool opaque = data_.accessor(accessors[colour]).type == Type::vec3;
            add_colours(accessors[colour], read(colour, opaque ? Type::vec3 : Type::vec4), first,
                        opaque ? 3 : 4);
        }
        if (accessors[texture] != none) {  // their v points down
            const std::vector<double> uv = read(texture, Type::vec2);
            for (std::size_t i = 0; i < uv.size(); i += 2)
                mesh_.texture.set_vertex(first + i / 2, {uv[i], 1 - uv[i + 1]});
        }
        if (accessors[normal] != none) add_normals(read(normal, Type::vec3), first, map);
        return count;
    }

    /// They are linear; ours are sRGB. Bytes of that, which need 16 bits here, become the same bytes again.
    void add_colours(int accessor, const std::vector<double>& c, std::uint64_t first, std::size_t components) {
        constexpr int bytes = 5121, shorts = 5123;
        const int kind = data_.accessor(accessor).place.component;
        bool of_bytes = kind == shorts;
        for (std::size_t i = 0; i < c.size() && of_bytes; ++i)
            of_bytes = i % components == 3 || is_of_byte(c[i]);
        for (std::size_t i = 0; i < c.size(); i += components) {
            Colour srgb = {0, 0, 0, components == 4 ? float(c[i + 3]) : 1.0F};
            for (std::size_t k = 0; k < 3; ++k) {
                const double x = srgb_of_linear(c[i + k]);
                srgb[k] = float(of_bytes ? std::round(255 * x) / 255 : x);
            }
            mesh_.colours.set_vertex(first + i / components, srgb);
        }
        mesh_.byte_colours |= kind == bytes || of_bytes;
    }

    /// Normals go by the cofactors of the map, which is its inverse transposed but for a factor.
    void add_normals(const std::vector<double>& n, std::uint64_t first, const Affine& map) {
        const Affine turned{cross(map.y, map.z), cross(map.z, map.x), cross(map.x, map.y), {}};
        const double side = map.determinant() < 0 ? -1 : 1;
        for (std::size_t i = 0; i < n.size(); i += 3) {
            const Vec3 direction = side * turned({n[i], n[i + 1], n[i + 2]});
            const double length = norm(direction);
            mesh_.normals.set_vertex(first + i / 3, length > 0 ? (1 / length) * direction : Vec3{});
        }
    }

    /// The indices of a primitive; empty if it has none.
    std::vector<double> indices_of(const Primitive& primitive) {
        if (primitive.indices == none) return {};
        std::vector<double> indices = data_.numbers(primitive.indices, Type::scalar);
        const Accessor& accessor = data_.accessor(primitive.indices);
        constexpr int real = 5126;
        if (accessor.place.component == real || accessor.normalized)
            throw InputError("glTF indices must be whole numbers");
        return indices;
    }

    void add_primitive(const Primitive& primitive, const Unpacked* unpacked, const Points& points,
                       bool mirrored) {
        const std::vector<double> own = unpacked == nullptr ? indices_of(primitive) : std::vector<double>{};
        const std::vector<double>& indices = unpacked == nullptr ? own : unpacked->indices;
        const bool indexed = unpacked != nullptr || primitive.indices != none;
        const std::int64_t mode = unpacked == nullptr ? primitive.mode : std::int64_t{triangles};
        const std::size_t count = indexed ? indices.size() : points.count;
        const auto vertex = [&](std::size_t i) {
            const std::int64_t v = indexed ? std::int64_t(indices[i]) : std::int64_t(i);
            return v >= 0 && std::size_t(v) < points.count ? points.first + v : -1;
        };
        const std::size_t step = mode == triangles ? 3 : 1;
        mesh_.charge_instance(count / step);
        for (std::size_t i = 2; i < count; i += step) {
            const bool odd = mode == strip && i % 2 == 1;
            const std::int64_t a = vertex(mode == fan ? 0 : i - 2), b = vertex(i - 1), c = vertex(i);
            // In strips, a triangle with a repeated index only steers.
            if (step == 1 && (a == b || b == c || c == a) && a >= 0 && b >= 0 && c >= 0) continue;
            odd != mirrored ? mesh_.add_triangle(b, a, c) : mesh_.add_triangle(a, b, c);
        }
    }

    const Model& model_;
    Data& data_;
    MeshBuilder& mesh_;
    std::vector<bool> seen_;
    std::map<const Draco*, std::optional<Unpacked>> unpacked_;
    std::uint64_t skipped_ = 0;
    bool skinned_ = false;
    std::string plain_;  ///< the extension whose data were not read, but uncompressed ones
};

}  // namespace

}  // namespace gltf

MeshFile parse_gltf(std::string_view bytes, const LoadSibling& load, const ReadOptions& options) {
    const bool binary = bytes.starts_with("glTF");
    const gltf::Chunks chunks = binary ? gltf::split_glb(bytes) : gltf::Chunks{bytes, {}};
    const gltf::Model model = gltf::parse_model(chunks.json, bytes.size());
    gltf::check_extensions(model);
    MeshBuilder mesh(bytes.size(), options);
    gltf::Data data(model, chunks.binary, load, mesh);
    gltf::SceneReader(model, data, mesh).read();
    if (options.attributes && model.materials) mesh.warn_not_carried("materials and textures");
    MeshFile file = mesh.finish(binary ? "glb" : "gltf");
    file.up = UpAxis::y;  // glTF 2.0, 3.4
    return file;
}

}  // namespace its::formats
