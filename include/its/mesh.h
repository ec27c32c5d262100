#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "its/base.h"

/// Triangle meshes: reading, writing, and a report of their defects.
namespace its {

using Triangle = std::array<std::uint32_t, 3>;

/// An indexed triangle mesh. Any triangles: open, non-manifold, degenerate, in any order. The surface M
/// is the union of its triangles; vertices that no triangle uses are not part of it.
struct Mesh {
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;  ///< counter-clockwise seen from outside, where there is an outside
};

/// A mesh read from a file, with one line for each thing that was left out or mended on the way.
struct MeshFile {
    Mesh mesh;
    std::string format;  ///< "obj", "stl-ascii", "stl-binary", "ply-ascii", "ply-binary-le", …
    std::vector<std::string> warnings;
};

/// Reads .obj, .stl, .ply, .off, .glb, .gltf or .3mf (by content where the extension disagrees). Polygons
/// are triangulated; STL corners with identical coordinates become one vertex. Faces with indices out of
/// range or non-finite corners are left out, with a warning.
/// \throws FileError if the file cannot be read; InputError if it holds no usable triangle or is malformed.
MeshFile read_mesh(const std::filesystem::path& path);

/// Writes .obj, .stl (binary), .ply (binary), .off or .glb, by extension, to a temporary name that is then
/// renamed: an existing file is replaced only by a complete one. STL and GLB round coordinates to 32 bits, the
/// others keep every bit.
/// \throws FileError, OptionError (unknown extension), InputError (what the format cannot hold).
void write_mesh(const Mesh& mesh, const std::filesystem::path& path);

/// One of several meshes in a file. The mesh must outlive this.
struct NamedMesh {
    std::string name;  ///< of its node
    const Mesh* mesh = nullptr;
};

/// Writes meshes as nodes of one .glb file, in the same way. Coordinates are rounded to 32 bits; where the
/// meshes are far from the origin for their size, relative to the centre of their bounds, which the nodes'
/// translation has. \throws FileError; InputError (no triangles, or more than the format's 4 GB).
void write_glb(std::span<const NamedMesh> meshes, const std::filesystem::path& path);

/// How the inside of a mesh is defined.
enum class SignRule : std::uint8_t {
    winding,  ///< inside where the integer winding number is ≥ 1; needs every edge matched by its opposite
    generalized,    ///< generalized winding number > ½; for oriented meshes with boundary
    unsigned_rule,  ///< no inside: D ≥ 0, and the shell is around both sides of M
};

/// "winding", "generalized", "unsigned".
std::string_view name(SignRule rule);

/// What is known about a mesh before anything is built from it. Counts are of the mesh as it stands;
/// vertices with identical coordinates are taken as one for everything topological.
struct MeshReport {
    std::uint64_t vertices = 0;  ///< distinct positions used by triangles
    std::uint64_t triangles = 0;
    std::uint64_t degenerate = 0;          ///< zero area, exactly
    std::uint64_t duplicate = 0;           ///< triangles over three corners that an earlier triangle has too
    std::uint64_t boundary_edges = 0;      ///< with exactly one triangle
    std::uint64_t nonmanifold_edges = 0;   ///< with more than two
    std::uint64_t inconsistent_edges = 0;  ///< two triangles that run through it in the same direction
    std::uint64_t unbalanced_edges = 0;    ///< whose uses one way and the other do not cancel; 0: M is a cycle
    std::uint64_t components = 0;          ///< connected through shared vertices
    std::int64_t euler = 0;                ///< V − E + F
    bool closed = false;                   ///< no boundary edge, at least one triangle
    bool oriented = false;                 ///< no inconsistent edge
    Box bounds;
    double signed_volume = 0;                 ///< of the cones from the centre of the bounds; < 0: inside out
    SignRule sign = SignRule::unsigned_rule;  ///< what `auto` chooses
    std::string sign_reason;                  ///< one sentence: why
};

/// Examines a mesh. \throws InputError on indices out of range, non-finite coordinates, or no triangles.
MeshReport inspect(const Mesh& mesh);

}  // namespace its
