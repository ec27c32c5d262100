#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <optional>

#include "base/quote.h"
#include "base/single.h"
#include "formats/readers.h"
#include "formats/writers.h"
#include "geometry/box.h"
#include "its/mesh_file.h"
#include "mesh/arrays.h"
#include "mesh/attributes.h"

namespace its {
using namespace formats;

namespace {

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

    SplitMesh(const mesh::Arrays& whole, const MeshAttributes& of) {
        mesh::Wedges wedges = mesh::wedges_of(whole.triangles, whole.vertices.size(), of);
        for (const std::uint64_t c : wedges.first)
            mesh.vertices.push_back(whole.vertices[whole.triangles[c / 3][c % 3]]);
        mesh.triangles = std::move(wedges.triangles);
        attributes = {values_at(of.colours, wedges.first), values_at(of.texture, wedges.first),
                      values_at(of.normals, wedges.first), of.byte_colours};
    }
};

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

/// The texts of such numbers have the digits of doubles: readers of 32 and of 64 bits get the very same ones.
Mesh rounded_to_single(const mesh::Arrays& mesh) {
    Mesh rounded = mesh::copy_of(mesh);
    for (Vec3& v : rounded.vertices) v = {to_single(v.x), to_single(v.y), to_single(v.z)};
    return rounded;
}

/// Before anything is written.
/// \throws OptionError, InputError
void check(const mesh::Arrays& mesh, const MeshAttributes& attributes, const std::filesystem::path& path,
           const WriteOptions& options) {
    const std::string extension = lower_extension(path);
    const bool known = extension == ".obj" || extension == ".stl" || extension == ".ply" ||
                       extension == ".off" || extension == ".glb";
    if (!known)
        throw OptionError(fmt::format("cannot write '{}': the extension must be .obj, .stl, .ply, .off or .glb",
                                      shown(path)));
    if (options.up != UpAxis::unknown && extension != ".glb")
        throw OptionError(fmt::format(
            "cannot write '{}' with an axis that is up: of the formats only .glb has a place for it",
            shown(path)));
    check_writable(mesh, options.single || !keeps_doubles(path));
    check_attributes(mesh.view(), attributes);
}

/// The mesh, checked, and its attributes where it has any, in the format that the path's extension names.
void write(const mesh::Arrays& mesh, const MeshAttributes& attributes, const std::filesystem::path& path,
           const WriteOptions& options, Sink& file) {
    const std::string extension = lower_extension(path);
    // OBJ has tables for all but colours, STL has nothing.
    const MeshAttributes of_vertices = extension == ".obj"   ? MeshAttributes{attributes.colours, {}, {}, false}
                                       : extension == ".stl" ? MeshAttributes{}
                                                             : attributes;
    std::optional<SplitMesh> split;
    if (!of_vertices.empty()) split.emplace(mesh, of_vertices);
    const mesh::Arrays out = split ? split->mesh : mesh;
    const VertexAttributes values = split ? split->attributes : VertexAttributes{};
    if (extension == ".glb") {
        const GlbMesh whole{path.stem().string(), out, values};
        return formats::write_glb(std::span(&whole, 1), options, path, file);
    }
    if (extension == ".stl") write_stl(out, file);
    if (extension == ".ply") write_ply(out, values, options.single, file);
    const bool text = extension == ".obj" || extension == ".off";
    const Mesh rounded = text && options.single ? rounded_to_single(out) : Mesh{};
    const mesh::Arrays written = text && options.single ? mesh::Arrays(rounded) : out;
    if (extension == ".obj") write_obj(written, values.colours, attributes.texture, attributes.normals, file);
    if (extension == ".off") write_off(written, values, file);
}

/// A whole file, under its temporary name.
std::unique_ptr<NewFile> new_file(const mesh::Arrays& mesh, const MeshAttributes& attributes,
                                  const std::filesystem::path& path, const WriteOptions& options) {
    check(mesh, attributes, path, options);
    auto file = std::make_unique<NewFile>(path);
    write(mesh, attributes, path, options, *file);
    return file;
}

/// Meshes of the caller, as writers know them, for as long as this lives.
class GlbMeshes {
public:
    explicit GlbMeshes(std::span<const NamedMesh> meshes) {
        for (const NamedMesh& named : meshes)
            glb_.push_back({named.name, native_.emplace_back(named.mesh).arrays(), {}});
    }
    std::span<const GlbMesh> meshes() const { return glb_; }

private:
    std::deque<mesh::Native> native_;
    std::vector<GlbMesh> glb_;
};

}  // namespace

