#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "base/output_file.h"
#include "geometry/vec3.h"
#include "its/mesh.h"
#include "its/version.h"
#include "mesh/readers.h"

namespace its {

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

void write_obj(const Mesh& mesh, NewFile& file) {
    for (const Vec3& v : mesh.vertices) file << "v " << v.x << " " << v.y << " " << v.z << "\n";
    for (const auto& [a, b, c] : mesh.triangles) {
        file << "f " << std::uint64_t{a} + 1 << " " << std::uint64_t{b} + 1 << " " << std::uint64_t{c} + 1
             << "\n";
    }
}

void write_off(const Mesh& mesh, NewFile& file) {
    file << "OFF\n"
         << std::uint64_t{mesh.vertices.size()} << " " << std::uint64_t{mesh.triangles.size()} << " 0\n";
    for (const Vec3& v : mesh.vertices) file << v.x << " " << v.y << " " << v.z << "\n";
    for (const auto& [a, b, c] : mesh.triangles) {
        file << "3 " << std::uint64_t{a} << " " << std::uint64_t{b} << " " << std::uint64_t{c} << "\n";
    }
}

void write_ply(const Mesh& mesh, NewFile& file) {
    // Signed indices are what most programs expect; they do for all but the largest meshes.
    const bool small = mesh.vertices.size() <= std::size_t{std::numeric_limits<std::int32_t>::max()};
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << std::uint64_t{mesh.vertices.size()}
         << "\nproperty double x\nproperty double y\nproperty double z\nelement face "
         << std::uint64_t{mesh.triangles.size()} << "\nproperty list uchar " << (small ? "int" : "uint")
         << " vertex_indices\nend_header\n";
    for (const Vec3& v : mesh.vertices) file.raw(v.x).raw(v.y).raw(v.z);
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
constexpr int gltf_float = 5126, gltf_uint32 = 5125, gltf_vertices = 34962, gltf_indices = 34963;

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
Box bounds_of(std::span<const NamedMesh> meshes) {
    constexpr double huge = std::numeric_limits<double>::max();
    Box box{{huge, huge, huge}, {-huge, -huge, -huge}};
    for (const NamedMesh& named : meshes)
        for (const Vec3& v : named.mesh->vertices)
            for (int axis = 0; axis < 3; ++axis) {
                box.min[axis] = std::min(box.min[axis], v[axis]);
                box.max[axis] = std::max(box.max[axis], v[axis]);
            }
    return box;
}

/// The JSON of a GLB file whose buffer has each mesh's vertices, then its indices.
nlohmann::ordered_json glb_json(std::span<const NamedMesh> meshes, const Vec3& centre) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["asset"] = {{"version", "2.0"}, {"generator", "its " ITS_VERSION}};
    json["scene"] = 0;
    std::uint64_t offset = 0;
    const auto add_view = [&](std::uint64_t bytes, int target) {
        json["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}, {"target", target}});
        offset += bytes;
    };
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        const Mesh& mesh = *meshes[i].mesh;
        const Box box = bounds_of(meshes.subspan(i, 1));
        Json low = Json::array(), high = Json::array();
        for (int axis = 0; axis < 3; ++axis) {
            low.push_back(float(box.min[axis] - centre[axis]));
            high.push_back(float(box.max[axis] - centre[axis]));
        }
        json["accessors"].push_back({{"bufferView", 2 * i},
                                     {"componentType", gltf_float},
                                     {"count", mesh.vertices.size()},
                                     {"type", "VEC3"},
                                     {"min", low},
                                     {"max", high}});
        json["accessors"].push_back({{"bufferView", 2 * i + 1},
                                     {"componentType", gltf_uint32},
                                     {"count", 3 * mesh.triangles.size()},
                                     {"type", "SCALAR"}});
        add_view(12 * mesh.vertices.size(), gltf_vertices);
        add_view(12 * mesh.triangles.size(), gltf_indices);
        Json primitive = {{"attributes", {{"POSITION", 2 * i}}}, {"indices", 2 * i + 1}};
        json["meshes"].push_back({{"name", meshes[i].name}, {"primitives", Json::array({primitive})}});
        json["nodes"].push_back({{"name", meshes[i].name}, {"mesh", i}});
        if (centre != Vec3{}) json["nodes"].back()["translation"] = {centre.x, centre.y, centre.z};
        json["scenes"][0]["nodes"].push_back(i);
    }
    json["buffers"].push_back({{"byteLength", offset}});
    return json;
}

}  // namespace

void write_glb(std::span<const NamedMesh> meshes, const std::filesystem::path& path) {
    std::uint64_t buffer = 0;
    for (const NamedMesh& named : meshes) {
        check(*named.mesh, true);
        if (named.mesh->triangles.empty())
            throw InputError(fmt::format(
                "cannot write '{}': a GLB file has no place for a mesh without triangles", path.string()));
        buffer += 12 * (named.mesh->vertices.size() + named.mesh->triangles.size());
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
    for (const NamedMesh& named : meshes) {
        for (const Vec3& v : named.mesh->vertices)
            for (int axis = 0; axis < 3; ++axis) file.raw(float(v[axis] - centre[axis]));
        for (const auto& [a, b, c] : named.mesh->triangles) file.raw(a).raw(b).raw(c);
    }
    file.commit();
}

void write_mesh(const Mesh& mesh, const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    void (*writer)(const Mesh&, NewFile&) = extension == ".obj"   ? write_obj
                                            : extension == ".stl" ? write_stl
                                            : extension == ".ply" ? write_ply
                                            : extension == ".off" ? write_off
                                                                  : nullptr;
    if (extension == ".glb") {
        const NamedMesh named{path.stem().string(), &mesh};
        return write_glb({&named, 1}, path);
    }
    if (writer == nullptr) {
        throw OptionError(fmt::format("cannot write '{}': the extension must be .obj, .stl, .ply, .off or .glb",
                                      path.string()));
    }
    check(mesh, writer == write_stl);
    NewFile file(path);
    writer(mesh, file);
    file.commit();
}

}  // namespace its
