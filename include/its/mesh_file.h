#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "its/mesh.h"

/// Files of meshes: reading and writing.
namespace ITS_API its {

/// A mesh read from a file, with one line for each thing that was left out or mended on the way.
struct MeshFile {
    Mesh mesh;
    std::string format;  ///< "obj", "stl-ascii", "stl-binary", "ply-ascii", "ply-binary-le", …
    std::vector<std::string> warnings;
    MeshAttributes attributes;  ///< if they were asked for
    /// y in glTF, z in 3MF; the other formats do not say. Coordinates are the file's in any case.
    UpAxis up = UpAxis::unknown;
};

struct ReadOptions {
    bool attributes = false;  ///< read colours, texture coordinates and normals too
};

/// Reads .obj, .stl, .ply, .off, .glb, .gltf or .3mf (by content where the extension disagrees). Polygons
/// are triangulated; STL corners with identical coordinates become one vertex. Faces with indices out of
/// range or non-finite corners are left out, with a warning.
/// \throws FileError if the file cannot be read; InputError if it holds no usable triangle or is malformed.
MeshFile read_mesh(const std::filesystem::path& path, const ReadOptions& options = {});

/// The same of a file's bytes.
/// \param extension  of its name, such as ".obj": what decides where the bytes do not; may be empty.
/// \throws InputError as read_mesh(), and where a .gltf file needs others
MeshFile decode_mesh(std::span<const std::byte> bytes, std::string_view extension = {},
                     const ReadOptions& options = {});

/// Whether files of this name keep every bit of coordinates: all but STL and GLB, which have 32-bit numbers.
bool keeps_doubles(const std::filesystem::path& path);

struct WriteOptions {
    /// PLY, OBJ and OFF too have 32-bit coordinates: programs that draw with such numbers read them as they
    /// are.
    bool single = false;
    /// GLB: the translation of the nodes, which their coordinates are relative to. Empty: none, or the centre
    /// of the meshes' bounds where they are far from the origin for their size.
    std::optional<Vec3> origin = {};
    /// GLB: the axis of the coordinates that points upwards. Its nodes turn it to y, which glTF calls up, by a
    /// matrix of 0 and ±1; the coordinates stay as they are. unknown: nothing is turned.
    /// \throws OptionError for formats without nodes
    UpAxis up = UpAxis::unknown;
};

/// Writes .obj, .stl (binary), .ply (binary), .off or .glb, by extension, to a temporary name that is then
/// renamed: an existing file is replaced only by a complete one. STL and GLB round coordinates to 32 bits, the
/// others keep every bit unless asked for 32.
/// \throws FileError, OptionError (unknown extension), InputError (what the format cannot hold).
void write_mesh(const MeshView& mesh, const std::filesystem::path& path, const WriteOptions& options = {});

/// The same with attributes, as far as the format holds them. Formats that keep them by vertex (all but OBJ)
/// have a vertex for each set of values that meets there, and none that no triangle uses.
/// \return a line for each thing that the format cannot hold
/// \throws besides, as check_attributes()
std::vector<std::string> write_mesh(const MeshView& mesh, const MeshAttributes& attributes,
                                    const std::filesystem::path& path, const WriteOptions& options = {});

/// A mesh as the bytes of a file, with a line for each thing that the format cannot hold.
struct EncodedMesh {
    std::vector<std::byte> bytes;
    std::vector<std::string> warnings;
};

/// What write_mesh() would write, in memory.
/// \param extension  ".obj", ".stl", ".ply", ".off" or ".glb"
/// \throws OptionError, InputError as write_mesh()
EncodedMesh encode_mesh(const MeshView& mesh, std::string_view extension, const WriteOptions& options = {},
                        const MeshAttributes& attributes = {});

/// One of several files.
struct MeshOutput {
    MeshView mesh;  ///< its arrays must exist until the file is written
    std::filesystem::path path;
};

/// Writes files in the same way, all or none: all are complete before the first replaces an existing one, and
/// where a later one cannot be put in its place those before get their old contents back.
void write_meshes(std::span<const MeshOutput> outputs, const WriteOptions& options = {});

/// One of several meshes in a file.
struct NamedMesh {
    std::string name;  ///< of its node; UTF-8
    MeshView mesh;     ///< its arrays must exist until the file is written
};

/// Writes meshes as nodes of one .glb file, in the same way.
/// \throws FileError; InputError (no triangles, more than the format's 4 GB, coordinates that are no 32-bit
///         numbers, indices out of range).
void write_glb(std::span<const NamedMesh> meshes, const std::filesystem::path& path,
               const WriteOptions& options = {});

/// The same in memory.
/// \throws InputError as write_glb()
std::vector<std::byte> encode_glb(std::span<const NamedMesh> meshes, const WriteOptions& options = {});

}  // namespace its
