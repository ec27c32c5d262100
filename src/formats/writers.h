#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/sink.h"
#include "its/mesh_file.h"
#include "mesh/arrays.h"

namespace its::formats {

/// One writer per file format. Each trusts its mesh: finite coordinates in the format's range, indices in
/// range.

/// Attributes of vertices: each list is empty or has one value for each vertex.
struct VertexAttributes {
    std::vector<Colour> colours;
    std::vector<TexturePoint> texture;
    std::vector<Vec3> normals;
    bool byte_colours = false;
};

/// A component of a colour in 8 bits.
inline std::uint8_t byte_of(float x) {
    return std::uint8_t(std::lround(std::clamp(x, 0.0F, 1.0F) * 255));
}

/// Texture coordinates and normals have tables of their own; a colour belongs to its vertex.
void write_obj(const mesh::Arrays& mesh, std::span<const Colour> colours,
               const CornerValues<TexturePoint>& texture, const CornerValues<Vec3>& normals, Sink& file);
void write_off(const mesh::Arrays& mesh, const VertexAttributes& attributes, Sink& file);
/// \param single  coordinates, normals and texture coordinates have 32 bits
void write_ply(const mesh::Arrays& mesh, const VertexAttributes& attributes, bool single, Sink& file);
/// Coordinates are rounded to 32 bits: the format has no others.
/// \throws InputError (too many triangles)
void write_stl(const mesh::Arrays& mesh, Sink& file);

/// A mesh of a GLB file.
struct GlbMesh {
    std::string name;
    mesh::Arrays mesh;
    VertexAttributes attributes;
};
/// Coordinates are rounded to 32 bits, about options.origin: if empty, a centre of their own where the meshes
/// are far away.
/// \throws InputError (no triangles, or more than the format's 4 GB)
void write_glb(std::span<const GlbMesh> meshes, const WriteOptions& options, const std::filesystem::path& path,
               Sink& file);
/// Where a GLB file's coordinates are relative to: (0, 0, 0), or the centre of the bounds if it is so far away
/// that 32 bits would lose more than two of them.
Vec3 glb_centre(const Box& box);

/// \throws InputError on what would make a file that cannot be read back.
void check_writable(const mesh::Arrays& mesh, bool single_precision);

}  // namespace its::formats
