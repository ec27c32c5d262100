#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/output_file.h"
#include "formats/readers.h"
#include "geometry/vec3.h"
#include "its/mesh.h"
#include "its/mesh_file.h"
#include "its/version.h"
#include "mesh/attributes.h"

namespace its {
using namespace formats;

namespace {

/// Text and numbers, buffered on their way into a file that appears complete or not at all.
class NewFile {
public:
    explicit NewFile(const std::filesystem::path& path) : file_(path) { buffer_.reserve(capacity + 256); }

    NewFile& operator<<(std::string_view text) {
        buffer_.append(text);
        if (buffer_.size() >= capacity) flush();
        return *this;
    }
    /// The shortest text that reads back as the same number.
    NewFile& operator<<(double value) { return *this << number(value); }
    NewFile& operator<<(float value) { return *this << number(value); }
    NewFile& operator<<(std::uint64_t value) { return *this << number(value); }

    /// The bytes of a number, least significant first.
    template <class T>
    NewFile& raw(T value) {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), &value, sizeof(T));
        if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
        return *this << std::string_view(bytes.data(), bytes.size());
    }

    /// Gives the file its name. \throws FileError if any byte could not be written (a full disk).
    void commit() {
        flush();
        file_.commit();
    }

private:
    static constexpr std::size_t capacity = std::size_t{1} << 20;

    template <class T>
    std::string_view number(T value) {
        const auto [end, error] = std::to_chars(text_, text_ + sizeof text_, value);
        return {text_, std::size_t(end - text_)};
    }
    void flush() {
        file_.write(std::as_bytes(std::span(buffer_)));
        buffer_.clear();
    }

    OutputFile file_;
    std::string buffer_;
    char text_[32];
};

/// Attributes of vertices: each list is empty or has one value for each vertex.
struct VertexAttributes {
    std::vector<Colour> colours;
    std::vector<TexturePoint> texture;
    std::vector<Vec3> normals;
    bool byte_colours = false;
};

std::uint8_t byte_of(float x) {
    return std::uint8_t(std::lround(std::clamp(x, 0.0F, 1.0F) * 255));
}

template <class Value>
std::vector<Value> values_at(const CornerValues<Value>& of, std::span<const std::uint64_t> corners) {
    std::vector<Value> values;
    if (of.empty()) return values;
    values.reserve(corners.size());
    for (const std::uint64_t c : corners) values.push_back(of.at(c / 3, c % 3));
    return values;
}

/// The mesh with a vertex for each wedge, and the values there.
struct SplitMesh {
    Mesh mesh;
    VertexAttributes attributes;

    SplitMesh(const Mesh& whole, const MeshAttributes& of) {
        mesh::Wedges wedges = mesh::wedges_of(whole.triangles, whole.vertices.size(), of);
        for (const std::uint64_t c : wedges.first)
            mesh.vertices.push_back(whole.vertices[whole.triangles[c / 3][c % 3]]);
        mesh.triangles = std::move(wedges.triangles);
        attributes = {values_at(of.colours, wedges.first), values_at(of.texture, wedges.first),
                      values_at(of.normals, wedges.first), of.byte_colours};
    }
};

/// Texture coordinates and normals have tables of their own; a colour belongs to its vertex.
void write_obj(const Mesh& mesh, std::span<const Colour> colours, const CornerValues<TexturePoint>& texture,
               const CornerValues<Vec3>& normals, NewFile& file) {
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3& v = mesh.vertices[i];
        file << "v " << v.x << " " << v.y << " " << v.z;
        if (!colours.empty()) file << " " << colours[i][0] << " " << colours[i][1] << " " << colours[i][2];
        file << "\n";
    }
    for (const TexturePoint& uv : texture.values) file << "vt " << uv[0] << " " << uv[1] << "\n";
    for (const Vec3& n : normals.values) file << "vn " << n.x << " " << n.y << " " << n.z << "\n";
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        file << "f";
        for (std::size_t k = 0; k < 3; ++k) {
            file << " " << std::uint64_t{mesh.triangles[t][k]} + 1;
            if (texture.empty() && normals.empty()) continue;
            file << "/";
            if (!texture.empty()) file << std::uint64_t{texture.corners[t][k]} + 1;
            if (!normals.empty()) file << "/" << std::uint64_t{normals.corners[t][k]} + 1;
        }
        file << "\n";
    }
}

