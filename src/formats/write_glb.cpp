#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/quote.h"
#include "formats/colours.h"
#include "formats/writers.h"
#include "geometry/box.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"
#include "its/version.h"
#include "mesh/arrays.h"

namespace its::formats {

namespace {

/// glTF 2.0 names its numbers' types and buffers' uses so.
constexpr int gltf_float = 5126, gltf_uint32 = 5125, gltf_uint16 = 5123, gltf_vertices = 34962,
              gltf_indices = 34963;

/// Bytes of a mesh in the buffer.
std::uint64_t bytes_of(const GlbMesh& named) {
    const auto& [colours, texture, normals, bytes] = named.attributes;
    return 12 * (named.mesh.vertices.size() + named.mesh.triangles.size()) + 12 * normals.size() +
           8 * texture.size() + (bytes ? 8 : 16) * colours.size();
}

/// Bounds of all vertices.
Box bounds_of(std::span<const GlbMesh> meshes) {
    Box box = geometry::empty_box;
    for (const GlbMesh& named : meshes) geometry::extend(box, geometry::bounds(named.mesh.vertices));
    return box;
}

using Json = nlohmann::ordered_json;

/// Where a node has its mesh: a translation, and a rotation if an axis other than glTF's y is up. Rotations are
/// those of COLLADA's up_axis: z up to y by (x, z, −y), x up to y by (−y, x, z).
void place(Json& node, const Vec3& centre, UpAxis up) {
    const auto& [x, y, z] = centre;
    if (up == UpAxis::z)
        node["matrix"] = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, x, z, 0 - y, 1};
    else if (up == UpAxis::x)
        node["matrix"] = {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0 - y, x, z, 1};
    else if (centre != Vec3{})
        node["translation"] = {x, y, z};
}

/// The JSON of a GLB file whose buffer has each mesh's vertices, its indices, then its attributes.
Json glb_json(std::span<const GlbMesh> meshes, const Vec3& centre, UpAxis up) {
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
        const mesh::Arrays& mesh = meshes[i].mesh;
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
            if (bytes) accessor["componentType"] = gltf_uint16, accessor["normalized"] = true;
            attributes["COLOR_0"] = add(accessor, (bytes ? 8 : 16) * count, gltf_vertices);
        }
        if (!texture.empty()) attributes["TEXCOORD_0"] = add(floats("VEC2"), 8 * count, gltf_vertices);
        if (!normals.empty()) attributes["NORMAL"] = add(floats("VEC3"), 12 * count, gltf_vertices);
        const Json primitive = {{"attributes", attributes}, {"indices", indices}};
        json["meshes"].push_back({{"name", meshes[i].name}, {"primitives", Json::array({primitive})}});
        json["nodes"].push_back({{"name", meshes[i].name}, {"mesh", i}});
        place(json["nodes"].back(), centre, up);
        json["scenes"][0]["nodes"].push_back(i);
    }
    json["buffers"].push_back({{"byteLength", offset}});
    return json;
}

/// In linear light, as glTF has it, except for alpha. 8 bits of sRGB need more than 8 bits there.
void write_colour(const Colour& colour, bool bytes, Sink& file) {
    for (std::size_t k = 0; k < 4; ++k) {
        const double x = std::clamp(double{colour[k]}, 0.0, 1.0);
        const double linear = k < 3 ? linear_of_srgb(x) : x;
        bytes ? file.raw(std::uint16_t(std::lround(linear * 65535))) : file.raw(float(linear));
    }
}

void write_glb_data(const GlbMesh& named, const Vec3& centre, Sink& file) {
    for (const Vec3& v : named.mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) file.raw(float(v[axis] - centre[axis]));
    for (const auto& [a, b, c] : named.mesh.triangles) file.raw(a).raw(b).raw(c);
    for (const Colour& colour : named.attributes.colours)
        write_colour(colour, named.attributes.byte_colours, file);
    for (const auto& [u, v] : named.attributes.texture) file.raw(float(u)).raw(float(1 - v));  // v points down
    for (const Vec3& n : named.attributes.normals) file.raw(float(n.x)).raw(float(n.y)).raw(float(n.z));
}

}  // namespace

Vec3 glb_centre(const Box& box) {
    if (!(box.min.x <= box.max.x)) return {};  // of nothing
    double size = 0, far = 0;
    for (int axis = 0; axis < 3; ++axis) {
        size = std::max(size, box.max[axis] - box.min[axis]);
        far = std::max({far, std::abs(box.min[axis]), std::abs(box.max[axis])});
    }
    return far > 4 * size ? 0.5 * box.min + 0.5 * box.max : Vec3{};
}

void write_glb(std::span<const GlbMesh> meshes, const WriteOptions& options, const std::filesystem::path& path,
               Sink& file) {
    std::uint64_t buffer = 0;
    for (const GlbMesh& named : meshes) {
        check_writable(named.mesh, true);
        if (named.mesh.triangles.empty())
            throw InputError(fmt::format(
                "cannot write '{}': a GLB file has no place for a mesh without triangles", shown(path)));
        buffer += bytes_of(named);
    }
    const Vec3 centre = options.origin ? *options.origin : glb_centre(bounds_of(meshes));
    std::string text = glb_json(meshes, centre, options.up).dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::uint64_t total = 12 + 8 + text.size() + 8 + buffer;
    if (meshes.empty() || total > std::numeric_limits<std::uint32_t>::max())
        throw InputError(
            fmt::format("cannot write '{}': a GLB file holds 1 byte to 4 GB; write .ply instead", shown(path)));

    file << "glTF";
    file.raw(std::uint32_t{2}).raw(std::uint32_t(total)).raw(std::uint32_t(text.size()));
    file << "JSON" << text;
    file.raw(std::uint32_t(buffer)) << std::string_view("BIN\0", 4);
    for (const GlbMesh& named : meshes) write_glb_data(named, centre, file);
}

}  // namespace its::formats
