#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "its/base.h"

/// Triangle meshes and their attributes.
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

using Colour = std::array<float, 4>;         ///< red, green, blue (sRGB), alpha; in [0, 1]
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

}  // namespace its