void write_off(const Mesh& mesh, const VertexAttributes& attributes, NewFile& file) {
    const auto& [colours, texture, normals, bytes] = attributes;
    file << (texture.empty() ? "" : "ST") << (colours.empty() ? "" : "C") << (normals.empty() ? "" : "N")
         << "OFF\n"
         << std::uint64_t{mesh.vertices.size()} << " " << std::uint64_t{mesh.triangles.size()} << " 0\n";
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3& v = mesh.vertices[i];
        file << v.x << " " << v.y << " " << v.z;
        if (!normals.empty()) file << " " << normals[i].x << " " << normals[i].y << " " << normals[i].z;
        if (!colours.empty())
            for (const float x : colours[i]) {
                if (bytes)
                    file << " " << std::uint64_t{byte_of(x)};
                else
                    file << " " << x;
            }
        if (!texture.empty()) file << " " << texture[i][0] << " " << texture[i][1];
        file << "\n";
    }
    for (const auto& [a, b, c] : mesh.triangles) {
        file << "3 " << std::uint64_t{a} << " " << std::uint64_t{b} << " " << std::uint64_t{c} << "\n";
    }
}

void write_ply(const Mesh& mesh, const VertexAttributes& attributes, NewFile& file) {
    const auto& [colours, texture, normals, bytes] = attributes;
    // Signed indices are what most programs expect; they do for all but the largest meshes.
    const bool small = mesh.vertices.size() <= std::size_t{std::numeric_limits<std::int32_t>::max()};
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << std::uint64_t{mesh.vertices.size()}
         << "\nproperty double x\nproperty double y\nproperty double z\n";
    if (!normals.empty()) file << "property double nx\nproperty double ny\nproperty double nz\n";
    if (!colours.empty())
        for (const char* name : {"red", "green", "blue", "alpha"})
            file << "property " << (bytes ? "uchar " : "float ") << name << "\n";
    if (!texture.empty()) file << "property double s\nproperty double t\n";
    file << "element face " << std::uint64_t{mesh.triangles.size()} << "\nproperty list uchar "
         << (small ? "int" : "uint") << " vertex_indices\nend_header\n";
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3& v = mesh.vertices[i];
        file.raw(v.x).raw(v.y).raw(v.z);
        if (!normals.empty()) file.raw(normals[i].x).raw(normals[i].y).raw(normals[i].z);
        if (!colours.empty())
            for (const float x : colours[i]) bytes ? file.raw(byte_of(x)) : file.raw(x);
        if (!texture.empty()) file.raw(texture[i][0]).raw(texture[i][1]);
    }
    for (const auto& [a, b, c] : mesh.triangles) file.raw(std::uint8_t{3}).raw(a).raw(b).raw(c);
}

/// Coordinates are rounded to 32 bits: the format has no others.
void write_stl(const Mesh& mesh, NewFile& file) {
    if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max()) {
        throw InputError("an STL file holds at most 4294967295 triangles; write .ply instead");
    }
    std::string header = "binary STL";  // must not begin with "solid"
    header.resize(80, ' ');
    file << header;
    file.raw(std::uint32_t(mesh.triangles.size()));
    const auto put = [&](Vec3 v) { file.raw(float(v.x)).raw(float(v.y)).raw(float(v.z)); };
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
        const Vec3 n = cross(b - a, c - a);
        const double length = norm(n);
        put(length > 0 && std::isfinite(length) ? (1 / length) * n : Vec3{});
        put(a), put(b), put(c);
        file.raw(std::uint16_t{0});
    }
}

/// \throws InputError on what would make a file that cannot be read back.
void check(const Mesh& mesh, bool single_precision) {
    const double limit =
        single_precision ? double{std::numeric_limits<float>::max()} : std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3 v = mesh.vertices[i];
        for (int axis = 0; axis < 3; ++axis) {
            if (!(std::abs(v[axis]) <= limit)) {
                throw InputError(fmt::format(
                    "cannot write vertex {}: its coordinate {} is beyond {}", i, v[axis],
                    single_precision ? "the 32-bit numbers of STL and GLB; use .ply" : "all numbers"));
            }
        }
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const std::uint32_t v : mesh.triangles[i]) {
            if (v >= mesh.vertices.size()) {
                throw InputError(fmt::format("cannot write triangle {}: it uses vertex {} of {}", i, v,
                                             mesh.vertices.size()));
            }
        }
    }
}

/// glTF 2.0 names its numbers' types and buffers' uses so.
constexpr int gltf_float = 5126, gltf_uint32 = 5125, gltf_byte = 5121, gltf_vertices = 34962,
              gltf_indices = 34963;

/// A mesh of a GLB file.
struct GlbMesh {
    std::string name;
    const Mesh* mesh;
    VertexAttributes attributes;

