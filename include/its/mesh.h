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

/// Values at the corners of a mesh's triangles: corner k of triangle t has values[corners[t][k]]. Where
/// triangles meet, equal values mean that the attribute is continuous there, and different ones a seam.
template <class Value>
struct CornerValues {
    std::vector<Value> values;
    std::vector<Triangle> corners;  ///< as many as the mesh has triangles; empty: no such attribute

    bool empty() const { return corners.empty(); }
    const Value& at(std::size_t triangle, std::size_t corner) const {
        return values[corners[triangle][corner]];
    }
};

using Colour = std::array<float, 4>;         ///< red, green, blue, alpha in [0, 1], as the file has them
using TexturePoint = std::array<double, 2>;  ///< u to the right, v upwards in the picture

/// What a mesh may have besides its shape. All values are finite.
struct MeshAttributes {
    CornerValues<Colour> colours;
    CornerValues<TexturePoint> texture;
    CornerValues<Vec3> normals;
    bool byte_colours = false;  ///< the file had colours of 8 bits; writers write such again

    bool empty() const { return colours.empty() && texture.empty() && normals.empty(); }
};

/// \throws InputError unless the attributes are of this mesh: their numbers in range, their values finite
void check_attributes(const Mesh& mesh, const MeshAttributes& attributes);

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
void write_mesh(const Mesh& mesh, const std::filesystem::path& path);

/// The same with attributes, as far as the format holds them. Formats that keep them by vertex (all but OBJ)
/// have a vertex for each set of values that meets there, and none that no triangle uses.
/// \return a line for each thing that the format cannot hold
/// \throws besides, as check_attributes()
std::vector<std::string> write_mesh(const Mesh& mesh, const MeshAttributes& attributes,
                                    const std::filesystem::path& path);

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
    generalized,    ///< generalized winding number > ½, within M's bounds; for oriented meshes with boundary
    unsigned_rule,  ///< no inside: D ≥ 0, and the shell is around both sides of M
    even_odd,  ///< inside where a ray to infinity crosses M an odd number of times, whatever the directions of
               ///< its triangles; needs every edge to have an even number of them
};

/// "winding", "generalized", "unsigned", "even-odd".
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
    std::uint64_t odd_edges = 0;   ///< with an odd number of triangles; 0: even-odd crossings are defined
    std::uint64_t components = 0;  ///< connected through shared vertices
    std::int64_t euler = 0;        ///< V − E + F
    bool closed = false;           ///< no boundary edge, at least one triangle
    bool oriented = false;         ///< no inconsistent edge
    Box bounds;
    double signed_volume = 0;                 ///< of the cones from the centre of the bounds; < 0: inside out
    SignRule sign = SignRule::unsigned_rule;  ///< what `auto` chooses
    std::string sign_reason;                  ///< one sentence: why
    std::string sign_advice;   ///< another rule that makes sense, as an option of `its build`; empty: none
    std::uint64_t turned = 0;  ///< triangles that `auto` turns around before it builds; see oriented()
    double separating = 1;     ///< for meshes with boundary that agree about the outside: the share of the area
                               ///< that separates inside from outside once holes are filled, by 512 samples
};

/// Examines a mesh. \throws InputError on indices out of range, non-finite coordinates, or no triangles.
MeshReport inspect(const Mesh& mesh);

/// The mesh as `auto` builds it: triangles that MeshReport::turned counts have their second and third corner
/// exchanged, all else is the same. \throws as inspect().
Mesh oriented(const Mesh& mesh);

}  // namespace its
