#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "its/mesh.h"

/// Files of meshes: reading and writing.
namespace its {

/// A mesh read from a file, with one line for each thing that was left out or mended on the way.
struct MeshFile {
    Mesh mesh;
    std::string format;  ///< "obj", "stl-ascii", "stl-binary", "ply-ascii", "ply-binary-le", …
    std::vector<std::string> warnings;
    MeshAttributes attributes;  ///< if they were asked for
};

struct ReadOptions {
    bool attributes = false;  ///< read colours, texture coordinates and normals too
};

/// Reads .obj, .stl, .ply, .off, .glb, .gltf or .3mf (by content where the extension disagrees). Polygons
/// are triangulated; STL corners with identical coordinates become one vertex. Faces with indices out of
/// range or non-finite corners are left out, with a warning.
/// \throws FileError if the file cannot be read; InputError if it holds no usable triangle or is malformed.
MeshFile read_mesh(const std::filesystem::path& path, const ReadOptions& options = {});

/// Writes .obj, .stl (binary), .ply (binary), .off or .glb, by extension, to a temporary name that is then
/// renamed: an existing file is replaced only by a complete one. STL and GLB round coordinates to 32 bits, the
/// others keep every bit.
/// \throws FileError, OptionError (unknown extension), InputError (what the format cannot hold).
void write_mesh(const MeshView& mesh, const std::filesystem::path& path);

/// The same with attributes, as far as the format holds them. Formats that keep them by vertex (all but OBJ)
/// have a vertex for each set of values that meets there, and none that no triangle uses.
/// \return a line for each thing that the format cannot hold
/// \throws besides, as check_attributes()
std::vector<std::string> write_mesh(const MeshView& mesh, const MeshAttributes& attributes,
                                    const std::filesystem::path& path);

/// One of several meshes in a file.
struct NamedMesh {
    std::string name;  ///< of its node; UTF-8
    MeshView mesh;     ///< its arrays must exist until the file is written
};

/// Writes meshes as nodes of one .glb file, in the same way. Coordinates are rounded to 32 bits; where the
/// meshes are far from the origin for their size, relative to the centre of their bounds, which the nodes'
/// translation has. \throws FileError; InputError (no triangles, or more than the format's 4 GB).
void write_glb(std::span<const NamedMesh> meshes, const std::filesystem::path& path);

}  // namespace its