    std::uint64_t bytes() const {
        return 12 * (mesh->vertices.size() + mesh->triangles.size()) + 12 * attributes.normals.size() +
               8 * attributes.texture.size() + (attributes.byte_colours ? 4 : 16) * attributes.colours.size();
    }
};

/// Where a GLB file's coordinates are relative to: (0, 0, 0), or the centre of the bounds if it is so far away
/// that 32 bits would lose more than two of them.
Vec3 glb_centre(const Box& box) {
    double size = 0, far = 0;
    for (int axis = 0; axis < 3; ++axis) {
        size = std::max(size, box.max[axis] - box.min[axis]);
        far = std::max({far, std::abs(box.min[axis]), std::abs(box.max[axis])});
    }
    return far > 4 * size ? 0.5 * (box.min + box.max) : Vec3{};
}

/// Bounds of all vertices.
Box bounds_of(std::span<const GlbMesh> meshes) {
    constexpr double huge = std::numeric_limits<double>::max();
    Box box{{huge, huge, huge}, {-huge, -huge, -huge}};
    for (const GlbMesh& named : meshes)
        for (const Vec3& v : named.mesh->vertices)
            for (int axis = 0; axis < 3; ++axis) {
                box.min[axis] = std::min(box.min[axis], v[axis]);
                box.max[axis] = std::max(box.max[axis], v[axis]);
            }
    return box;
}

/// The JSON of a GLB file whose buffer has each mesh's vertices, its indices, then its attributes.
nlohmann::ordered_json glb_json(std::span<const GlbMesh> meshes, const Vec3& centre) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["asset"] = {{"version", "2.0"}, {"generator", "its " ITS_VERSION}};
    json["scene"] = 0;
    std::uint64_t offset = 0, accessors = 0;
    // Adds an accessor with a view of its own, and returns its number.
    const auto add = [&](Json accessor, std::uint64_t bytes, int target) {
        accessor["bufferView"] = accessors;
        json["accessors"].push_back(std::move(accessor));
        json["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}, {"target", target}});
        offset += bytes;
        return accessors++;
    };
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        const Mesh& mesh = *meshes[i].mesh;
        const auto& [colours, texture, normals, bytes] = meshes[i].attributes;
        const std::uint64_t count = mesh.vertices.size();
        const Box box = bounds_of(meshes.subspan(i, 1));
        Json low = Json::array(), high = Json::array();
        for (int axis = 0; axis < 3; ++axis) {
            low.push_back(float(box.min[axis] - centre[axis]));
            high.push_back(float(box.max[axis] - centre[axis]));
        }
        const auto floats = [&](const char* type) {
            return Json{{"componentType", gltf_float}, {"count", count}, {"type", type}};
        };
        Json positions = floats("VEC3");
        positions["min"] = low;
        positions["max"] = high;
        Json attributes = {{"POSITION", add(positions, 12 * count, gltf_vertices)}};
        const std::uint64_t indices =
            add({{"componentType", gltf_uint32}, {"count", 3 * mesh.triangles.size()}, {"type", "SCALAR"}},
                12 * mesh.triangles.size(), gltf_indices);
        if (!colours.empty()) {
            Json accessor = floats("VEC4");
            if (bytes) accessor["componentType"] = gltf_byte, accessor["normalized"] = true;
            attributes["COLOR_0"] = add(accessor, (bytes ? 4 : 16) * count, gltf_vertices);
        }
        if (!texture.empty()) attributes["TEXCOORD_0"] = add(floats("VEC2"), 8 * count, gltf_vertices);
        if (!normals.empty()) attributes["NORMAL"] = add(floats("VEC3"), 12 * count, gltf_vertices);
        const Json primitive = {{"attributes", attributes}, {"indices", indices}};
        json["meshes"].push_back({{"name", meshes[i].name}, {"primitives", Json::array({primitive})}});
        json["nodes"].push_back({{"name", meshes[i].name}, {"mesh", i}});
        if (centre != Vec3{}) json["nodes"].back()["translation"] = {centre.x, centre.y, centre.z};
        json["scenes"][0]["nodes"].push_back(i);
    }
    json["buffers"].push_back({{"byteLength", offset}});
    return json;
}