void formats::check_writable(const mesh::Arrays& mesh, bool single_precision) {
    const double limit =
        single_precision ? double{std::numeric_limits<float>::max()} : std::numeric_limits<double>::max();
    double largest = 0;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3 v = mesh.vertices[i];
        for (int axis = 0; axis < 3; ++axis) {
            largest = std::max(largest, std::abs(v[axis]));
            if (!(std::abs(v[axis]) <= limit)) {
                throw InputError(
                    fmt::format("cannot write vertex {}: its coordinate {} is beyond {}", i, v[axis],
                                single_precision ? "all 32-bit numbers; write .ply, .obj or .off with doubles"
                                                 : "all numbers"));
            }
        }
    }
    // Smaller numbers of 32 bits have fewer digits than the others.
    if (single_precision && largest > 0 && largest < double{std::numeric_limits<float>::min()})
        throw InputError(
            fmt::format("cannot write coordinates of {:.3g} at most as 32-bit numbers, which have no "
                        "digits there; write .ply, .obj or .off with doubles",
                        largest));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const std::uint32_t v : mesh.triangles[i]) {
            if (v >= mesh.vertices.size()) {
                throw InputError(fmt::format("cannot write triangle {}: it uses vertex {} of {}", i, v,
                                             mesh.vertices.size()));
            }
        }
    }
}

bool keeps_doubles(const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    return extension != ".stl" && extension != ".glb";
}

void write_glb(std::span<const NamedMesh> meshes, const std::filesystem::path& path,
               const WriteOptions& options) {
    const GlbMeshes glb(meshes);
    NewFile file(path);
    formats::write_glb(glb.meshes(), options, path, file);
    file.commit();
}

std::vector<std::byte> encode_glb(std::span<const NamedMesh> meshes, const WriteOptions& options) {
    const GlbMeshes glb(meshes);
    Memory memory;
    formats::write_glb(glb.meshes(), options, "mesh.glb", memory);
    return memory.take();
}

void write_mesh(const MeshView& mesh, const std::filesystem::path& path, const WriteOptions& options) {
    new_file(mesh::Native(mesh), {}, path, options)->commit();
}

std::vector<std::string> write_mesh(const MeshView& mesh, const MeshAttributes& attributes,
                                    const std::filesystem::path& path, const WriteOptions& options) {
    new_file(mesh::Native(mesh), attributes, path, options)->commit();
    return losses(attributes, lower_extension(path));
}

EncodedMesh encode_mesh(const MeshView& mesh, std::string_view extension, const WriteOptions& options,
                        const MeshAttributes& attributes) {
    const std::filesystem::path path = fmt::format("mesh{}", extension);
    const mesh::Native native(mesh);
    check(native, attributes, path, options);
    Memory memory;
    write(native, attributes, path, options, memory);
    return {memory.take(), losses(attributes, lower_extension(path))};
}

void write_meshes(std::span<const MeshOutput> outputs, const WriteOptions& options) {
    std::vector<std::unique_ptr<NewFile>> files;
    std::vector<OutputFile*> complete;
    for (const MeshOutput& output : outputs) {
        files.push_back(new_file(mesh::Native(output.mesh), {}, output.path, options));
        complete.push_back(&files.back()->complete());
    }
    OutputFile::commit_all(complete);
}

}  // namespace its