void write_glb_data(const GlbMesh& named, const Vec3& centre, NewFile& file) {
    for (const Vec3& v : named.mesh->vertices)
        for (int axis = 0; axis < 3; ++axis) file.raw(float(v[axis] - centre[axis]));
    for (const auto& [a, b, c] : named.mesh->triangles) file.raw(a).raw(b).raw(c);
    for (const Colour& colour : named.attributes.colours)
        for (const float x : colour) named.attributes.byte_colours ? file.raw(byte_of(x)) : file.raw(x);
    for (const auto& [u, v] : named.attributes.texture) file.raw(float(u)).raw(float(1 - v));  // v points down
    for (const Vec3& n : named.attributes.normals) file.raw(float(n.x)).raw(float(n.y)).raw(float(n.z));
}

void write_glb(std::span<const GlbMesh> meshes, const std::filesystem::path& path) {
    std::uint64_t buffer = 0;
    for (const GlbMesh& named : meshes) {
        check(*named.mesh, true);
        if (named.mesh->triangles.empty())
            throw InputError(fmt::format(
                "cannot write '{}': a GLB file has no place for a mesh without triangles", path.string()));
        buffer += named.bytes();
    }
    const Vec3 centre = glb_centre(bounds_of(meshes));
    std::string text = glb_json(meshes, centre).dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::uint64_t total = 12 + 8 + text.size() + 8 + buffer;
    if (meshes.empty() || total > std::numeric_limits<std::uint32_t>::max())
        throw InputError(fmt::format("cannot write '{}': a GLB file holds 1 byte to 4 GB; write .ply instead",
                                     path.string()));

    NewFile file(path);
    file << "glTF";
    file.raw(std::uint32_t{2}).raw(std::uint32_t(total)).raw(std::uint32_t(text.size()));
    file << "JSON" << text;
    file.raw(std::uint32_t(buffer)) << std::string_view("BIN\0", 4);
    for (const GlbMesh& named : meshes) write_glb_data(named, centre, file);
    file.commit();
}

/// What a file of this extension cannot hold, a line for each.
std::vector<std::string> losses(const MeshAttributes& attributes, const std::string& extension) {
    std::vector<std::string> lines;
    if (extension == ".stl") {
        if (!attributes.colours.empty()) lines.emplace_back("STL files have no colours");
        if (!attributes.texture.empty()) lines.emplace_back("STL files have no texture coordinates");
        if (!attributes.normals.empty()) lines.emplace_back("STL files have no normals of vertices");
    }
    const auto& colours = attributes.colours.values;
    if (extension == ".obj" && std::any_of(colours.begin(), colours.end(), [](auto& c) { return c[3] != 1; }))
        lines.emplace_back("OBJ files have no transparency of colours");
    return lines;
}

/// The mesh, and its attributes where it has any.
void write(const Mesh& mesh, const MeshAttributes& attributes, const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    const bool known = extension == ".obj" || extension == ".stl" || extension == ".ply" ||
                       extension == ".off" || extension == ".glb";
    if (!known)
        throw OptionError(fmt::format("cannot write '{}': the extension must be .obj, .stl, .ply, .off or .glb",
                                      path.string()));
    check(mesh, extension == ".stl" || extension == ".glb");
    check_attributes(mesh, attributes);
    // OBJ has tables for all but colours, STL has nothing.
    const MeshAttributes of_vertices = extension == ".obj"   ? MeshAttributes{attributes.colours, {}, {}, false}
                                       : extension == ".stl" ? MeshAttributes{}
                                                             : attributes;
    std::optional<SplitMesh> split;
    if (!of_vertices.empty()) split.emplace(mesh, of_vertices);
    const Mesh& out = split ? split->mesh : mesh;
    const VertexAttributes values = split ? split->attributes : VertexAttributes{};
    if (extension == ".glb") {
        const GlbMesh whole{path.stem().string(), &out, values};
        return write_glb(std::span(&whole, 1), path);
    }
    NewFile file(path);
    if (extension == ".obj") write_obj(out, values.colours, attributes.texture, attributes.normals, file);
    if (extension == ".stl") write_stl(out, file);
    if (extension == ".ply") write_ply(out, values, file);
    if (extension == ".off") write_off(out, values, file);
    file.commit();
}

}  // namespace

void write_glb(std::span<const NamedMesh> meshes, const std::filesystem::path& path) {
    std::vector<GlbMesh> bare;
    for (const NamedMesh& named : meshes) bare.push_back({named.name, named.mesh, {}});
    write_glb(std::span<const GlbMesh>(bare), path);
}

void write_mesh(const Mesh& mesh, const std::filesystem::path& path) {
    write(mesh, {}, path);
}

std::vector<std::string> write_mesh(const Mesh& mesh, const MeshAttributes& attributes,
                                    const std::filesystem::path& path) {
    write(mesh, attributes, path);
    return losses(attributes, lower_extension(path));
}

}  // namespace its
